//! What stage A's robots hand out with returns over several steps follows from what they hand out with one.

use std::sync::Arc;

use nav_core::observation::LOW_ACTION;
use nav_core::reward::{LowReward, decomposed};
use nav_core::task::Task;
use nav_env::low::{Attempt, LowRobot, LowRobotConfig, LowTransition};
use nav_env::worlds::generate_places;
use nav_sim::disturbance::Disturbance;
use nav_sim::families::{Family, Split};

const DISCOUNT: f32 = 0.9;

/// Driven by the same actions: what was handed out, and how the attempt stood after each step.
fn drive(n_step: usize) -> (Vec<LowTransition>, Vec<(Attempt, bool)>) {
    let places = Arc::new(generate_places(&[Family::Tight], Split::Train, 0..2, 0.2));
    let config = LowRobotConfig {
        goal_share: 0.3,
        subgoal_m: [0.7, 3.0],
        subgoal_s: 3.0,
        discount: DISCOUNT,
        n_step,
        reward: LowReward::Decomposed(decomposed::LowWeights::default()),
    };
    let mut robot = LowRobot::new(config, places, &Task::default(), &Disturbance::trained(), 7);
    let (mut transitions, mut attempts) = (Vec::new(), Vec::new());
    for step in 0..3_000_u32 {
        let action: [f32; LOW_ACTION] = [0.2, (step as f32 * 0.05).sin()];
        let report = robot.step(action, &mut transitions);
        attempts.push((report.attempt, report.is_terminated));
    }
    (transitions, attempts)
}

#[test]
fn a_return_sums_the_rewards_of_its_steps_and_ends_with_its_attempt() {
    const N: usize = 3;
    let (ones, attempts) = drive(1);
    let (several, _) = drive(N);
    assert_eq!(ones.len(), attempts.len(), "each step is complete at once");
    let ended = |kind: Attempt| attempts.iter().filter(|(attempt, _)| *attempt == kind).count();
    assert!(ended(Attempt::Collided) > 3 && ended(Attempt::GivenUp) > 3, "both kinds of end are seen");
    assert!(several.len() > ones.len() - N, "only the newest steps may wait");
    for (first, of_several) in several.iter().enumerate() {
        let last = (first..first + N).find(|&at| attempts[at].0 != Attempt::Running).unwrap_or(first + N - 1);
        let sum = ones[first..=last].iter().rev().fold(0.0, |sum, one| one.reward + DISCOUNT * sum);
        assert!((of_several.reward - sum).abs() < 1e-4, "{first}: {} {sum}", of_several.reward);
        let discount = if attempts[last].1 { 0.0 } else { DISCOUNT.powi((last - first + 1) as i32) };
        assert!((of_several.discount - discount).abs() < 1e-6, "{first}: {}", of_several.discount);
        assert!(of_several.observation.iter().eq(&ones[first].observation));
        assert!(of_several.action.iter().eq(&ones[first].action));
        assert!(of_several.next_observation.iter().eq(&ones[last].next_observation));
    }
}
