//! Goals that come, change and are reached, seen by the tick as a whole.

mod common;

use common::{PERIOD_NS, controller, messages};
use nav_core::geometry::Pose;
use nav_core::messages::{Goal, LaserScan, MAX_BEAMS, Odometry, RunState, fault};
use nav_core::task::{ShieldMode, Task};
use nav_core::tick::{Inputs, Tick};

/// A waypoint after another: what left for the base before still counts, for the ramp and for the policy.
#[test]
fn a_new_goal_on_the_way_is_no_new_start() {
    let task = Task::default();
    let mut controller = controller(&task);
    let mut last = 0.0;
    for seq in 1..=60 {
        // Each goal is another one, and odometry lags behind what is commanded.
        let (scan, odom, goal) = messages(&task, seq, seq as u32);
        let (command, status) =
            controller.tick(seq * PERIOD_NS, Inputs { scan: &scan, odom: &odom, goal: &goal });
        assert_eq!(status.state, RunState::Driving);
        let change = command.linear_mps - last;
        assert!(change.abs() <= 0.2 + 1e-6, "step {seq}: {last} to {}", command.linear_mps);
        last = command.linear_mps;
    }
    assert!((last - 0.5).abs() > 0.2 + 1e-3, "{last}: from what odometry says it could not get here");
}

/// What lock-step evaluation rests on: a new goal of a robot that stands forgets everything, whatever was driven before. But
/// for the safety gate: what it saw stands there still, unless the robot was set down elsewhere.
#[test]
fn a_new_goal_is_a_new_life() {
    let task = Task { shield: ShieldMode::Off, ..Task::default() };
    let (mut used, mut fresh) = (controller(&task), controller(&task));
    for seq in 1..=60 {
        let (scan, odom, goal) = messages(&task, seq, 1);
        used.tick(seq * PERIOD_NS, Inputs { scan: &scan, odom: &odom, goal: &goal });
    }
    for seq in 61..=160 {
        let (scan, mut odom, goal) = messages(&task, seq, 2);
        if seq == 61 {
            odom.linear_mps = 0.0;
        }
        let inputs = Inputs { scan: &scan, odom: &odom, goal: &goal };
        let (a, b) = (used.tick(seq * PERIOD_NS, inputs), fresh.tick(seq * PERIOD_NS, inputs));
        assert_eq!(
            (a.0.linear_mps.to_bits(), a.0.angular_radps.to_bits()),
            (b.0.linear_mps.to_bits(), b.0.angular_radps.to_bits()),
            "step {seq}"
        );
        assert_eq!(a.1, b.1);
    }
}

/// Odometry drifts: the robot goes on to the middle of the goal, and stops there for good.
#[test]
fn it_drives_on_to_the_middle_of_the_goal() {
    let task = Task::default();
    let mut controller = controller(&task);
    let mut state_at = |seq: u64, distance_m: f32, id: u32| {
        let (scan, mut odom, goal) = messages(&task, seq, id);
        odom.pose = Pose::new(8.0 - distance_m, 3.0, 0.0);
        controller.tick(seq * PERIOD_NS, Inputs { scan: &scan, odom: &odom, goal: &goal }).1.state
    };
    assert_eq!(state_at(1, 0.5, 1), RunState::Driving);
    assert_eq!(state_at(2, 0.25, 1), RunState::Driving, "inside the radius, and coming closer");
    assert_eq!(state_at(3, 0.08, 1), RunState::Reached);
    assert_eq!(state_at(4, 0.4, 1), RunState::Reached, "it stays reached");
    assert_eq!(state_at(5, 0.5, 2), RunState::Driving, "until another goal comes");
    assert_eq!(state_at(6, 0.2, 2), RunState::Driving);
    assert_eq!(state_at(7, 0.23, 2), RunState::Reached, "passed by inside the radius");
}

/// A goal that came after the newest scan is not reached, though the robot stands at the last one.
#[test]
fn a_goal_that_no_scan_was_seen_with_is_not_reached() {
    let task = Task::default();
    let mut controller = controller(&task);
    let at_goal = |seq: u64, id: u32, x_m: f32| {
        let (scan, mut odom, mut goal) = messages(&task, seq, id);
        (odom.pose, odom.linear_mps) = (Pose::new(8.0, 3.0, 0.0), 0.0);
        goal.x_m = x_m;
        (scan, odom, goal)
    };
    let mut state = |scan: &LaserScan, odom: &Odometry, goal: &Goal, now: u64| {
        controller.tick(now, Inputs { scan, odom, goal }).1.state
    };
    let (scan, odom, goal) = at_goal(1, 1, 8.0);
    state(&scan, &odom, &goal, PERIOD_NS);
    let (scan, odom, goal) = at_goal(2, 1, 8.0);
    assert_eq!(state(&scan, &odom, &goal, 2 * PERIOD_NS), RunState::Reached);
    let later = 2 * PERIOD_NS + 30_000_000;
    let (_, _, other) = at_goal(2, 2, 1.0);
    assert_eq!(state(&scan, &odom, &other, later), RunState::Driving, "another goal");
    let (_, _, corrected) = at_goal(2, 1, 5.0);
    assert_eq!(state(&scan, &odom, &corrected, later), RunState::Driving, "the same, moved away");
}

/// Walls that vanish stop the robot; one that was set down elsewhere, with a new goal, has left them behind. A new goal alone
/// does not make a dark lidar see.
#[test]
fn an_open_place_is_no_dark_lidar_for_a_robot_that_was_set_down_there() {
    let task = Task::default();
    for (x_m, id, stops) in [(0.0, 1, true), (0.0, 2, true), (20.0, 2, false)] {
        let mut controller = controller(&task);
        let mut faults = 0;
        for seq in 1..=60 {
            let (mut scan, mut odom, mut goal) = messages(&task, seq, 1);
            (odom.pose, odom.linear_mps) = (Pose::default(), 0.0);
            if seq > 20 {
                scan.ranges_m = [f32::INFINITY; MAX_BEAMS];
                odom.pose = Pose::new(x_m, 0.0, 0.0);
                goal.id = id;
            }
            let inputs = Inputs { scan: &scan, odom: &odom, goal: &goal };
            faults |= controller.tick(seq * PERIOD_NS, inputs).1.faults;
        }
        assert_eq!(faults & fault::BAD_SCAN != 0, stops, "{x_m} m away, goal {id}");
    }
}
