//! Other people's programs on what the trainer writes: `onnx.checker` and the reference evaluator of ONNX on
//! an export, TensorBoard's own reader on an event file.
//!
//! They need the Python environment of `cargo xtask python`. Without it these tests pass and say so, unless
//! the variable `CI` is `true`: then they fail.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use nav_model::model::{actor_contract, scorer_contract};
use rand::{RngExt, SeedableRng};
use trainer::logs::ScalarLog;
use trainer::nn::{Activation, Buffer, Mlp, MlpShape, Rng};
use trainer::onnx::{Normalisation, write_mlp};

/// The interpreter; nothing when it is missing and need not be there.
fn python() -> Option<PathBuf> {
    let checkout = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the package lies in the checkout");
    let python = checkout.join(".tools/python/bin/python3");
    // The mark of a finished installation.
    if checkout.join(".tools/python/complete").exists() {
        return Some(python);
    }
    let required = std::env::var("CI").is_ok_and(|value| value == "true");
    assert!(!required, "there is no {}: run `cargo xtask python` once", python.display());
    eprintln!("not checked: there is no {}; `cargo xtask python` makes it", python.display());
    None
}

/// Runs a script on some arguments and returns what it prints.
fn run(python: &Path, script: &str, arguments: &[&Path]) -> String {
    let output = Command::new(python).args(["-c", script]).args(arguments).output().expect("python starts");
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{error}");
    String::from_utf8_lossy(&output.stdout).trim().to_owned()
}

fn uniform(count: usize, rng: &mut Rng) -> Vec<f32> {
    (0..count).map(|_| 2.0 * rng.random::<f32>() - 1.0).collect()
}

/// Checks a model and prints the largest difference of its answer to ours, and its properties.
const CHECK_MODEL: &str = "
import sys, numpy, onnx
from onnx.reference import ReferenceEvaluator
model = onnx.load(sys.argv[1])
onnx.checker.check_model(model, full_check=True)
port = lambda value: [d.dim_value for d in value.type.tensor_type.shape.dim]
inputs = numpy.fromfile(sys.argv[2], '<f4').reshape(port(model.graph.input[0]))
ours = numpy.fromfile(sys.argv[3], '<f4').reshape(port(model.graph.output[0]))
[theirs] = ReferenceEvaluator(model).run(None, {model.graph.input[0].name: inputs})
assert theirs.shape == ours.shape, (theirs.shape, ours.shape)
print(abs(theirs - ours).max() <= 1e-5, {p.key: p.value for p in model.metadata_props})
";

#[test]
fn onnx_accepts_actor_and_scorer_and_evaluates_them_alike() {
    let Some(python) = python() else { return };
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut rng = Rng::seed_from_u64(1);
    for (contract, output, normalised) in
        [(actor_contract(), Activation::Tanh, true), (scorer_contract(), Activation::Identity, false)]
    {
        let inputs = contract.input.cols;
        let mut mlp = Mlp::new(MlpShape::new(inputs, &[64, 64], contract.output.cols, output), &mut rng);
        let (mean, inverse_deviation) = (uniform(inputs, &mut rng), vec![1.25; inputs]);
        let normalisation =
            normalised.then_some(Normalisation { mean: &mean, inverse_deviation: &inverse_deviation });
        let x = uniform(contract.input.elements(), &mut rng);
        let normal = |(place, x): (usize, &f32)| (x - mean[place % inputs]) * 1.25;
        let seen: Vec<f32> = if normalised { x.iter().enumerate().map(normal).collect() } else { x.clone() };
        let y = mlp.forward(&Buffer::of(&seen, inputs).view(seen.len() / inputs)).to_vec();

        let bytes = write_mlp(&mlp, &contract, normalisation, &[("seed", "7")]).expect("it fits");
        let files = ["model.onnx", "inputs", "answers"].map(|name| folder.path().join(name));
        let floats = |values: &[f32]| values.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<_>>();
        for (path, bytes) in files.iter().zip([bytes, floats(&x), floats(&y)]) {
            fs::write(path, bytes).expect("the disk has room");
        }
        let said = run(&python, CHECK_MODEL, &[&files[0], &files[1], &files[2]]);
        assert_eq!(said, "True {'seed': '7'}");
    }
}

/// Prints the points of one scalar.
const READ_EVENTS: &str = "
import sys
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator
events = EventAccumulator(sys.argv[1])
events.Reload()
print([(e.step, e.value) for e in events.Scalars('td3/q_mean')])
";

#[test]
fn tensorboard_shows_a_resumed_run_as_one() {
    let Some(python) = python() else { return };
    let folder = tempfile::tempdir().expect("a temporary folder");
    // Killed before its first checkpoint, then after one.
    for offset in [0.5, 0.0] {
        let mut log = ScalarLog::open(folder.path(), 0).expect("a new log");
        for step in [10, 20, 30] {
            log.write(step, &[("td3/q_mean", step as f64 + offset)]).expect("the disk has room");
        }
        drop(log);
        // TensorBoard orders the files of a run by name, which starts with the second they were made in.
        std::thread::sleep(std::time::Duration::from_millis(1100));
    }
    let mut log = ScalarLog::open(folder.path(), 20).expect("the same log");
    log.write(30, &[("td3/q_mean", 0.5)]).expect("the disk has room");
    drop(log);
    assert_eq!(run(&python, READ_EVENTS, &[folder.path()]), "[(10, 10.0), (20, 20.0), (30, 0.5)]");
}
