//! What a scan of any lidar comes to.

extern crate std;

use super::*;
use crate::geometry::Pose;
use crate::messages::{Header, LaserScan};
use crate::task::{Lidar, ShieldMode, Task};
use std::string::ToString;
use std::vec::Vec;

/// What the default robot sweeps, with 5 cm to spare.
fn lane() -> Lane {
    Task::default().robot.footprint.lane(0.05)
}

/// The view of one scan of the default task, seen by whatever lidar.
fn seen(task: &Task, scan: &LaserScan) -> ScanView {
    let geometry = ScanGeometry::new(task);
    let mut view = ScanView::new(&geometry);
    view.update(&geometry, ScanReader::new(task).read(scan, Pose::default()), scan.range_max_m);
    view
}

fn beams(task: &Task, scan: &LaserScan) -> Vec<f32> {
    ScanReader::new(task).read(scan, Pose::default()).to_vec()
}

fn stamped(mut scan: LaserScan, seq: u64) -> LaserScan {
    scan.header = Header { stamp_ns: seq * 100_000_000, seq };
    scan
}

/// A lidar of so many beams over the full circle, from `angle_min_rad`, that sees `range_m` by direction.
fn other(beams: u32, angle_min_rad: f32, clockwise: bool, range_m: impl Fn(f32) -> f32) -> LaserScan {
    let increment = core::f32::consts::TAU / beams as f32 * if clockwise { -1.0 } else { 1.0 };
    let mut scan = LaserScan {
        angle_min_rad,
        angle_increment_rad: increment,
        range_min_m: 0.05,
        range_max_m: 12.0,
        beam_count: beams,
        ..LaserScan::default()
    };
    for beam in 0..beams as usize {
        scan.ranges_m[beam] = range_m(wrap_angle(angle_min_rad + beam as f32 * increment));
    }
    stamped(scan, 1)
}

/// A wall at x = 2, seen in a direction, m.
fn wall(angle_rad: f32) -> f32 {
    if libm::cosf(angle_rad) > 0.1 { 2.0 / libm::cosf(angle_rad) } else { f32::INFINITY }
}

#[test]
fn a_wall_ahead_closes_the_corridor_ahead_only() {
    let task = Task::default();
    let view = seen(&task, &LaserScan::of(&task.lidar, wall));
    let ahead = view.corridor_m(1.0, 0.0, &lane(), 5.0);
    assert!((ahead - 1.75).abs() < 0.05, "{ahead}");
    assert!((view.corridor_m(-1.0, 0.0, &lane(), 5.0) - 5.0).abs() < 1e-6);
    assert!((view.nearest_m() - 2.0).abs() < 1e-3);
}

#[test]
fn the_trained_lidars_own_scan_passes_unchanged() {
    for lidar in [Lidar::default(), Lidar { beam_count: 40, field_of_view_rad: 3.0, ..Lidar::default() }] {
        let task = Task { lidar, ..Task::default() };
        let scan = LaserScan::of(&lidar, |angle| 2.0 + libm::sinf(7.0 * angle));
        assert_eq!(beams(&task, &scan), scan.ranges_m());
    }
}

/// From the drivers of real lidars: from 0, a step that counts the last beam twice, clockwise, finer, coarser.
#[test]
fn a_scan_of_any_layout_shows_the_same_wall() {
    let task = Task::default();
    let trained = seen(&task, &LaserScan::of(&task.lidar, wall));
    let mut rplidar = other(360, -core::f32::consts::PI, false, wall);
    rplidar.angle_increment_rad = core::f32::consts::TAU / 359.0;
    for (name, scan) in [
        ("from 0", other(72, 0.0, false, wall)),
        ("LDS-01", other(360, 0.0, false, wall)),
        ("rplidar_ros", rplidar),
        ("upside down", other(72, core::f32::consts::PI, true, wall)),
        ("36 beams", other(36, -core::f32::consts::PI, false, wall)),
        ("71 beams", other(71, -core::f32::consts::PI, false, wall)),
        ("73 beams", other(73, -core::f32::consts::PI, false, wall)),
        ("720 beams", other(720, 0.3, false, wall)),
        ("1440 beams", other(1440, 0.3, true, wall)),
    ] {
        assert_eq!(ScanReader::new(&task).inspect(&scan), Ok(()), "{name}");
        let view = seen(&task, &scan);
        assert!((view.nearest_m() - 2.0).abs() < 0.03, "{name}: {}", view.nearest_m());
        for (sector, (found, expected)) in view.sectors_m().iter().zip(trained.sectors_m()).enumerate() {
            // Walls that are seen at a slant are as near as the nearest edge of their sector, or half a coarse step farther.
            let angle = sector_angle_rad(sector);
            let share = if scan.beam_count == 36 { 0.18 } else { 0.12 };
            let slant = share * expected + if libm::cosf(angle) < 0.5 { 2.0 } else { 0.0 };
            assert!((found - expected).abs() < slant, "{name}, sector {sector}: {found} {expected}");
        }
    }
}

/// Behind the safety gate a fine lidar shows a slanted wall as the trained one would, and a coarse one leaves open what
/// lies between two of its beams; without the gate the nearest thing counts.
#[test]
fn gaps_are_as_wide_as_the_policy_is_used_to_behind_the_gate_only() {
    let on = Task::default();
    let off = Task { shield: ShieldMode::Off, ..on };
    let trained = beams(&on, &LaserScan::of(&on.lidar, wall));
    let fine = other(720, 0.0, false, wall);
    let nearer = |task: &Task| {
        let seen = beams(task, &fine);
        trained
            .iter()
            .zip(&seen)
            .filter(|(trained, seen)| **trained < 5.0 && **seen < **trained - 0.01)
            .count()
    };
    assert_eq!(nearer(&on), 0);
    assert!(nearer(&off) > 20, "{}", nearer(&off));
    // Every other beam of 36 hits something: in a third direction, between two, nobody looked.
    let coarse = other(36, -core::f32::consts::PI, false, |angle| {
        if (libm::roundf(angle / 0.1745329) as i32) % 2 == 0 { 1.0 } else { 4.0 }
    });
    let near = |task: &Task| beams(task, &coarse).iter().filter(|range| **range < 2.0).count();
    assert_eq!((near(&on), near(&off)), (18, 54));
}

/// A pole as wide as one beam of a fine lidar falls between the beams of a coarse one; resampled it does not.
#[test]
fn the_nearest_thing_within_a_beams_width_counts() {
    let task = Task::default();
    let pole = |angle: f32| if (angle - 0.037).abs() < 0.006 { 1.0 } else { 4.0 };
    assert!(
        (seen(&task, &LaserScan::of(&task.lidar, pole)).nearest_m() - 4.0).abs() < 1e-6,
        "between two beams"
    );
    let fine = other(720, 0.0, false, pole);
    assert!((seen(&task, &fine).nearest_m() - 1.0).abs() < 1e-6);
    assert_eq!(seen(&task, &fine).hits().iter().filter(|hit| hit.range_m < 2.0).count(), 1);
}

#[test]
fn a_longer_or_shorter_range_serves() {
    let task = Task::default();
    let far = other(72, -core::f32::consts::PI, false, |_| 8.0);
    let view = seen(&task, &far);
    assert!(
        view.hits().is_empty() && view.sectors_m().iter().all(|range| (range - 5.0).abs() < 1e-6),
        "8 m is beyond 5 m"
    );
    let short = LaserScan { range_max_m: 3.5, ..other(72, 0.0, false, |_| f32::INFINITY) };
    assert_eq!(ScanReader::new(&task).inspect(&short), Ok(()));
    let view = seen(&task, &short);
    assert!(
        view.sectors_m().iter().all(|range| (range - 5.0).abs() < 1e-6),
        "nothing within its range is nothing"
    );
    assert!(
        view.rays().iter().all(|ray| (ray.2 - 3.5).abs() < 1e-6),
        "but the map learns no more than was measured"
    );
}

/// A pillar 20 degrees wide dead ahead, however a driver says that it is too near.
#[test]
fn too_near_is_an_obstacle() {
    let task = Task::default();
    for (name, value) in
        [("REP 117", f32::NEG_INFINITY), ("zero", 0.0), ("negative", -1.0), ("below range_min", 0.3)]
    {
        let pillar = |angle: f32| if angle.abs() < 0.175 { value } else { 4.0 };
        let scan = stamped(LaserScan { range_min_m: 0.45, ..LaserScan::of(&task.lidar, pillar) }, 1);
        assert_eq!(ScanReader::new(&task).inspect(&scan), Ok(()), "{name}");
        let view = seen(&task, &scan);
        let expected = if value > 0.0 { 0.3 } else { task.robot.footprint.circumradius_m() };
        assert!((view.nearest_m() - expected).abs() < 1e-6, "{name}: {}", view.nearest_m());
        assert_eq!(view.is_closed_ahead(), value <= 0.0, "{name}");
        assert!(view.corridor_m(1.0, 0.0, &lane(), 5.0) < 0.15, "{name}");
        assert!(view.corridor_m(-1.0, 0.0, &lane(), 5.0) > 3.0, "{name}: behind it is free");
    }
}

#[test]
fn what_nobody_knows_is_not_free() {
    let task = Task::default();
    let view = |failed: &dyn Fn(f32) -> bool| {
        let scan = LaserScan::of(&task.lidar, |angle| if failed(angle) { f32::NAN } else { 4.0 });
        seen(&task, &scan)
    };
    let ahead = view(&|angle| angle.abs() < 0.175);
    assert!(
        !ahead.is_closed_behind()
            && ahead.is_closed_ahead()
            && ahead.corridor_m(1.0, 0.0, &lane(), 5.0) == 0.0
    );
    assert!(ahead.corridor_m(-1.0, 0.0, &lane(), 5.0) > 3.0);
    // Two wedges of 40 degrees with one beam between.
    let wedges = view(&|angle| angle.abs() < 0.74 && angle.abs() > 0.04);
    assert!(wedges.is_closed_ahead());
    let behind = view(&|angle| angle.abs() > 2.7);
    assert!(!behind.is_closed_ahead(), "behind it does not matter");
    assert!(behind.is_closed_behind(), "but for driving backwards");
    assert!(!view(&|angle| libm::sinf(angle * 100.0) > 0.8).is_closed_ahead(), "scattered failures");
}

/// Trained dropout: a beam that fails shows what was there a moment ago, from where the robot is now.
#[test]
fn what_was_seen_ages_and_does_not_vanish() {
    let task = Task::default();
    let (mut reader, geometry) = (ScanReader::new(&task), ScanGeometry::new(&task));
    let mut view = ScanView::new(&geometry);
    let mut see = |seq: u64, pose: Pose, fails: bool| {
        let range_m = |angle: f32| if fails && angle.abs() < 0.3 { f32::NAN } else { wall(angle) };
        let scan = stamped(LaserScan::of(&task.lidar, range_m), seq);
        view.update(&geometry, reader.read(&scan, pose), scan.range_max_m);
        (view.corridor_m(1.0, 0.0, &lane(), 5.0), view.is_closed_ahead())
    };
    see(1, Pose::default(), false);
    let (ahead_m, is_closed) = see(2, Pose::new(0.1, 0.0, 0.0), true);
    assert!((ahead_m - 1.65).abs() < 0.05 && !is_closed, "carried forward: {ahead_m}");
    // Turned by two beams' width: what lay ahead lies to the right.
    assert!(!see(3, Pose::new(0.1, 0.0, 0.175), true).1);
    assert!(!see(4, Pose::new(0.1, 0.0, 0.0), true).1);
    assert!(see(5, Pose::new(0.1, 0.0, 0.0), true).1, "after 0.3 s nothing is known any more");
}

#[test]
fn what_cannot_serve_is_refused_with_what_was_needed_and_what_came() {
    let task = Task::default();
    let fine = other(72, -core::f32::consts::PI, false, |_| 4.0);
    let mut quarter = fine;
    quarter.angle_increment_rad *= 0.75;
    let mut blind = fine;
    blind.ranges_m[..40].fill(f32::NAN);
    // An open hall whose driver writes a number where nothing was hit.
    let mut code = fine;
    code.ranges_m[..40].fill(65.533);
    let none = LaserScan { beam_count: 0, ..fine };
    for (scan, parts) in [
        (other(30, 0.0, false, |_| 4.0), ["36 beams needed, 30 came", "72"]),
        (none, ["36 beams needed, 0 came", "72"]),
        (LaserScan { beam_count: 2000, ..fine }, ["1440", "2000 came"]),
        (quarter, ["360 degrees needed", "into 2"]),
        (LaserScan { range_max_m: 2.4, ..fine }, ["2.5 m needed", "2.4 m"]),
        (LaserScan { range_max_m: 0.0, ..fine }, ["2.5 m needed", "0.0 m"]),
        (LaserScan { range_max_m: f32::NAN, ..fine }, ["range_max NaN", "header"]),
        (LaserScan { range_min_m: 4.9, ..fine }, ["range_min is 4.90", "0.50 m can serve"]),
        (LaserScan { angle_min_rad: f32::NAN, ..fine }, ["angle_min NaN", "header"]),
        (LaserScan { angle_increment_rad: 0.0, ..fine }, ["angle_increment 0", "header"]),
        (blind, ["32 of 72 beams", "+inf"]),
        (code, ["32 of 72 beams", "above range_max"]),
    ] {
        let misfit = ScanReader::new(&task).inspect(&scan).expect_err(parts[0]).to_string();
        assert!(parts.iter().all(|part| misfit.contains(part)), "{parts:?} in {misfit}");
    }
    let mut reader = ScanReader::new(&task);
    reader.set_no_return_m(65.0);
    assert_eq!(reader.inspect(&code), Ok(()), "the driver's own code for nothing");
}

/// A scan that fails every second time is never driven on; a while after the last failure one is.
#[test]
fn a_scan_must_stay_good_for_a_while() {
    let task = Task::default();
    let good = |seq| stamped(LaserScan::of(&task.lidar, |_| 4.0), seq);
    let mut reader = ScanReader::new(&task);
    assert_eq!(reader.inspect(&good(1)), Ok(()), "the first needs no past");
    for seq in 2..20 {
        let scan =
            if seq % 2 == 0 { stamped(LaserScan::of(&task.lidar, |_| f32::NAN), seq) } else { good(seq) };
        assert!(reader.inspect(&scan).is_err(), "scan {seq}");
        assert!(reader.inspect(&scan).is_err(), "and asked again, it does not count twice");
    }
    let settled = (20..30).find(|seq| reader.inspect(&good(*seq)).is_ok());
    assert_eq!(settled, Some(23), "with the one before, the fifth good one");
}

#[test]
fn walls_that_vanish_are_doubted_after_a_second() {
    let task = Task::default();
    let empty_from = |near_m: f32, seq: u64| {
        let mut reader = ScanReader::new(&task);
        let range_m = |seq: u64| if seq < 5 { near_m } else { f32::INFINITY };
        (1..=seq)
            .map(|seq| reader.inspect(&stamped(LaserScan::of(&task.lidar, |_| range_m(seq)), seq)))
            .last()
            .expect("a scan")
    };
    assert_eq!(empty_from(1.0, 15), Ok(()), "for a second");
    let misfit = empty_from(1.0, 16).expect_err("a wall does not vanish").to_string();
    assert!(misfit.contains("1.1 s") && misfit.contains("1.0 m away"), "{misfit}");
    assert_eq!(empty_from(4.5, 40), Ok(()), "what was far away may have been left behind");
}
