//! How many updates the learners make in a second of one core's time: nothing but the update itself.
//!
//! `cargo run --release --package trainer --example learner_speed`
//!
//! Time is processor time of this process, so that other programs on the machine disturb it little. Batches
//! are sampled anew from the replay buffer for every update, as in training.

#![allow(clippy::print_stdout, reason = "a table is what this program is for")]

use std::time::Duration;

use rand::{RngExt, SeedableRng};
use tch::{Device, Kind, Tensor};
use trainer::dqn::{Candidates, Decision, DecisionBatch, Dqn, DqnConfig};
use trainer::nn::{self, Rng};
use trainer::replay::ReplayBuffer;
use trainer::td3::{Batch, Td3, Td3Config, Transition};

const OBSERVATION: usize = 82;
const ACTION: usize = 2;
const COMPACT: usize = 90;
const CANDIDATES: usize = 18;
const CANDIDATE_WIDTH: usize = 100;

/// Processor time of this process.
fn processor_time() -> Duration {
    let mut usage = std::mem::MaybeUninit::<libc::rusage>::zeroed();
    // SAFETY: getrusage fills the structure it is given; zeroes are valid for it if it does not.
    let usage = unsafe {
        libc::getrusage(libc::RUSAGE_SELF, usage.as_mut_ptr());
        usage.assume_init()
    };
    let seconds = usage.ru_utime.tv_sec + usage.ru_stime.tv_sec;
    let microseconds = usage.ru_utime.tv_usec + usage.ru_stime.tv_usec;
    Duration::from_micros((seconds * 1_000_000 + microseconds) as u64)
}

/// Updates a processor second, over about one such second.
fn rate(mut update: impl FnMut()) -> f64 {
    (0..20).for_each(|_| update());
    let start = processor_time();
    let mut updates = 0;
    while processor_time() - start < Duration::from_secs(1) {
        (0..10).for_each(|_| update());
        updates += 10;
    }
    f64::from(updates) / (processor_time() - start).as_secs_f64()
}

fn uniform(count: usize, rng: &mut Rng) -> Vec<f32> {
    (0..count).map(|_| 2.0 * rng.random::<f32>() - 1.0).collect()
}

fn td3_rate(config: Td3Config, rows: usize) -> f64 {
    let mut rng = Rng::seed_from_u64(1);
    let mut replay = ReplayBuffer::new(20_000, Transition::row_length(OBSERVATION, ACTION));
    for _ in 0..20_000 {
        let row = uniform(Transition::row_length(OBSERVATION, ACTION), &mut rng);
        replay.push(&[&row]);
    }
    let mut td3 = Td3::new(OBSERVATION, ACTION, config, 2);
    let mut batch = Batch::new(rows, OBSERVATION, ACTION);
    rate(|| {
        batch.sample(&replay, &mut rng);
        td3.update(&mut batch);
    })
}

/// As cheap as an expansion can be: the cost of the real one belongs to the observation.
fn expand(observation: &[f32], rows: &mut [f32]) {
    for row in rows.chunks_exact_mut(CANDIDATE_WIDTH) {
        row[..COMPACT].copy_from_slice(observation);
    }
}

fn dqn_rate(hidden: &[usize], rows: usize, legal: usize) -> f64 {
    let mut rng = Rng::seed_from_u64(3);
    let mut replay = ReplayBuffer::new(20_000, Decision::row_length(COMPACT));
    for _ in 0..20_000 {
        let (now, next) = (uniform(COMPACT, &mut rng), uniform(COMPACT, &mut rng));
        Decision {
            observation: &now,
            action: rng.random_range(0..CANDIDATES as u32),
            reward: rng.random(),
            discount: 0.8,
            next_observation: &next,
            next_mask: (1 << legal) - 1,
        }
        .store(&mut replay);
    }
    let candidates = Candidates { observation: COMPACT, count: CANDIDATES, width: CANDIDATE_WIDTH, expand };
    let config = DqnConfig { hidden: hidden.to_vec(), ..DqnConfig::default() };
    let mut dqn = Dqn::new(candidates, config, 4);
    let mut batch = DecisionBatch::new(rows, COMPACT);
    rate(|| {
        batch.sample(&replay, &mut rng);
        dqn.update(&batch);
    })
}

/// GFLOP/s of the matrix product alone: the floor below every figure, and a measure of how quiet the machine is.
fn product_speed(size: usize) -> f64 {
    let side = size as i64;
    let [a, b, c] = [(); 3].map(|()| Tensor::zeros([side, side], (Kind::Float, Device::Cpu)));
    rate(|| drop(a.mm_out(&c, &b))) * 2.0 * (size as f64).powi(3) / 1e9
}

fn main() {
    nn::init_torch();
    println!("matrix product 256 x 256 x 256: {:.0} GFLOP/s", product_speed(256));
    println!("TD3, {OBSERVATION} -> hidden -> {ACTION}, updates a core second");
    for hidden in [64, 128, 256] {
        for rows in [64, 128, 256] {
            let config = Td3Config { hidden: vec![hidden; 2], ..Td3Config::default() };
            let plain = Td3Config { critic_layer_norm: false, ..config.clone() };
            let smooth = Td3Config { smooth_temporal: 0.1, smooth_spatial: 0.1, ..config.clone() };
            println!(
                "{hidden:>4}-{hidden:<4} batch {rows:>4}  {:>6.0}   without layer norm {:>6.0}   with smoothness {:>6.0}",
                td3_rate(config, rows),
                td3_rate(plain, rows),
                td3_rate(smooth, rows)
            );
        }
    }
    println!("DQN, {CANDIDATES} candidates of {CANDIDATE_WIDTH}, batch 128, updates a core second");
    for hidden in [64, 128] {
        let shape = [hidden; 2];
        println!(
            "{hidden:>4}-{hidden:<4} all legal {:>6.0}   half legal {:>6.0}",
            dqn_rate(&shape, 128, CANDIDATES),
            dqn_rate(&shape, 128, CANDIDATES / 2)
        );
    }
    println!("matrix product 256 x 256 x 256: {:.0} GFLOP/s", product_speed(256));
}
