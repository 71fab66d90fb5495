//! A low level is trained without the safety gate and scored behind it.

use nav_core::observation::LOW_ACTION;
use nav_core::reward::{LowReward, decomposed};
use nav_core::task::{ShieldMode, Task};
use nav_env::low::{Attempt, LowRobot, LowRobotConfig, Progress};
use nav_env::worlds::generate_places;
use nav_sim::disturbance::Disturbance;
use nav_sim::families::{Family, Split};
use std::sync::Arc;

/// How many attempts end in a collision when it always drives ahead.
fn collisions(shield: ShieldMode, is_behind_gate: bool) -> usize {
    let task = Task { shield, ..Task::default() };
    let places = Arc::new(generate_places(&[Family::Tight], Split::Train, 0..4, &task.robot.footprint));
    let config = LowRobotConfig {
        goal_share: 0.3,
        subgoal_m: [0.7, 3.0],
        subgoal_s: 3.0,
        discount: 0.9,
        n_step: 1,
        reward: LowReward::Decomposed(decomposed::LowWeights::default()),
        progress: Progress::Straight,
    };
    let mut robot = LowRobot::new(config, places, &task, &Disturbance::none(), 7);
    if is_behind_gate {
        robot = robot.behind_gate();
    }
    let action: [f32; LOW_ACTION] = [1.0, 0.1];
    (0..1_500).filter(|_| robot.step(action, &mut Vec::new()).attempt == Attempt::Collided).count()
}

#[test]
fn whoever_drives_into_everything_collides_only_where_no_gate_stands() {
    assert!(collisions(ShieldMode::On, false) > 10, "in training");
    assert_eq!(collisions(ShieldMode::On, true), 0, "scored");
    assert!(collisions(ShieldMode::Off, true) > 10, "scored for a task without a gate");
}
