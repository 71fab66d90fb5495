//! What the tick as a whole does not do, whatever its networks wish: drive without fresh scans, at what is near or unknown, or
//! faster than a robot accelerates.

mod common;

use common::{PERIOD_NS, always, boxed, controller, eager, messages};
use nav_core::messages::{LaserScan, MAX_BEAMS, RunState, fault};
use nav_core::task::{Lidar, Robot, ShieldMode, Task};
use nav_core::tick::{Inputs, Tick};

#[test]
fn a_stale_scan_ramps_to_zero_and_a_fresh_one_resumes() {
    let task = Task::default();
    let mut controller = controller(&task);
    let (mut last, mut seq) = (0.0, 0);
    for step in 1..=10 {
        let (scan, odom, goal) = messages(&task, step, 1);
        (seq, last) = (
            step,
            controller.tick(step * PERIOD_NS, Inputs { scan: &scan, odom: &odom, goal: &goal }).0.linear_mps,
        );
    }
    assert!(last > 0.0, "it drives");
    let (scan, odom, goal) = messages(&task, seq, 1);
    for late in 3..20 {
        let now = (seq + late) * PERIOD_NS;
        let (command, status) = controller.tick(now, Inputs { scan: &scan, odom: &odom, goal: &goal });
        assert!(status.faults & fault::STALE_SCAN != 0);
        assert!(command.linear_mps <= (last - 0.19).max(0.0), "{} after {last}", command.linear_mps);
        last = command.linear_mps;
    }
    assert!(last == 0.0);
    let (scan, odom, goal) = messages(&task, seq + 20, 1);
    let (_, status) =
        controller.tick((seq + 20) * PERIOD_NS, Inputs { scan: &scan, odom: &odom, goal: &goal });
    assert_eq!(status.state, RunState::Driving);
}

#[test]
fn scans_of_another_geometry_and_blind_scans_are_refused() {
    let task = Task::default();
    let mut controller = controller(&task);
    let (scan, odom, goal) = messages(&task, 1, 1);
    let mut other = scan;
    other.beam_count = 35;
    let mut blind = scan;
    blind.ranges_m = [f32::NAN; MAX_BEAMS];
    for (k, scan) in [other, blind].into_iter().enumerate() {
        let (_, status) =
            controller.tick((k as u64 + 1) * PERIOD_NS, Inputs { scan: &scan, odom: &odom, goal: &goal });
        assert_eq!(status.faults & fault::BAD_SCAN, fault::BAD_SCAN);
        assert_eq!(status.state, RunState::Stopped);
    }
}

/// A pillar 20 degrees wide dead ahead that is too near to be measured, or of which nothing is known, whatever the policy
/// wishes.
#[test]
fn it_does_not_drive_at_what_is_too_near_or_unknown() {
    let task = Task::default();
    for value in [f32::NEG_INFINITY, 0.0, f32::NAN] {
        let mut controller = boxed(&task, None, eager());
        for seq in 1..=30 {
            let (mut scan, mut odom, goal) = messages(&task, seq, 1);
            scan.ranges_m[34..=38].fill(value);
            odom.linear_mps = 0.0;
            let (command, status) =
                controller.tick(seq * PERIOD_NS, Inputs { scan: &scan, odom: &odom, goal: &goal });
            assert_eq!(status.state, RunState::Driving, "it may turn away");
            assert!(command.linear_mps == 0.0, "{value}, step {seq}: {}", command.linear_mps);
            assert!(status.faults & fault::CLOSED_AHEAD != 0);
        }
    }
}

/// The command and the faults after 3 s of wishing to drive back, on a robot that may reverse at `linear_min_mps`, in a wide
/// space but for what `change` makes of the scans.
fn driven_back(linear_min_mps: f32, lidar: Lidar, change: impl Fn(&mut LaserScan)) -> (f32, u32) {
    let robot = Robot { linear_min_mps, ..Robot::default() };
    let task = Task { robot, lidar, shield: ShieldMode::Off, ..Task::default() };
    let mut controller = boxed(&task, None, always(-9.0));
    let mut last = (0.0, 0);
    for seq in 1..=30 {
        let (scan, odom, goal) = messages(&task, seq, 1);
        let mut scan = LaserScan { header: scan.header, ..LaserScan::of(&task.lidar, |_| 4.0) };
        change(&mut scan);
        let (command, _) = controller.tick(seq * PERIOD_NS, Inputs { scan: &scan, odom: &odom, goal: &goal });
        last = (command.linear_mps, command.faults);
    }
    last
}

#[test]
fn it_reverses_where_the_task_allows_it_and_it_knows_what_is_behind() {
    let whole = Lidar::default();
    let three_quarters = Lidar { field_of_view_rad: 4.7, ..whole };
    let (linear_mps, faults) = driven_back(-0.4, whole, |_| {});
    assert!((linear_mps + 0.4).abs() < 1e-3 && faults & fault::CLOSED_BEHIND == 0, "{linear_mps}");
    assert!(driven_back(0.0, whole, |_| {}).0 == 0.0, "a robot that never reverses");
    for value in [f32::NEG_INFINITY, 0.0, f32::NAN] {
        // A pillar 20 degrees wide dead behind.
        let behind = |scan: &mut LaserScan| {
            scan.ranges_m[..2].fill(value);
            scan.ranges_m[70..72].fill(value);
        };
        let (linear_mps, faults) = driven_back(-0.4, whole, behind);
        assert!(linear_mps == 0.0 && faults & fault::CLOSED_BEHIND != 0, "{value}: {linear_mps}");
    }
    let (linear_mps, faults) = driven_back(-0.4, three_quarters, |_| {});
    assert!(
        linear_mps == 0.0 && faults & fault::CLOSED_BEHIND != 0,
        "where the lidar does not look: {linear_mps}"
    );
    let (_, faults) = driven_back(0.0, three_quarters, |_| {});
    assert!(faults & fault::CLOSED_BEHIND == 0, "of no concern to a robot that never reverses");
}

/// After a stall the ticks come in a burst: two of them a millisecond apart are not two periods of acceleration.
#[test]
fn a_burst_of_ticks_does_not_accelerate_faster() {
    let task = Task::default();
    let mut controller = boxed(&task, None, eager());
    let (mut last, mut fastest) = (0.0, 0.0_f32);
    for burst in 0..40 {
        for tick in 0..3 {
            let seq = burst + 1;
            let (scan, odom, goal) = messages(&task, seq, 1);
            let now_ns = seq * PERIOD_NS + tick * 1_000_000;
            let (command, _) = controller.tick(now_ns, Inputs { scan: &scan, odom: &odom, goal: &goal });
            let most = if tick == 0 { 0.2 } else { 0.002 };
            assert!(
                command.linear_mps - last <= most + 1e-6,
                "burst {burst}: {last} to {}",
                command.linear_mps
            );
            last = command.linear_mps;
            fastest = fastest.max(last);
        }
    }
    assert!(fastest > 0.25, "it drives: {fastest}");
}

/// A speed sensor that is stuck at 0.8 m/s: whatever stopped the robot, it starts from a standstill.
#[test]
fn a_stuck_speed_sensor_does_not_make_a_standing_robot_jump() {
    let task = Task::default();
    let mut controller = boxed(&task, None, eager());
    let mut last = 0.0;
    for seq in 1..=60 {
        let (mut scan, mut odom, goal) = messages(&task, seq, 1);
        odom.linear_mps = 0.8;
        if seq % 20 < 8 {
            // Stamps of the future, as after a clock that was set back.
            scan.header.stamp_ns += 1_000_000_000_000;
        }
        let (command, _) = controller.tick(seq * PERIOD_NS, Inputs { scan: &scan, odom: &odom, goal: &goal });
        assert!(command.linear_mps <= last + 0.2 + 1e-6, "step {seq}: {last} to {}", command.linear_mps);
        last = command.linear_mps;
    }
}
