use super::*;
use crate::messages::LaserScan;
use crate::scan::{ScanGeometry, ScanView};
use crate::task::Task;

/// A map of a straight wall from y = -2 to y = 2 at x = 2, seen from the origin.
fn walled() -> LocalMap {
    let task =
        Task { lidar: crate::task::Lidar { beam_count: 720, ..Default::default() }, ..Task::default() };
    let geometry = ScanGeometry::new(&task);
    let scan = LaserScan::of(&task.lidar, |angle| {
        let at_wall = 2.05 * libm::tanf(angle);
        let hits = libm::cosf(angle) > 0.0 && at_wall.abs() < 2.0;
        if hits { 2.05 / libm::cosf(angle) } else { f32::INFINITY }
    });
    let mut view = ScanView::new(&geometry);
    view.update(&geometry, scan.ranges_m(), scan.range_max_m);
    let mut map = LocalMap::new(Point::origin(), crate::local_map::CELL_M, 1.0);
    map.integrate(Point::origin(), 1.0, 0.0, &view);
    map
}

#[test]
fn open_floor_is_nearly_straight() {
    let map = LocalMap::new(Point::origin(), crate::local_map::CELL_M, 1.0);
    let mut geodesic = OptimisticGeodesic::default();
    geodesic.update(&map, Point::new(5.0, 3.0), Point::origin(), 2.0);
    let distance = geodesic.distance_m(Point::origin()).expect("free");
    let straight = libm::sqrtf(34.0);
    assert!(distance >= straight - 0.3 && distance < straight * 1.1 + 0.3, "{distance} against {straight}");
}

#[test]
fn a_wall_costs_the_way_round() {
    let mut geodesic = OptimisticGeodesic::default();
    geodesic.update(&walled(), Point::new(4.0, 0.0), Point::origin(), 2.0);
    let distance = geodesic.distance_m(Point::origin()).expect("a way round");
    assert!(distance > 5.2, "{distance}: through the wall it would be 4");
    let beside = geodesic.distance_m(Point::new(2.0, 2.8)).expect("free");
    assert!(beside < distance - 1.5, "going round the end must look like progress");
}

#[test]
fn a_goal_outside_the_window_pulls_the_right_way() {
    let map = LocalMap::new(Point::origin(), crate::local_map::CELL_M, 1.0);
    let mut geodesic = OptimisticGeodesic::default();
    geodesic.update(&map, Point::new(30.0, 0.0), Point::origin(), 2.0);
    let here = geodesic.distance_m(Point::origin()).expect("free");
    let ahead = geodesic.distance_m(Point::new(2.0, 0.0)).expect("free");
    assert!((here - 30.0).abs() < 1.0 && (here - ahead - 2.0).abs() < 0.3, "{here} {ahead}");
}

/// Whatever stands around, and wherever the robot is: what the policy is told does not depend on where the search ends.
#[test]
fn ending_early_changes_nothing_that_is_read() {
    let mut state = 7_u32;
    let mut random = |below: u32| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) % below
    };
    let (mut early, mut whole) = (OptimisticGeodesic::default(), OptimisticGeodesic::default());
    let mut shorter = 0;
    for _ in 0..40 {
        let map = LocalMap::littered(|| random(100) < 12);
        let place = |x: u32, y: u32| Point::new(x as f32 * 0.1 - 8.0, y as f32 * 0.1 - 8.0);
        let goal = place(random(160), random(160));
        let here = place(random(160), random(160));
        early.update(&map, goal, here, 2.0);
        whole.update(&map, goal, here, 1e4);
        let reached =
            |geodesic: &OptimisticGeodesic| geodesic.cost.iter().filter(|&&cost| cost != UNREACHED).count();
        shorter += u32::from(2 * reached(&early) < reached(&whole));
        assert_eq!(early.distance_m(here), whole.distance_m(here));
        let Some(here_m) = whole.distance_m(here) else { continue };
        for turn in 0..16 {
            let (sin, cos) = libm::sincosf(0.4 * turn as f32);
            let there = Point::new(here.x + 2.0 * cos, here.y + 2.0 * sin);
            let gain = |there_m: f32| (0.5 * (here_m - there_m)).clamp(-1.0, 1.0).to_bits();
            // Enclosed places are only known not to be near.
            let Some(there_m) = whole.distance_m(there) else { continue };
            assert_eq!(early.distance_m(there).map(gain), Some(gain(there_m)));
        }
    }
    assert!(shorter > 10, "{shorter} of 40 searches were less than half as long");
}
