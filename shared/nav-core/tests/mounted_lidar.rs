//! A lidar that sits anywhere on the robot: what stands around it is where it is.

use nav_core::footprint::Footprint;
use nav_core::geometry::{Point, Pose};
use nav_core::local_map::{Cell, LocalMap};
use nav_core::messages::{Header, LaserScan};
use nav_core::scan::{SECTOR_COUNT, ScanGeometry, ScanReader, ScanView, sector_angle_rad};
use nav_core::task::{Lidar, Robot, Task};
use std::f32::consts::{PI, TAU};

/// A room about the robot: how far its walls are to the right, to the left, below and above, m.
#[derive(Clone, Copy)]
struct Room {
    low: Point,
    high: Point,
    /// And a round pillar.
    pillar: Point,
}

const PILLAR_M: f32 = 0.3;

impl Room {
    /// From a place in a direction to what stands there, m.
    fn range_m(&self, from: Point, angle_rad: f32) -> f32 {
        let (sin, cos) = angle_rad.sin_cos();
        let wall_m = |at: f32, way: f32, low: f32, high: f32| {
            ((if way >= 0.0 { high } else { low }) - at) / way.abs().max(1e-9) * way.signum()
        };
        let walls_m =
            wall_m(from.x, cos, self.low.x, self.high.x).min(wall_m(from.y, sin, self.low.y, self.high.y));
        let to = self.pillar - from;
        let (along, aside) = (to.x * cos + to.y * sin, to.y * cos - to.x * sin);
        let rest = PILLAR_M * PILLAR_M - aside * aside;
        if along > 0.0 && rest > 0.0 { walls_m.min(along - rest.sqrt()) } else { walls_m }
    }

    /// From a point to the nearest surface, m.
    fn off_m(&self, at: Point) -> f32 {
        let walls = [at.x - self.low.x, self.high.x - at.x, at.y - self.low.y, self.high.y - at.y];
        let walls_m = walls.into_iter().fold(f32::INFINITY, |least, off_m| least.min(off_m.abs()));
        walls_m.min(((at - self.pillar).norm() - PILLAR_M).abs())
    }
}

fn task(mount: Pose, field_of_view_rad: f32) -> Task {
    let footprint = Footprint::Rectangle { front_m: 0.4, rear_m: 0.4, half_width_m: 0.25 };
    let robot = Robot { footprint, linear_min_mps: -0.5, ..Robot::default() };
    let lidar = Lidar { mount, field_of_view_rad, beam_count: 180, ..Lidar::default() };
    Task { lidar, ..Task::of(robot) }
}

/// The scan that the lidar of a task takes in a room where the robot stands in the middle.
fn scan(task: &Task, room: &Room) -> LaserScan {
    let mount = task.lidar.mount;
    LaserScan::of(&task.lidar, |angle_rad| {
        let range_m = room.range_m(mount.position(), angle_rad + mount.yaw_rad);
        if range_m <= task.lidar.range_max_m { range_m } else { f32::INFINITY }
    })
}

fn view(task: &Task, scan: &LaserScan) -> ScanView {
    let geometry = ScanGeometry::new(task);
    let mut view = ScanView::new(&geometry);
    view.update(&geometry, ScanReader::new(task).read(scan, Pose::default()), scan.range_max_m);
    view
}

fn rooms() -> impl Iterator<Item = Room> {
    (0..12_u8).map(|k| {
        let k = f32::from(k);
        let (sin, cos) = (0.9 * k).sin_cos();
        Room {
            low: Point::new(-1.0 - 0.3 * k, -0.8 - 0.2 * k),
            high: Point::new(3.0 - 0.15 * k, 1.2 + 0.4 * k),
            pillar: Point::new(0.85 * cos, 0.85 * sin),
        }
    })
}

const MOUNTS: [Pose; 4] = [
    Pose::new(0.3, 0.0, 0.0),
    Pose::new(0.0, 0.0, 0.7),
    Pose::new(0.2, -0.15, -2.0),
    Pose::new(-0.3, 0.1, PI),
];

#[test]
fn obstacles_are_seen_where_they_are() {
    for room in rooms() {
        let centred = task(Pose::default(), TAU);
        let expected = view(&centred, &scan(&centred, &room));
        for mount in MOUNTS {
            let task = task(mount, TAU);
            let view = view(&task, &scan(&task, &room));
            assert!(view.hits().len() > 60);
            for hit in view.hits() {
                assert!(room.off_m(hit.point) < 1e-3, "{mount:?}: {hit:?}");
                assert!((hit.point.coords.norm() - hit.range_m).abs() < 1e-5);
            }
            let mut differ = 0;
            for (sector, (&found_m, &expected_m)) in
                view.sectors_m().iter().zip(expected.sectors_m()).enumerate()
            {
                // Nothing is farther than it is.
                let farthest_m = (0..=20_u8)
                    .map(|part| sector_angle_rad(sector) + (f32::from(part) / 20.0 - 0.5) * 0.24)
                    .map(|angle_rad| room.range_m(Point::origin(), angle_rad))
                    .fold(0.0, f32::max);
                assert!(found_m < farthest_m + 0.02, "{mount:?}, {sector}: {found_m}, {farthest_m}");
                differ += u32::from((found_m - expected_m).abs() > 0.08 + 0.12 * expected_m);
            }
            // What one sees past the edge of the pillar the other does not.
            assert!(differ <= 5, "{mount:?}: {differ} sectors differ");
            for (cos, sin) in [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.6, -0.8)] {
                let lane = task.robot.footprint.lane(0.02);
                let [found_m, expected_m] =
                    [&view, &expected].map(|view| view.corridor_m(cos, sin, &lane, 4.0));
                assert!((found_m - expected_m).abs() < 0.12, "{mount:?}: {found_m}, {expected_m} m free");
            }
        }
    }
}

#[test]
fn what_nobody_sees_is_not_free() {
    let room =
        Room { low: Point::new(-2.0, -1.5), high: Point::new(2.5, 1.5), pillar: Point::new(-1.5, 1.2) };
    let ahead = task(Pose::new(0.35, 0.0, 0.0), PI);
    let front = view(&ahead, &scan(&ahead, &room));
    assert!(!front.is_closed_ahead() && front.is_closed_behind(), "it looks ahead");
    let (middle, behind) = (SECTOR_COUNT / 2, 0);
    assert!((front.sectors_m()[middle] - 2.5).abs() < 0.1, "{:?}", front.sectors_m());
    assert!((front.sectors_m()[behind] - 5.0).abs() < 1e-6, "nothing was ever known there");
    // The same lidar at the back: it looks where the robot comes from.
    let back = task(Pose::new(-0.35, 0.0, PI), PI);
    let rear = view(&back, &scan(&back, &room));
    assert!(
        !rear.is_closed_behind() && (rear.sectors_m()[behind] - 2.0).abs() < 0.1,
        "{:?}",
        rear.sectors_m()
    );
    // Beams that fail, ahead of the robot: of a lidar that is turned, others than its middle ones.
    let turned = task(Pose::new(0.1, 0.1, 1.2), TAU);
    let mut failed = scan(&turned, &room);
    for beam in 0..turned.lidar.beam_count as usize {
        if (turned.lidar.beam_angle_rad(beam) + 1.2).abs() < 0.3 {
            failed.ranges_m[beam] = f32::NAN;
        }
    }
    let veiled = view(&turned, &failed);
    assert!(veiled.is_closed_ahead() && !veiled.is_closed_behind());
    assert!(veiled.corridor_m(1.0, 0.0, &turned.robot.footprint.lane(0.02), 4.0) <= 0.0);
}

#[test]
fn a_failed_beam_shows_what_was_there_from_where_the_lidar_is_now() {
    let room =
        Room { low: Point::new(-2.0, -1.5), high: Point::new(2.5, 1.5), pillar: Point::new(-1.5, 1.2) };
    let task = task(Pose::new(0.3, 0.0, 0.0), TAU);
    let (mut reader, geometry) = (ScanReader::new(&task), ScanGeometry::new(&task));
    let mut view = ScanView::new(&geometry);
    let seen = LaserScan { header: Header { stamp_ns: 100_000_000, seq: 1 }, ..scan(&task, &room) };
    view.update(&geometry, reader.read(&seen, Pose::default()), 5.0);
    // It turned about its centre, and with it went the lidar: 0.3 m back, seen along what was ahead.
    let mut blind = LaserScan { header: Header { stamp_ns: 200_000_000, seq: 2 }, ..seen };
    blind.ranges_m.fill(f32::NAN);
    view.update(&geometry, reader.read(&blind, Pose::new(0.0, 0.0, 0.5 * PI)), 5.0);
    let ahead = view.hits().iter().find(|hit| (hit.point.x - 0.3).abs() < 0.02 && hit.point.y < 0.0);
    let ahead = ahead.expect("the wall that was ahead lies to the right");
    assert!((ahead.point.y + 2.5).abs() < 0.05, "{ahead:?}");
}

/// Beams that are 10 degrees apart where they are measured are farther apart near the other end of the robot.
#[test]
fn between_coarse_beams_nothing_is_taken_for_unknown() {
    let room = Room { low: Point::new(-0.9, -0.7), high: Point::new(2.5, 0.7), pillar: Point::new(9.0, 9.0) };
    for mount in MOUNTS {
        let fine = task(mount, TAU);
        let coarse = Task { lidar: Lidar { beam_count: 36, ..fine.lidar }, ..fine };
        let view = view(&coarse, &scan(&coarse, &room));
        assert!(!view.is_closed_ahead() && !view.is_closed_behind(), "{mount:?}");
        for (sector, &found_m) in view.sectors_m().iter().enumerate() {
            let truth_m = room.range_m(Point::origin(), sector_angle_rad(sector));
            assert!((found_m - truth_m).abs() < 0.25 * truth_m, "{mount:?}, {sector}: {found_m}, {truth_m}");
        }
    }
}

/// What lies between the robot's centre and its lidar was not looked at.
#[test]
fn the_map_is_cleared_from_where_the_lidar_sits() {
    let robot = Robot { footprint: Footprint::circle(1.0), ..Robot::default() };
    let task = |lidar: Lidar| Task { lidar: Lidar { range_max_m: 5.0, ..lidar }, ..Task::of(robot) };
    let (around, ahead) = (
        task(Lidar::default()),
        task(Lidar { mount: Pose::new(0.9, 0.0, 0.0), field_of_view_rad: 0.3, ..Lidar::default() }),
    );
    let mut map = LocalMap::new(Point::origin(), 0.25, 1.0);
    let at = |map: &LocalMap, x_m: f32| {
        let cell = Cell::of(Point::new(x_m, 0.05), 0.25);
        map.occupancy_rows()[(cell.iy - map.origin().iy) as usize] >> (cell.ix - map.origin().ix) & 1 == 1
    };
    for range_m in [0.6, 2.1] {
        map.integrate(Point::origin(), 1.0, 0.0, &view(&around, &LaserScan::of(&around.lidar, |_| range_m)));
    }
    map.integrate(Point::origin(), 1.0, 0.0, &view(&around, &LaserScan::of(&around.lidar, |_| 0.6)));
    assert!(at(&map, 0.6) && at(&map, 2.1), "both are seen");
    for _ in 0..20 {
        let nothing = LaserScan::of(&ahead.lidar, |_| f32::INFINITY);
        map.integrate(Point::origin(), 1.0, 0.0, &view(&ahead, &nothing));
    }
    assert!(at(&map, 0.6) && !at(&map, 2.1), "the farther has gone, of the nearer nothing is known");
}

#[test]
fn what_is_too_near_to_be_measured_touches_the_outline() {
    let task = task(Pose::new(0.35, 0.0, 0.0), TAU);
    let touching = |bearing_rad: f32| {
        let scan = LaserScan::of(
            &task.lidar,
            |angle_rad| if (angle_rad - bearing_rad).abs() < 0.2 { 0.0 } else { 4.0 },
        );
        view(&task, &LaserScan { range_min_m: 0.3, ..scan })
    };
    // The front is 5 cm before the lidar, and its own shadow as long as the least range.
    let front = touching(0.0);
    assert!((front.nearest_m() - 0.4).abs() < 5e-3, "{}", front.nearest_m());
    assert!(front.is_closed_ahead());
    // Beside the lidar it is the side that is touched: the robot slides along it.
    let side = touching(1.57);
    assert!(side.nearest_m() < 0.45, "{}", side.nearest_m());
}
