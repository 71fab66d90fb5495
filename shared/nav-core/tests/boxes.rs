//! A rectangle sees from its outline, drives in a lane of its own width, and turns where its corners fit.

use nav_core::footprint::Footprint;
use nav_core::geometry::{Point, Pose};
use nav_core::messages::{Goal, Header, LaserScan, Odometry};
use nav_core::navigator::Navigator;
use nav_core::observation::LOW_OBSERVATION;
use nav_core::scan::{SECTOR_COUNT, ScanGeometry, ScanReader, ScanView, sector_angle_rad};
use nav_core::sent::Sent;
use nav_core::subgoal::{Candidates, direction_angle_rad};
use nav_core::task::{DIRECTION_COUNT, Robot, Task};

const LONG: Footprint = Footprint::Rectangle { front_m: 0.8, rear_m: 0.5, half_width_m: 0.3 };

fn view(task: &Task, scan: &LaserScan) -> ScanView {
    let geometry = ScanGeometry::new(task);
    let mut view = ScanView::new(&geometry);
    view.update(&geometry, ScanReader::new(task).read(scan, Pose::default()), scan.range_max_m);
    view
}

fn task(linear_min_mps: f32) -> Task {
    Task::of(Robot { footprint: LONG, linear_min_mps, ..Robot::default() })
}

/// Between two walls beside the robot, `half_m` away.
fn corridor(half_m: f32) -> impl Fn(f32) -> f32 {
    move |angle_rad: f32| {
        let range_m = half_m / angle_rad.sin().abs().max(1e-3);
        if range_m < 5.0 { range_m } else { f32::INFINITY }
    }
}

#[test]
fn clearance_is_measured_from_the_outline() {
    let task = task(0.0);
    // As far from the outline in the middle of every sector.
    let middle_rad = |angle_rad: f32| {
        let sectors = (0..SECTOR_COUNT).map(sector_angle_rad);
        sectors
            .min_by(|a, b| (a - angle_rad).abs().total_cmp(&(b - angle_rad).abs()))
            .expect("there are some")
    };
    let around = LaserScan::of(&task.lidar, |angle_rad| {
        let (sin, cos) = middle_rad(angle_rad + 1e-3).sin_cos();
        LONG.reach_m(cos, sin) + 1.0
    });
    let scan = LaserScan { header: Header { stamp_ns: 100_000_000, seq: 1 }, ..around };
    let mut navigator = Navigator::new(&task);
    navigator.observe(
        &scan,
        &Odometry::default(),
        &Goal { x_m: 3.0, radius_m: 0.3, id: 1, ..Goal::default() },
    );
    let mut observation = [0.0; LOW_OBSERVATION];
    navigator.encode_low(&Sent::default(), &mut observation);
    let clearances = &observation[..SECTOR_COUNT];
    assert!(clearances[0] > 0.2 && clearances[0] < 1.0, "{clearances:?}");
    assert!(clearances.iter().all(|clearance| (clearance - clearances[0]).abs() < 1e-5), "{clearances:?}");
}

#[test]
fn a_lane_is_as_wide_as_the_robot_and_ends_before_its_front() {
    let task = task(0.0);
    let wall = |angle_rad: f32| if angle_rad.cos() > 0.1 { 3.0 / angle_rad.cos() } else { f32::INFINITY };
    let ahead = view(&task, &LaserScan::of(&task.lidar, wall));
    let free_m = |view: &ScanView, beside_m: f32| view.corridor_m(1.0, 0.0, &LONG.lane(beside_m), 4.0);
    assert!((free_m(&ahead, 0.1) - 2.1).abs() < 0.02, "{}", free_m(&ahead, 0.1));
    // It would not turn between these walls, but it drives along them.
    let narrow = view(&task, &LaserScan::of(&task.lidar, corridor(0.4)));
    assert!((free_m(&narrow, 0.05) - 4.0).abs() < 1e-6 && free_m(&narrow, 0.15) < 0.1);
}

/// Which directions, counted from straight ahead, are legal between walls.
fn legal(linear_min_mps: f32, half_m: f32) -> Vec<usize> {
    let task = task(linear_min_mps);
    let view = view(&task, &LaserScan::of(&task.lidar, corridor(half_m)));
    let mask = Candidates::measure(&task, &view, 0.0).mask;
    (0..DIRECTION_COUNT).filter(|direction| mask.allows(*direction)).collect()
}

#[test]
fn subgoals_lie_where_it_can_turn_to() {
    let ahead = 0;
    let behind = DIRECTION_COUNT / 2;
    assert!((direction_angle_rad(behind) - std::f32::consts::PI).abs() < 1e-5);
    assert_eq!(legal(0.0, 0.6), [ahead], "between walls that its corners would meet it goes on");
    assert_eq!(legal(-0.5, 0.6), [ahead, behind], "or back, if it reverses");
    assert_eq!(legal(0.0, 1.0), [ahead, behind], "and turns where they are farther");
}

/// A box that touches something with its side drives on, with its front it does not.
#[test]
fn only_what_touches_a_front_stops_it() {
    let task = task(-0.5);
    for (place, closed) in [
        (Point::new(0.4, 0.25), (false, false)),
        (Point::new(-0.2, -0.29), (false, false)),
        (Point::new(0.79, 0.1), (true, false)),
        (Point::new(-0.49, 0.1), (false, true)),
        (Point::new(0.9, 0.0), (false, false)),
    ] {
        let (range_m, bearing_rad) = (place.coords.norm(), place.y.atan2(place.x));
        let near = |angle_rad: f32| if (angle_rad - bearing_rad).abs() < 0.06 { range_m } else { 4.0 };
        let view = view(&task, &LaserScan::of(&task.lidar, near));
        assert_eq!((view.is_closed_ahead(), view.is_closed_behind()), closed, "{place}");
    }
}
