//! The check that every export passes: three engines must give what the trainer's own network gave.

use nav_model::load::{LoadError, NetworkContract, load_network};

use super::OnnxRuntime;

/// The largest difference to the trainer's answer, relative to the larger of one and that answer.
pub const TOLERANCE: f32 = 1e-5;

/// An input and what the trainer's own network answers.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// Row-major, as the contract's input.
    pub input: Vec<f32>,
    /// Row-major, as the contract's output.
    pub answer: Vec<f32>,
}

/// The largest difference of each engine over all cases.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Verified {
    /// The executor that drives the robot.
    pub executor: f32,
    /// tract.
    pub tract: f32,
    /// ONNX Runtime.
    pub onnx_runtime: f32,
}

/// Why an export was refused.
#[derive(Debug, thiserror::Error)]
pub enum VerifyError {
    /// Nothing to compare.
    #[error("there is no case to verify the export with: give some observations")]
    NoCases,
    /// A case of another size than the contract.
    #[error("case {index} has {inputs} inputs and {answers} answers, which is not the contract's size")]
    CaseSize {
        /// Which case.
        index: usize,
        /// Length of its input.
        inputs: usize,
        /// Length of its answer.
        answers: usize,
    },
    /// The runtime's loader refused the model.
    #[error("the runtime refuses the export: {0}")]
    Load(#[from] LoadError),
    /// The library of ONNX Runtime is missing.
    #[error(
        "ONNX Runtime cannot be loaded ({problem}): run `cargo xtask onnxruntime` once, or set ORT_DYLIB_PATH"
    )]
    NoOnnxRuntime {
        /// What is wrong.
        problem: String,
    },
    /// ONNX Runtime refused the model.
    #[error("ONNX Runtime refuses the export: {problem}")]
    OnnxRuntime {
        /// What it said.
        problem: String,
    },
    /// An engine answers something else.
    #[error(
        "the export is refused: {engine} is off by {difference:e} in case {index}, where {TOLERANCE:e} is allowed; \
         train on, or export another checkpoint"
    )]
    Difference {
        /// Which engine.
        engine: &'static str,
        /// Which case.
        index: usize,
        /// By how much; NaN when either answer is not a number.
        difference: f32,
    },
}

/// Runs the model of `bytes` in all three engines on all cases.
///
/// # Errors
/// The first engine that refuses the model, or differs by more than [`TOLERANCE`], or gives NaN.
pub fn verify(bytes: &[u8], contract: &NetworkContract, cases: &[Case]) -> Result<Verified, VerifyError> {
    if cases.is_empty() {
        return Err(VerifyError::NoCases);
    }
    let (inputs, answers) = (contract.input.elements(), contract.output.elements());
    let wrong = |case: &Case| (case.input.len(), case.answer.len()) != (inputs, answers);
    if let Some((index, case)) = cases.iter().enumerate().find(|(_, case)| wrong(case)) {
        return Err(VerifyError::CaseSize { index, inputs: case.input.len(), answers: case.answer.len() });
    }
    let mut loaded = load_network(bytes, contract)?;
    let mut onnx_runtime = OnnxRuntime::load(bytes, contract)?;
    let mut verified = Verified::default();
    let mut answer = vec![0.0; answers];
    for (index, case) in cases.iter().enumerate() {
        loaded.network_mut().run(&case.input, &mut answer);
        compare("the robot's executor", index, &answer, case, &mut verified.executor)?;
        compare("tract", index, &loaded.oracle().run(&case.input)?, case, &mut verified.tract)?;
        let answer = onnx_runtime.run(&case.input)?;
        compare("ONNX Runtime", index, &answer, case, &mut verified.onnx_runtime)?;
    }
    Ok(verified)
}

fn compare(
    engine: &'static str,
    index: usize,
    found: &[f32],
    case: &Case,
    worst: &mut f32,
) -> Result<(), VerifyError> {
    if found.len() != case.answer.len() {
        return Err(VerifyError::Difference { engine, index, difference: f32::NAN });
    }
    for (found, expected) in found.iter().zip(&case.answer) {
        let difference = (found - expected).abs() / expected.abs().max(1.0);
        if difference.is_nan() || difference > TOLERANCE {
            return Err(VerifyError::Difference { engine, index, difference });
        }
        *worst = worst.max(difference);
    }
    Ok(())
}
