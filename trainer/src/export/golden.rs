//! Golden pairs: observations from driving, and what the trainer's own networks (libtorch) answer.

use anyhow::{Context, Result};
use nav_core::observation::{CANDIDATE_FEATURES, LOW_ACTION, expand_candidates};
use nav_core::task::{ACTION_COUNT, ACTION_GOAL};
use nav_env::high::HighRobot;
use nav_env::low::LowRobot;
use nav_env::worlds::generate_places;
use nav_model::model::{Golden, GoldenPair};
use nav_sim::families::{Family, Split};
use std::sync::Arc;

use crate::nn::{Buffer, Mlp};
use crate::train::policy::Policy;

/// Pairs a network.
const PAIRS: usize = 64;
/// Steps between two pairs of the low level.
const STRIDE: usize = 7;

/// What a network is fed for an observation: itself, or the candidate matrix.
pub(super) fn input_of(observation: &[f32], is_high: bool) -> Vec<f32> {
    if !is_high {
        return observation.to_vec();
    }
    let mut rows = vec![0.0; ACTION_COUNT * CANDIDATE_FEATURES];
    expand_candidates(observation, &mut rows);
    rows
}

/// Drives on validation worlds and notes pairs of every network.
///
/// # Errors
/// Damaged weights.
pub(super) fn golden_pairs(policy: &Policy) -> Result<Golden> {
    let config = policy.config()?;
    let families = [Family::Clutter, Family::UTrap, Family::Rooms, Family::Crowd];
    let places = Arc::new(generate_places(&families, Split::Validation, 0..4, &config.task.robot.footprint));
    let mut golden = Golden::default();
    let (task, disturbance) = (&policy.task, &config.disturbance);
    let mut actor = policy.actor.network()?;
    let mut acting = policy.low()?;
    let mut robot = LowRobot::new(config.low.robot(), places.clone(), task, disturbance, config.seed);
    for step in 0..PAIRS * STRIDE {
        let observation = *robot.observation();
        if step % STRIDE == 0 {
            let mut normalised = observation;
            policy.normaliser.apply(&mut normalised);
            let answer = answer(&mut actor, &normalised, 1);
            golden.td3.push(GoldenPair { observation: observation.to_vec(), answer });
        }
        let mut action = [0.0; LOW_ACTION];
        acting.run(&observation, &mut action);
        robot.step(action, &mut Vec::new());
    }
    if let (Some(scorer), Some(mut high)) = (&policy.scorer, policy.high()?) {
        let mut scorer = scorer.network()?;
        let mut robot = HighRobot::new(config.high.robot(), places, task, disturbance, config.seed);
        let mut values = [0.0; ACTION_COUNT];
        for _ in 0..PAIRS {
            let observation = *robot.observation();
            let rows = input_of(&observation, true);
            let answer = answer(&mut scorer, &rows, ACTION_COUNT);
            golden.dqn.push(GoldenPair { observation: observation.to_vec(), answer });
            high.run(&rows, &mut values);
            let action = robot.mask().best(&values, task.decision.deviation_margin).unwrap_or(ACTION_GOAL);
            robot.decide(action, &mut acting, &mut Vec::new());
        }
    }
    let finite = |pair: &GoldenPair| pair.answer.iter().all(|value| value.is_finite());
    (golden.td3.iter().all(finite) && golden.dqn.iter().all(finite))
        .then_some(golden)
        .context("a network answers with numbers that are not finite")
}

/// What libtorch computes.
fn answer(mlp: &mut Mlp, input: &[f32], rows: usize) -> Vec<f32> {
    mlp.forward(&Buffer::of(input, input.len() / rows).view(rows)).to_vec()
}
