//! Model files changed at random: refused with a sentence, or loaded and then what tract makes of the same file.
//!
//! The loader compares with tract on inputs of its own; here they are compared on others, and tract reads the bytes by itself,
//! without anything that the loader does to them first. How many of those that load compute something else than the original
//! is counted, and how many of these golden pairs would not notice: what only the hash in the manifest keeps out.
//!
//! `NAV_SOAK_SEED` and `NAV_SOAK_MUTANTS` say which mutants and how many.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod support {
    pub(crate) mod models;
    pub(crate) mod onnx;
    pub(crate) mod soak;
}

use nav_model::load::{LoadedNetwork, NetworkContract, PARITY_TOLERANCE, load_network};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use support::models;
use support::onnx::numbers;
use support::soak::{count, setting};
use tract_onnx::pb::TensorProto;
use tract_onnx::pb::tensor_proto::DataType;
use tract_onnx::prelude::{
    DatumType, Framework, InferenceFact, InferenceModelExt, IntoRunnable, Tensor, TractResult,
    TypedSimplePlan, tvec,
};

/// Inputs on which a mutant is compared, of these sizes in turn.
const FRESH: usize = 32;
const SIZES: [f32; 4] = [0.1, 1.0, 3.0, 30.0];
/// Differences that so many last bits of the input make are no others.
const ROUNDINGS: f32 = 16.0;
/// The largest error of tract's sigmoid, beside 0 (ours has none there); the weights behind it magnify it.
const FUNCTION_ERROR: f32 = 1e-5;
/// Golden pairs of the original.
const PAIRS: usize = 32;

/// Whole numbers at random, the same for the same seed.
struct Dice(u64);

impl Dice {
    fn below(&mut self, bound: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as usize % bound
    }

    /// Bytes replaced, cut out, doubled and swapped.
    fn mutate(&mut self, bytes: &[u8]) -> Vec<u8> {
        let mut mutant = bytes.to_vec();
        for _ in 0..=self.below(3) {
            // Weights are most of a file; its structure is at both ends of it.
            let at =
                if self.below(2) == 0 { self.below(mutant.len()) } else { self.below(mutant.len().min(600)) };
            let end = (at + 1 + self.below(40)).min(mutant.len());
            match self.below(4) {
                0 => mutant[at] = self.below(256) as u8,
                1 => drop(mutant.drain(at..end)),
                2 => {
                    let piece = mutant[at..end].to_vec();
                    mutant.splice(at..at, piece);
                }
                _ => {
                    let other = self.below(mutant.len());
                    mutant.swap(at, other);
                }
            }
        }
        mutant
    }
}

/// tract's own reading of the bytes; nothing where it cannot read them without help.
fn tract_alone(bytes: &[u8], contract: &NetworkContract) -> Option<Arc<TypedSimplePlan>> {
    let shape = [contract.input.rows, contract.input.cols];
    let read = || -> TractResult<_> {
        tract_onnx::onnx()
            .model_for_read(&mut &*bytes)?
            .with_input_fact(0, InferenceFact::dt_shape(DatumType::F32, shape))?
            .into_optimized()?
            .into_runnable()
    };
    catch_unwind(AssertUnwindSafe(read)).ok()?.ok()
}

fn run_tract(plan: &Arc<TypedSimplePlan>, contract: &NetworkContract, input: &[f32]) -> Vec<f32> {
    let shape = [contract.input.rows, contract.input.cols];
    let outputs = plan.run(tvec![Tensor::from_shape(&shape, input).unwrap().into()]).unwrap();
    outputs[0].try_as_plain_ram().unwrap().as_slice::<f32>().unwrap().to_vec()
}

fn run(network: &mut LoadedNetwork, input: &[f32]) -> Vec<f32> {
    let network = network.network_mut();
    let mut output = vec![0.0; network.output_len()];
    network.run(input, &mut output);
    output
}

/// The largest difference, relative as the loader's: to the larger of one and the largest result.
fn difference(found: &[f32], expected: &[f32]) -> f32 {
    assert_eq!(found.len(), expected.len());
    let size = expected.iter().fold(1.0_f32, |size, value| size.max(value.abs()));
    let differences = found.iter().zip(expected).map(|(found, expected)| (found - expected).abs() / size);
    // What is no number is as far away as can be.
    differences.map(|found| if found.is_nan() { f32::INFINITY } else { found }).fold(0.0, f32::max)
}

fn is_other(found: &[f32], expected: &[f32]) -> bool {
    difference(found, expected) > PARITY_TOLERANCE
}

/// How far tract's own answer moves when the last bit of each number of the input does: a mutant with huge weights magnifies
/// rounding, and two ways to add the same numbers then differ without a difference in what is computed.
fn magnified(plan: &Arc<TypedSimplePlan>, contract: &NetworkContract, input: &[f32], dice: &mut Dice) -> f32 {
    let answer = run_tract(plan, contract, input);
    let moved = |_| {
        let nudge = |number: &f32| if dice.below(2) == 0 { number.next_up() } else { number.next_down() };
        let nudged: Vec<f32> = input.iter().map(nudge).collect();
        difference(&run_tract(plan, contract, &nudged), &answer)
    };
    (0..8).map(moved).fold(0.0, f32::max)
}

/// The largest magnitude among the weights of a model.
fn largest_weight(bytes: &[u8]) -> f32 {
    let graph = tract_onnx::onnx().proto_model_for_read(&mut &*bytes).unwrap().graph.unwrap();
    let floats = |tensor: &TensorProto| -> Vec<f32> {
        if tensor.data_type != DataType::Float as i32 {
            return Vec::new();
        }
        let raw = tensor.raw_data.as_chunks().0.iter().map(|bytes| f32::from_le_bytes(*bytes));
        raw.chain(tensor.float_data.iter().copied()).collect()
    };
    graph.initializer.iter().flat_map(floats).fold(0.0, |largest, weight| largest.max(weight.abs()))
}

fn inputs(seed: u64, how_many: usize, sizes: &[f32], contract: &NetworkContract) -> Vec<Vec<f32>> {
    let of = |index: usize| {
        let noise = numbers(seed.wrapping_mul(1009).wrapping_add(index as u64), contract.input.elements());
        noise.into_iter().map(|number| 2.0 * sizes[index % sizes.len()] * number).collect()
    };
    (0..how_many).map(of).collect()
}

#[test]
fn mutated_models_are_refused_or_compute_what_tract_does() {
    let seed = setting("NAV_SOAK_SEED", 1);
    let mut dice = Dice(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1);
    let mut sources: Vec<_> = [models::flattened(), models::branches(), models::actor()]
        .into_iter()
        .map(|(name, bytes, contract)| {
            let original = load_network(&bytes, &contract).unwrap();
            let pairs = inputs(0, PAIRS, &[1.0], &contract);
            (name, bytes, contract, original, pairs)
        })
        .collect();
    let mutants = setting("NAV_SOAK_MUTANTS", 300);
    let mut nudges = Dice(seed | 1);
    let (mut loaded, mut helped, mut other, mut rough, mut changed, mut unseen) = (0, 0, Vec::new(), 0, 0, 0);
    for mutant in 0..mutants {
        let source = dice.below(sources.len());
        let (name, bytes, contract, original, pairs) = &mut sources[source];
        let bytes = dice.mutate(bytes);
        let mut network = match load_network(&bytes, contract) {
            Ok(network) => network,
            Err(error) => {
                assert!(!error.to_string().is_empty(), "{name}");
                continue;
            }
        };
        loaded += 1;
        let fresh = inputs(seed << 32 | (mutant + 1), FRESH, &SIZES, contract);
        match tract_alone(&bytes, contract) {
            None => helped += 1,
            Some(plan) => {
                let apart = fresh.iter().filter_map(|input| {
                    let ours = run(&mut network, input);
                    let apart = difference(&ours, &run_tract(&plan, contract, input));
                    (apart > PARITY_TOLERANCE)
                        .then(|| (apart, magnified(&plan, contract, input, &mut nudges)))
                });
                let apart: Vec<(f32, f32)> = apart.collect();
                let function = FUNCTION_ERROR * largest_weight(&bytes);
                match apart.iter().find(|(apart, magnified)| *apart > ROUNDINGS * magnified + function) {
                    Some(apart) => other.push(format!("{name}, mutant {mutant}: {apart:?}, {function:e}")),
                    None => rough += u64::from(!apart.is_empty()),
                }
            }
        }
        let mut differs = |input: &Vec<f32>| is_other(&run(&mut network, input), &run(original, input));
        if fresh.iter().any(&mut differs) {
            changed += 1;
            unseen += u64::from(!pairs.iter().any(&mut differs));
        }
    }
    count(&[
        ("mutated models", mutants),
        ("of them loaded", loaded),
        ("of these compute something else than tract on fresh inputs", other.len() as u64),
        ("of these magnify the last bits of an input, or of tract's sigmoid, until they show", rough),
        ("of these tract reads only with the loader's help", helped),
        ("of these compute something else than the original", changed),
        ("of those pass the original's 32 golden pairs, and only a hash tells", unseen),
    ]);
    assert!(other.is_empty(), "seed {seed}: {other:?} compute something else than tract");
    assert!(loaded > 0 && loaded < mutants, "no mutant was loaded, or none was noticed");
}
