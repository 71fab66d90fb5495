//! What an update must do, on a chain small enough to know its values.

use rand::{RngExt, SeedableRng};

use super::*;
use crate::replay::ReplayBuffer;

const STATES: usize = 3;
const COUNT: usize = 3;

/// Candidate rows: the state, one-hot, times the candidate, one-hot.
fn expand(observation: &[f32], rows: &mut [f32]) {
    rows.fill(0.0);
    for candidate in 0..COUNT {
        for (state, value) in observation.iter().enumerate() {
            rows[candidate * STATES * COUNT + candidate * STATES + state] = *value;
        }
    }
}

const CHAIN: Candidates = Candidates { observation: STATES, count: COUNT, width: STATES * COUNT, expand };

fn one_hot(state: usize) -> [f32; STATES] {
    std::array::from_fn(|index| if index == state { 1.0 } else { 0.0 })
}

fn config() -> DqnConfig {
    DqnConfig { hidden: vec![32], learning_rate: 3e-3, tau: 0.05, ..DqnConfig::default() }
}

fn decision(state: usize, action: u32, reward: f32, discount: f32, next: usize, mask: u32) -> Vec<f32> {
    let mut replay = ReplayBuffer::new(1, Decision::row_length(STATES));
    Decision {
        observation: &one_hot(state),
        action,
        reward,
        discount,
        next_observation: &one_hot(next),
        next_mask: mask,
    }
    .store(&mut replay);
    replay.rows().to_vec()
}

fn replay(rows: &[Vec<f32>]) -> ReplayBuffer {
    let mut replay = ReplayBuffer::new(rows.len(), Decision::row_length(STATES));
    rows.iter().for_each(|row| replay.push(&[row]));
    replay
}

/// State 0 leads to 1, 1 to 2, and 2 ends; candidate 2 looks like riches in state 1 but is illegal there.
fn chain() -> ReplayBuffer {
    replay(&[
        decision(0, 0, 1.0, 0.5, 1, 0b011),
        decision(0, 1, 0.0, 0.9, 1, 0b011),
        decision(1, 0, 0.0, 0.8, 2, 0b111),
        decision(1, 1, 1.0, 0.25, 2, 0b001),
        decision(1, 2, 100.0, 0.0, 2, 0b111),
        decision(2, 0, 2.0, 0.0, 0, 0b111),
        decision(2, 1, 4.0, 0.0, 0, 0b111),
        decision(2, 2, -1.0, 0.7, 0, 0b000),
    ])
}

fn train(dqn: &mut Dqn, replay: &ReplayBuffer, updates: usize, rng: &mut Rng) -> DqnLosses {
    let mut batch = DecisionBatch::new(64, STATES);
    let mut losses = DqnLosses::default();
    for _ in 0..updates {
        batch.sample(replay, rng);
        losses = dqn.update(&batch);
    }
    losses
}

#[test]
fn values_of_a_chain_with_masks_and_several_discounts() {
    let mut dqn = Dqn::new(CHAIN, DqnConfig { huber_delta: 10.0, ..config() }, 1);
    let losses = train(&mut dqn, &chain(), 4000, &mut Rng::seed_from_u64(2));
    assert!(losses.is_sane());
    // Best legal value of state 1: max(0.8 * 4, 1 + 0.25 * 2) = 3.2.
    let expected = [[1.0 + 0.5 * 3.2, 0.9 * 3.2, f32::NAN], [3.2, 1.5, 100.0], [2.0, 4.0, -1.0]];
    for (state, expected) in expected.iter().enumerate() {
        let values = dqn.values(&one_hot(state));
        assert_eq!(values.len(), COUNT);
        for (value, expected) in values.iter().zip(expected).filter(|(_, expected)| expected.is_finite()) {
            assert!((value - expected).abs() < 0.03 * expected.abs().max(2.0), "{state}: {values:?}");
        }
    }
}

#[test]
fn the_loss_is_that_of_double_dqn_written_out() {
    let mut rng = Rng::seed_from_u64(3);
    let mut dqn = Dqn::new(CHAIN, config(), 4);
    for parameter in dqn.target.parameters_mut() {
        *parameter += 0.3 * (rng.random::<f32>() - 0.5);
    }
    let mut batch = DecisionBatch::new(50, STATES);
    batch.sample(&chain(), &mut rng);
    let mut huber = 0.0;
    for row in 0..batch.rows() {
        let masks: Vec<_> = batch.next_masks().collect();
        let next = &batch.next[row * STATES..][..STATES];
        let legal = (0..COUNT).filter(|candidate| masks[row] >> candidate & 1 == 1);
        let online = dqn.values(next).to_vec();
        let best = legal.max_by(|a, b| online[*a].total_cmp(&online[*b]));
        let mut rows = [0.0; COUNT * COUNT * STATES];
        expand(next, &mut rows);
        let rows = Buffer::of(&rows, COUNT * STATES);
        let target = best.map_or(0.0, |best| dqn.target.forward(&rows.view(COUNT))[best]);
        let y = batch.returns()[row] + batch.discounts()[row] * target;
        let error = (dqn.values(batch.observation_row(row))[batch.actions()[row] as usize] - y).abs();
        huber += if error < 1.0 { 0.5 * error * error } else { error - 0.5 };
    }
    let losses = dqn.update(&batch);
    assert!((losses.loss - huber / 50.0).abs() < 1e-4 * losses.loss, "{} and {}", losses.loss, huber / 50.0);
}

#[test]
fn every_parameter_receives_a_gradient() {
    let mut dqn = Dqn::new(CHAIN, config(), 5);
    dqn.online.lift_hidden_units();
    let mut rows = Vec::new();
    let mut rng = Rng::seed_from_u64(6);
    for _ in 0..500 {
        let observation: [f32; STATES] = std::array::from_fn(|_| 2.0 * rng.random::<f32>() - 1.0);
        let mut row = decision(0, rng.random_range(0..3), rng.random(), 0.9, 1, 0b111);
        row[..STATES].copy_from_slice(&observation);
        rows.push(row);
    }
    train(&mut dqn, &replay(&rows), 20, &mut rng);
    assert_eq!(dqn.adam.reached(), dqn.online.parameter_count());
}

#[test]
fn a_batch_of_last_decisions_needs_no_next_one() {
    let mut dqn = Dqn::new(CHAIN, config(), 7);
    let only = replay(&[decision(2, 1, 4.0, 0.0, 0, 0b111), decision(2, 2, 4.0, 0.7, 0, 0)]);
    let losses = train(&mut dqn, &only, 1, &mut Rng::seed_from_u64(8));
    assert!((losses.target_mean - 4.0).abs() < 1e-6);
}

#[test]
fn a_restored_learner_continues_to_the_bit() {
    let mut dqn = Dqn::new(CHAIN, config(), 9);
    let mut rng = Rng::seed_from_u64(10);
    train(&mut dqn, &chain(), 5, &mut rng);
    dqn.set_learning_rate(1e-4);
    let (saved, saved_rng) = (dqn.state(), rng.clone());
    let losses = train(&mut dqn, &chain(), 5, &mut rng);
    let mut again = Dqn::new(CHAIN, config(), 77);
    assert!(again.restore(saved.clone()));
    assert_eq!(train(&mut again, &chain(), 5, &mut saved_rng.clone()), losses);
    assert_eq!(again.state(), dqn.state());
    assert!(!Dqn::new(CHAIN, DqnConfig { hidden: vec![8], ..config() }, 1).restore(saved));
}

#[test]
fn every_other_decision_of_a_batch_is_mirrored() {
    let replay = replay(&[decision(0, 1, 4.0, 0.5, 1, 0b011)]);
    let mirror = Mirror { observation: <[f32]>::reverse, candidate: |candidate| COUNT - 1 - candidate };
    // Bits beyond the candidates are never set.
    let mut batch = DecisionBatch::new(2, STATES).with_mirror(Some(mirror));
    batch.sample(&replay, &mut Rng::seed_from_u64(1));
    assert_eq!((batch.observation_row(0), batch.observation_row(1)), (&one_hot(0)[..], &one_hot(2)[..]));
    assert_eq!(batch.next, [one_hot(1), one_hot(1)].concat());
    assert_eq!((batch.actions(), batch.returns()), (&[1, 1][..], &[4.0, 4.0][..]));
    assert_eq!(batch.next_masks().collect::<Vec<_>>(), [0b011, 0b110]);
}
