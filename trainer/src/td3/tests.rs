//! What an update must do, on problems small enough to know the answer.

use rand::{RngExt, SeedableRng};

use super::*;
use crate::nn::Buffer;
use crate::replay::ReplayBuffer;

const OBSERVATION: usize = 3;
const ACTION: usize = 2;

fn config() -> Td3Config {
    Td3Config {
        hidden: vec![32, 32],
        actor_learning_rate: 1e-3,
        critic_learning_rate: 3e-3,
        ..Td3Config::default()
    }
}

fn uniform<const N: usize>(rng: &mut Rng) -> [f32; N] {
    std::array::from_fn(|_| 2.0 * rng.random::<f32>() - 1.0)
}

/// One-step problem: the reward is highest at the action `(0.5 s0, -0.5 s1)`.
fn replay(rows: usize, discount: f32) -> ReplayBuffer {
    let mut rng = Rng::seed_from_u64(9);
    let mut replay = ReplayBuffer::new(rows, Transition::row_length(OBSERVATION, ACTION));
    for _ in 0..rows {
        let (s, a, next): ([f32; 3], [f32; 2], [f32; 3]) =
            (uniform(&mut rng), uniform(&mut rng), uniform(&mut rng));
        let reward = -(a[0] - 0.5 * s[0]).powi(2) - (a[1] + 0.5 * s[1]).powi(2);
        Transition { observation: &s, action: &a, reward, discount, next_observation: &next }
            .store(&mut replay);
    }
    replay
}

fn train(td3: &mut Td3, replay: &ReplayBuffer, updates: usize, rng: &mut Rng) -> Td3Losses {
    let mut batch = Batch::new(64, OBSERVATION, ACTION);
    let mut losses = Td3Losses::default();
    for _ in 0..updates {
        batch.sample(replay, rng);
        losses = td3.update(&mut batch);
    }
    losses
}

fn act(td3: &mut Td3, observation: &[f32; OBSERVATION]) -> Vec<f32> {
    td3.actor.forward(&Buffer::of(observation, OBSERVATION).view(1)).to_vec()
}

#[test]
fn the_policy_finds_the_best_action() {
    let mut td3 = Td3::new(OBSERVATION, ACTION, config(), 1);
    let losses = train(&mut td3, &replay(4000, 0.0), 2000, &mut Rng::seed_from_u64(2));
    assert!(losses.is_sane());
    assert!(losses.critic < 0.02, "{losses:?}");
    let mut rng = Rng::seed_from_u64(3);
    let mut error = 0.0;
    for _ in 0..100 {
        let s: [f32; 3] = uniform(&mut rng);
        let action = act(&mut td3, &s);
        error += ((action[0] - 0.5 * s[0]).abs() + (action[1] + 0.5 * s[1]).abs()) / 200.0;
    }
    // A policy that always answers zero is wrong by 0.25.
    assert!(error < 0.08, "wrong by {error}");
}

/// Mean error of the actions after some hundred updates from an actor that sits at -1 whatever it sees.
fn error_of_a_saturated_actor(tanh_slope_min: f32) -> f32 {
    let config = Td3Config { actor_learning_rate: 1e-2, tanh_slope_min, ..config() };
    let mut td3 = Td3::new(OBSERVATION, ACTION, config, 16);
    td3.actor.shift_outputs(-20.0);
    td3.actor_target.shift_outputs(-20.0);
    let losses = train(&mut td3, &replay(4000, 0.0), 2, &mut Rng::seed_from_u64(17));
    assert!(losses.saturation > 0.99, "it starts saturated: {losses:?}");
    train(&mut td3, &replay(4000, 0.0), 600, &mut Rng::seed_from_u64(18));
    let mut rng = Rng::seed_from_u64(19);
    let mut error = 0.0;
    for _ in 0..100 {
        let s: [f32; 3] = uniform(&mut rng);
        let action = act(&mut td3, &s);
        error += ((action[0] - 0.5 * s[0]).abs() + (action[1] + 0.5 * s[1]).abs()) / 200.0;
    }
    error
}

#[test]
fn a_saturated_actor_finds_back_but_not_along_the_exact_slope() {
    let with_a_floor = error_of_a_saturated_actor(0.1);
    assert!(with_a_floor < 0.15, "wrong by {with_a_floor}");
    // An action of -1 is wrong by 1 on average.
    let exact = error_of_a_saturated_actor(0.0);
    assert!(exact > 0.9, "wrong by {exact}");
}

#[test]
fn the_value_of_a_constant_reward_is_its_geometric_sum() {
    let mut rng = Rng::seed_from_u64(3);
    let mut replay = ReplayBuffer::new(500, Transition::row_length(OBSERVATION, ACTION));
    for _ in 0..500 {
        let (s, a, next): ([f32; 3], [f32; 2], [f32; 3]) =
            (uniform(&mut rng), uniform(&mut rng), uniform(&mut rng));
        Transition { observation: &s, action: &a, reward: 1.0, discount: 0.8, next_observation: &next }
            .store(&mut replay);
    }
    let mut td3 = Td3::new(OBSERVATION, ACTION, Td3Config { tau: 0.05, ..config() }, 4);
    let losses = train(&mut td3, &replay, 2500, &mut rng);
    assert!((losses.q_mean - 5.0).abs() < 0.1, "1 / (1 - 0.8) is 5, not {}", losses.q_mean);
}

#[test]
fn actor_and_targets_wait_for_their_turn() {
    let replay = replay(200, 0.9);
    let mut rng = Rng::seed_from_u64(5);
    let mut td3 = Td3::new(OBSERVATION, ACTION, Td3Config { policy_delay: 3, ..config() }, 6);
    let before = td3.state();
    train(&mut td3, &replay, 2, &mut rng);
    let waiting = td3.state();
    assert_eq!(before.actor, waiting.actor);
    assert_eq!(before.critics[0].1, waiting.critics[0].1);
    assert_ne!(before.critics[0].0, waiting.critics[0].0);
    assert_ne!(before.critics[1].0, waiting.critics[1].0);
    train(&mut td3, &replay, 1, &mut rng);
    let moved = td3.state();
    assert_ne!(before.actor, moved.actor);
    assert_ne!(before.actor_target, moved.actor_target);
    assert_ne!(before.critics[1].1, moved.critics[1].1);
}

#[test]
fn every_parameter_of_every_network_receives_a_gradient() {
    let replay = replay(2000, 0.9);
    let smooth = Td3Config { smooth_temporal: 0.1, smooth_spatial: 0.1, ..config() };
    for config in [config(), smooth] {
        let mut td3 = Td3::new(OBSERVATION, ACTION, config, 7);
        td3.actor.lift_hidden_units();
        train(&mut td3, &replay, 20, &mut Rng::seed_from_u64(8));
        assert_eq!(td3.actor_adam.reached(), td3.actor.parameter_count());
        for critic in &td3.critics {
            assert_eq!(critic.adam.reached(), critic.online.parameter_count());
        }
    }
}

#[test]
fn a_restored_learner_continues_to_the_bit() {
    let replay = replay(300, 0.9);
    let config = Td3Config { smooth_spatial: 0.1, gradient_norm_max: 1.0, ..config() };
    let mut td3 = Td3::new(OBSERVATION, ACTION, config.clone(), 10);
    let mut rng = Rng::seed_from_u64(11);
    train(&mut td3, &replay, 7, &mut rng);
    td3.set_learning_rate_share(0.5);
    let (saved, saved_rng) = (td3.state(), rng.clone());
    let losses = train(&mut td3, &replay, 7, &mut rng);
    let mut again = Td3::new(OBSERVATION, ACTION, config.clone(), 99);
    assert!(again.restore(saved.clone()));
    assert_eq!(train(&mut again, &replay, 7, &mut saved_rng.clone()), losses);
    assert_eq!(again.state(), td3.state());
    let mut other = Td3::new(OBSERVATION, ACTION, Td3Config { hidden: vec![8], ..config }, 1);
    assert!(!other.restore(saved));
}

#[test]
fn smoothness_has_the_derivative_of_its_loss() {
    let config = Td3Config { smooth_temporal: 0.7, smooth_spatial: 0.3, ..config() };
    let smoothness = Smoothness::new(&config, OBSERVATION, ACTION).expect("both weights are set");
    let (rows, h) = (4, 1e-2);
    let mut rng = Rng::seed_from_u64(12);
    let actions: [f32; 3 * 4 * ACTION] = uniform(&mut rng);
    let loss = |actions: &[f32]| {
        let (temporal, spatial) = smoothness.add_gradient(actions, rows, &mut vec![0.0; rows * ACTION]);
        0.7 * temporal + 0.3 * spatial
    };
    let mut gradient = vec![0.0; rows * ACTION];
    smoothness.add_gradient(&actions, rows, &mut gradient);
    assert_eq!(gradient.len(), actions.len());
    for index in 0..actions.len() {
        let (mut up, mut down) = (actions, actions);
        up[index] += h;
        down[index] -= h;
        let slope = (loss(&up) - loss(&down)) / (2.0 * h);
        assert!((slope - gradient[index]).abs() < 1e-3, "{index}: {slope} and {}", gradient[index]);
    }
}

#[test]
fn smoothness_makes_the_policy_flatter() {
    let roughness = |weight| {
        let config = Td3Config { smooth_temporal: weight, smooth_spatial: weight, ..config() };
        let mut td3 = Td3::new(OBSERVATION, ACTION, config, 13);
        train(&mut td3, &replay(2000, 0.0), 600, &mut Rng::seed_from_u64(14));
        let (left, right) = (act(&mut td3, &[-0.9, 0.0, 0.0]), act(&mut td3, &[0.9, 0.0, 0.0]));
        (left[0] - right[0]).abs()
    };
    let (free, smooth) = (roughness(0.0), roughness(2.0));
    assert!(smooth < 0.5 * free, "{smooth} against {free}");
}

#[test]
fn a_batch_mixes_replay_buffers() {
    let row_length = Transition::row_length(1, 1);
    let (mut ones, mut twos) = (ReplayBuffer::new(4, row_length), ReplayBuffer::new(4, row_length));
    for (replay, value) in [(&mut ones, 1.0), (&mut twos, 2.0)] {
        Transition {
            observation: &[value],
            action: &[value],
            reward: value,
            discount: value,
            next_observation: &[-value],
        }
        .store(replay);
    }
    let mut batch = Batch::new(4, 1, 1);
    let mut rng = Rng::seed_from_u64(15);
    batch.sample_rows(0..3, &ones, &mut rng);
    batch.sample_rows(3..4, &twos, &mut rng);
    assert_eq!(batch.rewards(), [1.0, 1.0, 1.0, 2.0]);
    assert_eq!(batch.discounts(), [1.0, 1.0, 1.0, 2.0]);
    assert_eq!((batch.observation_row(0), batch.next_observation_row(3)), (&[1.0][..], &[-2.0][..]));
}

#[test]
fn every_other_transition_of_a_batch_is_mirrored() {
    let mut replay = ReplayBuffer::new(1, Transition::row_length(2, 1));
    Transition {
        observation: &[1.0, 2.0],
        action: &[3.0],
        reward: 4.0,
        discount: 0.5,
        next_observation: &[5.0, 6.0],
    }
    .store(&mut replay);
    let mirror = Mirror { observation: <[f32]>::reverse, action: |action| action[0] = -action[0] };
    let mut batch = Batch::new(2, 2, 1).with_mirror(Some(mirror));
    batch.sample(&replay, &mut Rng::seed_from_u64(1));
    assert_eq!((batch.observation_row(0), batch.next_observation_row(0)), (&[1.0, 2.0][..], &[5.0, 6.0][..]));
    assert_eq!((batch.observation_row(1), batch.next_observation_row(1)), (&[2.0, 1.0][..], &[6.0, 5.0][..]));
    assert_eq!((batch.action_mut(0)[0], batch.action_mut(1)[0]), (3.0, -3.0));
    assert_eq!((batch.rewards(), batch.discounts()), (&[4.0, 4.0][..], &[0.5, 0.5][..]));
}
