//! The tick as a whole, with small fixed networks.

use nav_core::controller::Controller;
use nav_core::geometry::Pose;
use nav_core::messages::{Goal, Header, LaserScan, MAX_BEAMS, Odometry, RunState, fault};
use nav_core::network::{Activation, CpuLevel, Layer, MlpSpec, MlpWeights, Network};
use nav_core::observation::{CANDIDATE_FEATURES, LOW_ACTION, LOW_OBSERVATION};
use nav_core::task::{ACTION_COUNT, ACTION_GOAL, Lidar, Robot, ShieldMode, Task};
use nav_core::tick::{Inputs, Tick};

const PERIOD_NS: u64 = 100_000_000;

/// One layer of weights that follow from `seed`; `bad` puts a NaN among them.
fn network(inputs: usize, outputs: usize, rows: usize, seed: u32, bad: bool) -> Network<Vec<f32>> {
    let mut state = seed;
    let mut weights: Vec<f32> = (0..inputs * outputs)
        .map(|_| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 24) as f32 - 0.5
        })
        .collect();
    if bad {
        weights[0] = f32::NAN;
    }
    of_weights(inputs, outputs, rows, &weights, 0.1)
}

/// A network that wishes to drive ahead at full speed and turn left as fast as it can, whatever it sees.
fn eager() -> Network<Vec<f32>> {
    always(9.0)
}

/// A network that wishes the same whatever it sees: to drive back as fast as it may and turn right, at -9.
fn always(bias: f32) -> Network<Vec<f32>> {
    of_weights(LOW_OBSERVATION, LOW_ACTION, 1, &vec![0.0; LOW_OBSERVATION * LOW_ACTION], bias)
}

fn of_weights(inputs: usize, outputs: usize, rows: usize, weights: &[f32], bias: f32) -> Network<Vec<f32>> {
    let bias = vec![bias; outputs];
    let layers = [Layer { weights, bias: &bias }];
    let mlp = MlpSpec::new(&[inputs, outputs]).expect("two sizes").output(Activation::Tanh).rows(rows);
    let spec = mlp.spec(&MlpWeights::new(&layers)).expect("fits");
    let level = CpuLevel::detect();
    Network::new(&spec, vec![0.0; spec.memory_len(level)], level).expect("fits")
}

/// On the heap: a controller is larger than what a test's thread has room for many times over.
#[inline(never)]
fn boxed(task: &Task, high: Option<Network<Vec<f32>>>, low: Network<Vec<f32>>) -> Box<Controller<Vec<f32>>> {
    Box::new(Controller::new(task, high, low).expect("shapes fit"))
}

fn controller(task: &Task) -> Box<Controller<Vec<f32>>> {
    let high = network(CANDIDATE_FEATURES, 1, ACTION_COUNT, 1, false);
    boxed(task, Some(high), network(LOW_OBSERVATION, LOW_ACTION, 1, 2, false))
}

/// Messages of step `seq`, along a made-up drive; the goal has id `goal_id`.
fn messages(task: &Task, seq: u64, goal_id: u32) -> (LaserScan, Odometry, Goal) {
    let header = Header { stamp_ns: seq * PERIOD_NS, seq };
    let mut scan = LaserScan { header, ..LaserScan::of(&task.lidar, |_| 0.0) };
    for (beam, range_m) in scan.ranges_m.iter_mut().enumerate() {
        *range_m = 1.0 + ((beam as u64 * 7 + seq) % 40) as f32 * 0.1;
    }
    let along = seq as f32 * 0.05;
    let odom = Odometry {
        header,
        pose: Pose::new(along, 0.1 * along, 0.02 * along),
        linear_mps: 0.5,
        ..Odometry::default()
    };
    let goal = Goal { header, x_m: 8.0, y_m: 3.0, radius_m: 0.3, id: goal_id };
    (scan, odom, goal)
}

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

/// What lock-step evaluation rests on: a new goal of a robot that stands forgets everything, whatever was driven before.
#[test]
fn a_new_goal_is_a_new_life() {
    let task = Task::default();
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
