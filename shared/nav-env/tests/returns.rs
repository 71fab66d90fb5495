//! What stage A's robots hand out with returns over several steps follows from what they hand out with one.

use std::sync::Arc;

use nav_core::observation::LOW_ACTION;
use nav_core::reward::{LowReward, decomposed};
use nav_core::task::Task;
use nav_env::low::{Attempt, LowRobot, LowRobotConfig, LowTransition, Progress};
use nav_env::worlds::generate_places;
use nav_sim::disturbance::Disturbance;
use nav_sim::families::{Family, Split};

const DISCOUNT: f32 = 0.9;

/// Driven by the same actions: what was handed out, and how the attempt stood after each step.
fn drive(n_step: usize) -> (Vec<LowTransition>, Vec<(Attempt, bool)>) {
    let (transitions, ticks) = drive_as(&Task::default(), n_step);
    (transitions, ticks.into_iter().map(|tick| (tick.attempt, tick.is_terminated)).collect())
}

/// A tick: how the attempt stood after it, and what it earned; and whether one of a multiple of five since its episode began.
struct Ticked {
    attempt: Attempt,
    is_terminated: bool,
    reward: f32,
    is_fifth: bool,
}

fn drive_as(task: &Task, n_step: usize) -> (Vec<LowTransition>, Vec<Ticked>) {
    let places =
        Arc::new(generate_places(&[Family::Tight], Split::Train, 0..2, &Task::default().robot.footprint));
    let config = LowRobotConfig {
        goal_share: 0.3,
        subgoal_m: [0.7, 3.0],
        subgoal_s: 3.0,
        discount: DISCOUNT,
        n_step,
        reward: LowReward::Decomposed(decomposed::LowWeights::default()),
        progress: Progress::Straight,
    };
    let mut robot = LowRobot::new(config, places, task, &Disturbance::trained(), 7);
    let (mut transitions, mut ticks) = (Vec::new(), Vec::new());
    for step in 0..3_000_u32 {
        let action: [f32; LOW_ACTION] = [0.2, (step as f32 * 0.05).sin()];
        let is_fifth = robot.history().1.len().is_multiple_of(5);
        let report = robot.step(action, &mut transitions);
        let (attempt, is_terminated, reward) = (report.attempt, report.is_terminated, report.reward);
        ticks.push(Ticked { attempt, is_terminated, reward, is_fifth });
    }
    (transitions, ticks)
}

/// A robot at 50 Hz learns from as many returns a second as one at 10 Hz, each over as many seconds.
#[test]
fn a_robot_that_ticks_five_times_as_fast_begins_a_return_each_fifth_tick() {
    const N: usize = 15;
    let (returns, ticks) = drive_as(&Task { control_period_s: 0.02, ..Task::default() }, N);
    let fifths: Vec<usize> = (0..ticks.len()).filter(|&at| ticks[at].is_fifth).collect();
    assert!(returns.len() > 500 && fifths.len() - returns.len() < 4, "{} of {}", returns.len(), fifths.len());
    let mut cut = 0;
    for (found, &first) in returns.iter().zip(&fifths) {
        let last = (first..first + N).find(|&at| ticks[at].attempt != Attempt::Running);
        cut += usize::from(last.is_some());
        let last = last.unwrap_or(first + N - 1);
        let sum = ticks[first..=last].iter().rev().fold(0.0, |sum, tick| tick.reward + DISCOUNT * sum);
        assert!((found.reward - sum).abs() < 1e-4, "{first}: {} {sum}", found.reward);
        let discount = if ticks[last].is_terminated { 0.0 } else { DISCOUNT.powi((last - first + 1) as i32) };
        assert!((found.discount - discount).abs() < 1e-6, "{first}: {}", found.discount);
    }
    assert!(cut > 3, "some ended with their attempt: {cut}");
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
