//! The tick as a whole, with small fixed networks: what it needs, what its networks may answer, what it says.

mod common;

use common::{PERIOD_NS, boxed, controller, eager, messages, network};
use nav_core::controller::Controller;
use nav_core::messages::{Goal, LaserScan, Odometry, RunState, fault};
use nav_core::observation::{CANDIDATE_FEATURES, LOW_ACTION, LOW_OBSERVATION};
use nav_core::task::{ACTION_COUNT, ACTION_GOAL, Lidar, ShieldMode, Task};
use nav_core::tick::{Inputs, Tick};

#[test]
fn it_stands_until_everything_was_received() {
    let task = Task::default();
    let mut controller = controller(&task);
    let (scan, odom, goal) = messages(&task, 1, 1);
    let none = (LaserScan::default(), Odometry::default(), Goal::default());
    let cases = [
        (Inputs { scan: &none.0, odom: &odom, goal: &goal }, fault::STALE_SCAN),
        (Inputs { scan: &scan, odom: &none.1, goal: &goal }, fault::STALE_ODOM),
        (Inputs { scan: &scan, odom: &odom, goal: &none.2 }, fault::NO_GOAL),
    ];
    for (inputs, missing) in cases {
        let mut fresh = boxed(&task, None, network(LOW_OBSERVATION, LOW_ACTION, 1, 2, false));
        let (command, status) = fresh.tick(PERIOD_NS, inputs);
        assert_eq!((command.linear_mps, command.angular_radps), (0.0, 0.0));
        assert_eq!(status.state, RunState::Ready);
        assert_eq!(status.faults & fault::STOPPING, missing);
    }
    let (command, status) = controller.tick(PERIOD_NS, Inputs { scan: &scan, odom: &odom, goal: &goal });
    assert_eq!(status.state, RunState::Driving);
    assert_eq!(command.scan_seq, 1);
    assert!(status.decided.is_some() && status.action < ACTION_COUNT);
}

#[test]
fn a_network_that_answers_nan_stops_the_robot_in_the_same_tick() {
    let task = Task::default();
    let bad_low = || network(LOW_OBSERVATION, LOW_ACTION, 1, 2, true);
    let bad_high = network(CANDIDATE_FEATURES, 1, ACTION_COUNT, 1, true);
    let good_low = network(LOW_OBSERVATION, LOW_ACTION, 1, 2, false);
    let controllers = [boxed(&task, None, bad_low()), boxed(&task, Some(bad_high), good_low)];
    for mut controller in controllers {
        let (scan, odom, goal) = messages(&task, 1, 1);
        let (command, status) = controller.tick(PERIOD_NS, Inputs { scan: &scan, odom: &odom, goal: &goal });
        assert!(status.faults & fault::NON_FINITE != 0 && command.faults & fault::NON_FINITE != 0);
        assert_eq!(status.state, RunState::Stopped);
        assert!(command.linear_mps == 0.0);
    }
}

#[test]
fn a_flat_policy_always_drives_at_the_goal() {
    let task = Task::default();
    let mut controller = boxed(&task, None, network(LOW_OBSERVATION, LOW_ACTION, 1, 2, false));
    for seq in 1..=50 {
        let (scan, odom, goal) = messages(&task, seq, 1);
        let (_, status) = controller.tick(seq * PERIOD_NS, Inputs { scan: &scan, odom: &odom, goal: &goal });
        assert_eq!(status.action, ACTION_GOAL);
        assert_eq!(status.subgoal_m, (8.0, 3.0));
    }
}

#[test]
fn networks_of_another_shape_are_refused_by_name() {
    let task = Task::default();
    let error = Controller::new(&task, None, network(LOW_OBSERVATION + 1, LOW_ACTION, 1, 2, false))
        .expect_err("refused");
    let found = format!("maps {} numbers", LOW_OBSERVATION + 1);
    assert!(error.to_string().contains("td3") && error.to_string().contains(&found), "{error}");
}

#[test]
fn the_status_says_what_was_wished_where_the_gate_lets_something_else_leave() {
    let task = Task::default();
    let mut controller = boxed(&task, None, eager());
    for seq in 1..=10 {
        let (scan, odom, goal) = messages(&task, seq, 1);
        // Things 5 cm from the footprint, and a robot that stands.
        let scan = LaserScan { header: scan.header, ..LaserScan::of(&task.lidar, |_| 0.25) };
        let odom = Odometry { linear_mps: 0.0, ..odom };
        let (command, status) =
            controller.tick(seq * PERIOD_NS, Inputs { scan: &scan, odom: &odom, goal: &goal });
        assert!(
            (status.wish.linear_mps - 1.0).abs() < 1e-3 && (status.wish.angular_radps - 1.0).abs() < 1e-3
        );
        assert!(command.linear_mps < 0.1 && status.faults & fault::SHIELDED != 0, "step {seq}: {command:?}");
        assert!(status.intervention.is_some());
    }
}

/// Switching the gate changes what the policy sees of another lidar, as if the task had said so.
#[test]
fn the_switch_of_the_gate_reaches_the_eyes() {
    let task = Task::default();
    let narrow = |controller: &mut Controller<Vec<f32>>| {
        let (scan, odom, goal) = messages(&task, 1, 1);
        let fine = Task { lidar: Lidar { beam_count: 720, ..task.lidar }, ..task };
        let scan = LaserScan { header: scan.header, ..LaserScan::of(&fine.lidar, |angle| 2.0 + angle.abs()) };
        controller.tick(PERIOD_NS, Inputs { scan: &scan, odom: &odom, goal: &goal });
        controller.navigator().scan().rays().iter().map(|ray| ray.2).sum::<f32>()
    };
    let off = narrow(&mut controller(&Task { shield: ShieldMode::Off, ..task }));
    let on = narrow(&mut controller(&task));
    assert!(off < on - 0.5, "{off} {on}");
    let mut switched = controller(&task);
    switched.set_shield(ShieldMode::Off);
    assert!((narrow(&mut switched) - off).abs() < 1e-4);
}
