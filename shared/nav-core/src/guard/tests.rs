//! What stops the robot, what it is told, and how a wish is cut.

extern crate std;

use super::*;
use crate::geometry::Pose;
use std::string::ToString;
use std::vec::Vec;

fn fresh(now_ns: u64) -> (LaserScan, Odometry, Goal) {
    let header = Header { stamp_ns: now_ns, seq: 7 };
    (
        LaserScan { header, ..LaserScan::default() },
        Odometry { header, ..Odometry::default() },
        Goal { header, radius_m: 0.3, ..Goal::default() },
    )
}

#[test]
fn fresh_inputs_pass_and_each_fault_is_named() {
    let now = 1_000_000_000;
    let (scan, odom, goal) = fresh(now);
    let inspect = |scan: &LaserScan, odom: &Odometry, goal: &Goal, now: u64| {
        Guard::new(&Task::default()).inspect(now, scan, odom, goal).0
    };
    assert_eq!(inspect(&scan, &odom, &goal, now), 0);
    assert_eq!(inspect(&scan, &odom, &goal, now + 250_000_000), 0);
    assert_eq!(inspect(&scan, &odom, &goal, now + 250_000_001), fault::STALE_SCAN);
    assert_eq!(inspect(&scan, &odom, &goal, now + 500_000_001), fault::STALE_SCAN | fault::STALE_ODOM);
    assert_eq!(inspect(&scan, &odom, &Goal::default(), now), fault::NO_GOAL);
    assert_eq!(inspect(&LaserScan::default(), &odom, &goal, now), fault::STALE_SCAN);
    assert_eq!(inspect(&scan, &odom, &goal, now - 1), fault::BAD_CLOCK);
    let mut lost = odom;
    lost.pose.x_m = f32::NAN;
    assert_eq!(inspect(&scan, &lost, &goal, now), fault::BAD_INPUT);
}

#[test]
fn time_may_not_run_backwards() {
    let now = 1_000_000_000;
    let (mut scan, odom, goal) = fresh(now);
    let mut guard = Guard::new(&Task::default());
    assert_eq!(guard.inspect(now, &scan, &odom, &goal).0, 0);
    assert_eq!(guard.inspect(now, &scan, &odom, &goal).0, 0, "the same scan again is merely old");
    scan.header.seq = 6;
    assert_eq!(guard.inspect(now, &scan, &odom, &goal).0, fault::BAD_CLOCK);
    scan.header = Header { seq: 8, stamp_ns: now };
    let mut guard = Guard::new(&Task::default());
    guard.inspect(now, &fresh(now).0, &odom, &goal);
    assert_eq!(guard.inspect(now, &scan, &odom, &goal).0, fault::BAD_CLOCK, "a frozen clock");
    let mut guard = Guard::new(&Task::default());
    guard.inspect(now, &fresh(now).0, &odom, &goal);
    scan.header = Header { seq: 7, stamp_ns: now + 1 };
    assert_eq!(guard.inspect(now + 1, &scan, &odom, &goal).0, fault::BAD_CLOCK, "a frozen counter");
}

#[test]
fn wishes_are_cut_to_the_limits() {
    let mut guard = Guard::new(&Task::default());
    let (out, faults) = guard.limit(Twist::new(9.0, -9.0));
    assert!((out.linear_mps - 0.2).abs() < 1e-6 && (out.angular_radps + 0.4).abs() < 1e-6);
    assert_eq!(faults, fault::SPEED_LIMITED | fault::ACCELERATION_LIMITED);
    for _ in 0..20 {
        guard.limit(Twist::new(9.0, -9.0));
    }
    let full = Twist::new(1.0, -1.0);
    assert_eq!(guard.limit(full), (full, 0));
    let (out, faults) = guard.limit(Twist::new(f32::NAN, 0.0));
    assert!(out.linear_mps < 1.0 && faults & fault::NON_FINITE != 0, "a ramp to zero, named");
    assert_eq!(guard.sent().as_slice()[..2], [out, full], "what left, newest first");
    guard.restart_from(Twist::new(0.5, -0.25), 0);
    assert_eq!(*guard.sent(), Sent::of(&[Twist::new(0.5, -0.25)]));
}

/// A speed sensor that is stuck at 0.8 m/s must not let a standing robot jump; one that shows less is believed.
#[test]
fn a_ramp_never_starts_above_what_was_commanded() {
    let ramp = |commanded: f32, measured: f32, silent_ns: u64| {
        let mut guard = Guard::new(&Task::default());
        for _ in 0..20 {
            guard.limit(Twist::new(commanded, 0.0));
        }
        guard.restart_from(Twist::new(measured, 0.0), silent_ns);
        guard.limit(Twist::new(1.0, 0.0)).0.linear_mps
    };
    let short_ns = 160_000_000;
    assert!((ramp(0.0, 0.8, short_ns) - 0.2).abs() < 1e-6, "standing");
    assert!((ramp(0.6, 0.8, short_ns) - 0.8).abs() < 1e-6, "commanded 0.6");
    assert!((ramp(0.6, 0.3, short_ns) - 0.5).abs() < 1e-6, "measured 0.3");
    assert!((ramp(0.6, 0.6, 300_000_000) - 0.2).abs() < 1e-6, "silent for longer than a base obeys");
}

/// Time, not ticks: two ticks a millisecond apart are not two periods.
#[test]
fn acceleration_is_limited_by_time() {
    let mut guard = Guard::new(&Task::default());
    let wish = Twist::new(1.0, 0.0);
    assert!((guard.limit_after(0.1, wish).0.linear_mps - 0.2).abs() < 1e-6);
    assert!((guard.limit_after(0.001, wish).0.linear_mps - 0.202).abs() < 1e-6);
    assert!((guard.limit_after(5.0, wish).0.linear_mps - 0.402).abs() < 1e-6, "a period at most");
    assert!((guard.limit_after(0.0, wish).0.linear_mps - 0.402).abs() < 1e-6);
}

/// A drive along x at 0.5 m/s, whose pose goes through `pose` in each step; the faults and causes of each.
fn driven(pose: impl Fn(u64) -> (f32, f32), goal: impl Fn(u64) -> (u64, u32)) -> Vec<(u32, Option<Cause>)> {
    let mut guard = Guard::new(&Task::default());
    (1..=40)
        .map(|step| {
            let header = Header { stamp_ns: step * 100_000_000, seq: step };
            let (x_m, yaw_rad) = pose(step);
            let odom = Odometry { header, pose: Pose::new(x_m, 0.0, yaw_rad), ..Odometry::default() };
            let scan = LaserScan { header, ..LaserScan::default() };
            let (seq, id) = goal(step);
            let goal_header = Header { stamp_ns: seq * 100_000_000, seq };
            let goal = Goal { header: goal_header, radius_m: 0.3, id, ..Goal::default() };
            guard.inspect(header.stamp_ns, &scan, &odom, &goal)
        })
        .collect()
}

fn is_bad(step: &(u32, Option<Cause>)) -> bool {
    step.0 & fault::BAD_ODOM != 0
}

#[test]
fn a_pose_that_jumps_stops_the_robot_until_a_goal_is_sent_again() {
    let straight = |step: u64| step as f32 * 0.1;
    assert!(!driven(|step| (straight(step), 0.0), |_| (1, 1)).iter().any(is_bad), "an honest drive");
    let teleport = |step: u64| (straight(step) + if step >= 20 { 20.0 } else { 0.0 }, 0.0);
    let steps = driven(teleport, |_| (1, 1));
    assert!(!is_bad(&steps[18]) && steps[19..].iter().all(is_bad), "from then on");
    let said = steps[19].1.expect("a cause").to_string();
    assert!(said.contains("jumped by 20.10 m") && said.contains("0.45 m"), "{said}");
    let again = driven(teleport, |step| (if step >= 30 { 2 } else { 1 }, 1));
    assert!(is_bad(&again[28]) && !is_bad(&again[29]), "the goal was sent again");
    let elsewhere = driven(teleport, |step| if step >= 20 { (2, 2) } else { (1, 1) });
    assert!(!elsewhere.iter().any(is_bad), "set down elsewhere, with a new goal");
    let spinning = driven(|step| (straight(step), (step * step % 7) as f32), |step| (step, 1));
    assert!(spinning.iter().filter(|step| is_bad(step)).count() > 25, "a random yaw, whatever goals come");
}

#[test]
fn a_pose_that_stands_still_while_the_robot_drives_is_named() {
    let drive = |still: bool, sees_motion: bool, wish: f32| {
        let mut guard = Guard::new(&Task::default());
        (1..=30_u16).any(|step| {
            let header = Header { stamp_ns: u64::from(step) * 100_000_000, seq: u64::from(step) };
            let x_m = if still { 0.0 } else { 0.05 * f32::from(step) };
            let odom = Odometry { header, pose: Pose::new(x_m, 0.0, 0.0), ..Odometry::default() };
            let goal =
                Goal { header: Header { stamp_ns: 1, seq: 1 }, radius_m: 0.3, id: 1, ..Goal::default() };
            let scan = LaserScan { header, ..LaserScan::default() };
            let (faults, _) = guard.inspect(header.stamp_ns, &scan, &odom, &goal);
            let seen = if sees_motion { 5.0 - 0.05 * f32::from(step) } else { 3.0 };
            guard.note_drive(header.stamp_ns, Twist::new(wish, 0.0), &[seen; SECTOR_COUNT]);
            faults & fault::BAD_ODOM != 0
        })
    };
    assert!(drive(true, true, 0.5));
    assert!(!drive(false, true, 0.5), "it moves");
    assert!(!drive(true, false, 0.5), "it is held: nothing moves");
    assert!(!drive(true, true, 0.0), "it is to stand");
}

#[test]
fn a_goal_is_stale_only_where_a_heartbeat_is_asked_for() {
    let mut guard = Guard::new(&Task::default());
    let (mut scan, mut odom, goal) = fresh(1_000_000_000);
    let late_ns = 9_000_000_000;
    (scan.header, odom.header) = (Header { stamp_ns: late_ns, seq: 8 }, Header { stamp_ns: late_ns, seq: 8 });
    assert_eq!(guard.inspect(late_ns, &scan, &odom, &goal), (0, None));
    guard.set_goal_age_limit_ns(Some(1_000_000_000));
    let (faults, cause) = guard.inspect(late_ns, &scan, &odom, &goal);
    assert_eq!(faults, fault::STALE_GOAL);
    assert!(cause.is_some_and(|cause| cause.to_string().contains("8.0 s old, 1.0 s are allowed")));
}

/// Each says what was expected and what came.
#[test]
fn causes_name_the_cure() {
    let now = 1_000_000_000;
    let (scan, odom, goal) = fresh(now);
    let said = |scan: &LaserScan, odom: &Odometry, goal: &Goal| {
        let (_, cause) = Guard::new(&Task::default()).inspect(now, scan, odom, goal);
        cause.expect("a cause").to_string()
    };
    let wall_clock = Header { stamp_ns: 1_790_000_000_000_000_000, seq: 7 };
    for sentence in [
        said(&LaserScan { header: wall_clock, ..scan }, &odom, &goal),
        said(&scan, &odom, &Goal { header: wall_clock, ..goal }),
    ] {
        assert!(sentence.contains("CLOCK_MONOTONIC") && sentence.contains("wall"), "{sentence}");
    }
    let uncounted = LaserScan { header: Header { stamp_ns: now, seq: 0 }, ..scan };
    assert!(said(&uncounted, &odom, &goal).contains("count messages from 1"));
    let far = said(&scan, &odom, &Goal { x_m: 388_096.0, ..goal });
    assert!(far.contains("x of the goal is 388096") && far.contains("100 km"), "{far}");
    let mut guard = Guard::new(&Task::default());
    guard.inspect(now, &scan, &odom, &goal);
    let frozen = LaserScan { header: Header { stamp_ns: now + 1, seq: 7 }, ..scan };
    let (_, cause) = guard.inspect(now + 1, &frozen, &odom, &goal);
    assert!(cause.is_some_and(|cause| cause.to_string().contains("seq went from 7 to 7")));
}
