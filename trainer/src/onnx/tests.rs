//! Networks out through ONNX and back in through three engines.

use nav_model::load::{NetworkContract, Port};
use rand::{RngExt, SeedableRng};

use super::*;
use crate::nn::{Activation, Buffer, Mlp, MlpShape, Rng};

const MEAN: [f32; 7] = [0.5, -1.0, 0.0, 2.0, 0.1, 0.0, -3.0];
const INVERSE_DEVIATION: [f32; 7] = [1.0, 2.0, 0.5, 20.0, 1.0, 3.0, 0.1];

fn contract(rows: usize, outputs: usize) -> NetworkContract {
    NetworkContract::new(Port::new("observation", rows, 7), Port::new("action", rows, outputs))
}

fn network(output: Activation, outputs: usize, layer_norm: bool) -> Mlp {
    let mut rng = Rng::seed_from_u64(1);
    let shape = MlpShape { layer_norm, ..MlpShape::new(7, &[24, 16], outputs, output) };
    let mut mlp = Mlp::new(shape, &mut rng);
    mlp.parameters_mut().iter_mut().for_each(|weight| *weight *= 1.5);
    mlp
}

fn normalisation() -> Normalisation<'static> {
    Normalisation { mean: &MEAN, inverse_deviation: &INVERSE_DEVIATION }
}

/// Inputs of several sizes and the learner's own answers.
fn cases(mlp: &mut Mlp, rows: usize, normalised: bool) -> Vec<Case> {
    let mut rng = Rng::seed_from_u64(2);
    let case = |index: usize| {
        let size = [0.0, 0.3, 1.0, 4.0][index % 4];
        let input: Vec<f32> = (0..7 * rows).map(|_| size * (2.0 * rng.random::<f32>() - 1.0)).collect();
        let normal = |(place, x): (usize, &f32)| (x - MEAN[place % 7]) * INVERSE_DEVIATION[place % 7];
        let seen: Vec<f32> =
            if normalised { input.iter().enumerate().map(normal).collect() } else { input.clone() };
        let answer = mlp.forward(&Buffer::of(&seen, 7).view(rows)).to_vec();
        Case { input, answer }
    };
    (0..40).map(case).collect()
}

#[test]
fn three_engines_give_the_learners_answers() {
    for (output, outputs, layer_norm, rows, normalised) in [
        (Activation::Tanh, 2, false, 1, true),
        (Activation::Identity, 1, false, 18, false),
        (Activation::Identity, 1, true, 18, true),
    ] {
        let mut mlp = network(output, outputs, layer_norm);
        let contract = contract(rows, outputs);
        let normalisation = normalised.then(normalisation);
        let bytes = write_mlp(&mlp, &contract, normalisation, &[("seed", "1")]).expect("it fits");
        let verified = verify(&bytes, &contract, &cases(&mut mlp, rows, normalised)).expect("they agree");
        for difference in [verified.executor, verified.tract, verified.onnx_runtime] {
            assert!(difference < TOLERANCE, "{verified:?}");
        }
    }
}

#[test]
fn the_same_network_gives_the_same_bytes() {
    let write =
        || write_mlp(&network(Activation::Tanh, 2, false), &contract(1, 2), None, &[]).expect("it fits");
    assert_eq!(write(), write());
}

#[test]
fn another_answer_is_refused_and_so_is_nan() {
    let mut mlp = network(Activation::Tanh, 2, false);
    let bytes = write_mlp(&mlp, &contract(1, 2), None, &[]).expect("it fits");
    let mut cases = cases(&mut mlp, 1, false);
    cases[5].answer[1] += 3e-5;
    let error = verify(&bytes, &contract(1, 2), &cases).expect_err("a wrong answer");
    assert!(matches!(error, VerifyError::Difference { index: 5, .. }), "{error}");
    cases[3].answer[0] = f32::NAN;
    let error = verify(&bytes, &contract(1, 2), &cases).expect_err("not a number");
    assert!(matches!(error, VerifyError::Difference { index: 3, .. }), "{error}");
    assert!(matches!(verify(&bytes, &contract(1, 2), &[]), Err(VerifyError::NoCases)));
    cases[0].input.pop();
    assert!(matches!(verify(&bytes, &contract(1, 2), &cases), Err(VerifyError::CaseSize { index: 0, .. })));
}

#[test]
fn what_does_not_fit_is_not_written() {
    let mut mlp = network(Activation::Tanh, 2, false);
    assert!(matches!(write_mlp(&mlp, &contract(1, 3), None, &[]), Err(WriteError::Shape { .. })));
    let short = Normalisation { mean: &MEAN[1..], ..normalisation() };
    assert!(matches!(
        write_mlp(&mlp, &contract(1, 2), Some(short), &[]),
        Err(WriteError::Normalisation { inputs: 7 })
    ));
    let infinite = [f32::INFINITY; 7];
    let infinite = Normalisation { inverse_deviation: &infinite, ..normalisation() };
    assert!(matches!(
        write_mlp(&mlp, &contract(1, 2), Some(infinite), &[]),
        Err(WriteError::Normalisation { inputs: 7 })
    ));
    mlp.parameters_mut()[3] = f32::NAN;
    assert!(matches!(write_mlp(&mlp, &contract(1, 2), None, &[]), Err(WriteError::NotFinite)));
}
