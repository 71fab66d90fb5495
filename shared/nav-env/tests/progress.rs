//! What progress towards the goal pays a robot of stage A.

use std::sync::Arc;

use nav_core::observation::LOW_ACTION;
use nav_core::reward::{LowReward, decomposed};
use nav_core::task::Task;
use nav_env::low::{Attempt, LowRobot, LowRobotConfig, Progress};
use nav_env::worlds::generate_places;
use nav_sim::disturbance::Disturbance;
use nav_sim::families::{Family, Split};

/// What a perfect robot that drives at the goal of a trap earns by progress alone in its first episode, and by how much the
/// straight and the shortest way to the goal became shorter, m.
fn earned(progress: Progress, seed: u64) -> (f32, f32, f32) {
    let task = Task::default();
    let footprint = task.robot.footprint;
    let places = Arc::new(generate_places(&[Family::UTrap], Split::Train, seed..seed + 1, &footprint));
    let weights = decomposed::LowWeights {
        progress: 1.0,
        time: 0.0,
        turning: 0.0,
        change: 0.0,
        proximity: 0.0,
        reached: 0.0,
        collided: 0.0,
        ..decomposed::LowWeights::default()
    };
    let config = LowRobotConfig {
        goal_share: 1.0,
        subgoal_m: [0.7, 3.0],
        subgoal_s: 8.0,
        discount: 0.99,
        n_step: 1,
        reward: LowReward::Decomposed(weights),
        progress,
    };
    let mut robot = LowRobot::new(config, places, &task, &Disturbance::none(), 3);
    let ways_m = |robot: &LowRobot| {
        let here = robot.episode().pose().position();
        ((robot.true_target() - here).norm(), robot.episode().way_m().expect("the robot fits there"))
    };
    let (straight_m, shortest_m) = ways_m(&robot);
    let (mut sum, mut now) = (0.0, (straight_m, shortest_m));
    for _ in 0..200 {
        let (sin, cos) = {
            let local = robot.episode().pose().local_from_parent(robot.true_target());
            (local.y.atan2(local.x), local.x)
        };
        let action: [f32; LOW_ACTION] = [if cos > 0.0 { 0.0 } else { -1.0 }, sin.clamp(-1.0, 1.0)];
        let report = robot.step(action, &mut Vec::new());
        sum += report.reward;
        if report.attempt != Attempt::Running {
            break;
        }
        now = ways_m(&robot);
    }
    (sum, straight_m - now.0, shortest_m - now.1)
}

#[test]
fn it_is_paid_by_the_way_that_is_asked_for() {
    let mut apart = 0;
    for seed in 0..5 {
        let (straight, straight_m, _) = earned(Progress::Straight, seed);
        let (geodesic, _, shortest_m) = earned(Progress::Geodesic, seed);
        // The last step, in which the robot bumps into the trap, is a tick's way at most.
        assert!((straight - straight_m).abs() < 0.12, "{seed}: {straight}, {straight_m} m nearer");
        assert!((geodesic - shortest_m).abs() < 0.25, "{seed}: {geodesic}, {shortest_m} m of way less");
        apart += u32::from((straight - geodesic).abs() > 1.0);
    }
    assert!(apart >= 3, "straight into a trap is no progress: {apart} of 5");
}
