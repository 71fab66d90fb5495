//! ONNX Runtime as a third engine. Only in builds with the feature `onnxruntime`, never on the robot.

use super::BenchError;
use nav_model::load::{NetworkContract, PARITY_TOLERANCE};
use ort::environment::Environment;
use ort::session::{IoBinding, Session};
use ort::value::Tensor;
use std::path::Path;
use std::sync::OnceLock;

/// How far ONNX Runtime may be from tract before its times mean nothing.
const TOLERANCE: f32 = 10.0 * PARITY_TOLERANCE;

/// Whether the library that `ORT_DYLIB_PATH` names is there; else how to get it.
pub(super) fn library() -> Result<(), String> {
    let how = "set ORT_DYLIB_PATH to libonnxruntime.so (`cargo xtask onnxruntime` unpacks it to .tools/onnxruntime)";
    match std::env::var_os("ORT_DYLIB_PATH") {
        Some(path) if Path::new(&path).is_file() => Ok(()),
        Some(path) => Err(format!("{} is not a file; {how}", Path::new(&path).display())),
        None => Err(how.to_owned()),
    }
}

/// A session whose input and output are bound once, which is its fastest form.
pub(super) struct BoundSession {
    session: Session,
    binding: IoBinding,
    output: String,
}

impl BoundSession {
    pub(super) fn new(onnx: &[u8], contract: &NetworkContract, input: &[f32]) -> Result<Self, BenchError> {
        let shape = |port: &nav_model::load::Port| [port.rows, port.cols];
        let session = Session::builder(environment()?)
            .map_err(failed)?
            .with_intra_threads(1)
            .map_err(failed)?
            .commit_from_memory(onnx)
            .map_err(failed)?;
        let mut binding = session.create_binding().map_err(failed)?;
        let input = Tensor::from_array((shape(&contract.input), input.to_vec())).map_err(failed)?;
        binding.bind_input(&contract.input.name, &input).map_err(failed)?;
        // Only memory of its own allocator can be bound as output.
        let output = Tensor::<f32>::new(session.allocator(), shape(&contract.output)).map_err(failed)?;
        binding.bind_output(&contract.output.name, output).map_err(failed)?;
        Ok(Self { session, binding, output: contract.output.name.clone() })
    }

    pub(super) fn run(&mut self) -> Result<(), BenchError> {
        self.session.run_binding(&self.binding).map(drop).map_err(failed)
    }

    /// Refuses a session that does not compute the network.
    pub(super) fn check(&mut self, expected: &[f32]) -> Result<(), BenchError> {
        let outputs = self.session.run_binding(&self.binding).map_err(failed)?;
        let (_, found) = outputs[self.output.as_str()].try_extract_tensor::<f32>().map_err(failed)?;
        let agrees = found.len() == expected.len()
            && found.iter().zip(expected).all(|(a, b)| (a - b).abs() <= TOLERANCE * b.abs().max(1.0));
        if agrees {
            Ok(())
        } else {
            Err(BenchError::OnnxRuntime { problem: "its result differs from tract's".to_owned() })
        }
    }
}

/// The environment of this process; ONNX Runtime allows one.
fn environment() -> Result<&'static Environment, BenchError> {
    static ENVIRONMENT: OnceLock<Environment> = OnceLock::new();
    if let Some(environment) = ENVIRONMENT.get() {
        return Ok(environment);
    }
    let environment = ort::init().build().map_err(failed)?;
    Ok(ENVIRONMENT.get_or_init(|| environment))
}

fn failed(error: impl std::fmt::Display) -> BenchError {
    BenchError::OnnxRuntime { problem: error.to_string() }
}
