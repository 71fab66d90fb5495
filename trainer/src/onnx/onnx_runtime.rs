//! ONNX Runtime, loaded from its shared library when first asked for.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use nav_model::load::NetworkContract;
use ort::environment::Environment;
use ort::session::Session;
use ort::value::TensorRef;

use super::VerifyError;

/// Where `cargo xtask onnxruntime` puts the library, from the top of the checkout.
const LIBRARY: &str = ".tools/onnxruntime/libonnxruntime.so";

/// A model in ONNX Runtime, on one thread.
pub struct OnnxRuntime {
    session: Session,
    contract: NetworkContract,
}

impl OnnxRuntime {
    /// Loads a model.
    ///
    /// # Errors
    /// When the library is not there, or refuses the model.
    pub fn load(bytes: &[u8], contract: &NetworkContract) -> Result<Self, VerifyError> {
        let environment = environment()?;
        let session = Session::builder(environment)
            .map_err(refused)?
            .with_intra_threads(1)
            .map_err(refused)?
            .commit_from_memory(bytes)
            .map_err(refused)?;
        Ok(Self { session, contract: contract.clone() })
    }

    /// Runs it on one row-major input.
    ///
    /// # Errors
    /// When the input has another length than the contract says, or ONNX Runtime fails.
    pub fn run(&mut self, input: &[f32]) -> Result<Vec<f32>, VerifyError> {
        let shape = [self.contract.input.rows, self.contract.input.cols];
        let input = TensorRef::from_array_view((shape, input)).map_err(refused)?;
        let outputs =
            self.session.run(ort::inputs![self.contract.input.name.as_str() => input]).map_err(refused)?;
        let name = self.contract.output.name.as_str();
        let output = outputs
            .get(name)
            .ok_or_else(|| VerifyError::OnnxRuntime { problem: format!("there is no output `{name}`") })?;
        let (_, values) = output.try_extract_tensor::<f32>().map_err(refused)?;
        Ok(values.to_vec())
    }
}

fn refused<T>(error: ort::Error<T>) -> VerifyError {
    VerifyError::OnnxRuntime { problem: error.to_string() }
}

/// The process's environment: the library is loaded at most once, and never unloaded.
fn environment() -> Result<&'static Environment, VerifyError> {
    static ENVIRONMENT: OnceLock<Result<Environment, String>> = OnceLock::new();
    let environment = ENVIRONMENT.get_or_init(|| open(&library()));
    environment.as_ref().map_err(|problem| VerifyError::NoOnnxRuntime { problem: problem.clone() })
}

fn open(library: &Path) -> Result<Environment, String> {
    if !library.exists() {
        return Err(format!("there is no {}", library.display()));
    }
    let builder = ort::init_from(library).map_err(|error| error.to_string())?;
    builder.with_telemetry(false).build().map_err(|error| error.to_string())
}

/// The library the user names, else the one of the checkout this program lies in, else that of the current
/// folder.
fn library() -> PathBuf {
    if let Some(path) = std::env::var_os("ORT_DYLIB_PATH").filter(|path| !path.is_empty()) {
        return path.into();
    }
    let program = std::env::current_exe().unwrap_or_default();
    let beside = program.ancestors().map(|folder| folder.join(LIBRARY)).find(|path| path.exists());
    beside.unwrap_or_else(|| Path::new(LIBRARY).to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_library_is_one_sentence_that_says_what_to_do() {
        let Err(problem) = open(Path::new("/nowhere/libonnxruntime.so")) else {
            panic!("there is no such file")
        };
        assert_eq!(
            VerifyError::NoOnnxRuntime { problem }.to_string(),
            "ONNX Runtime cannot be loaded (there is no /nowhere/libonnxruntime.so): run `cargo xtask onnxruntime` \
             once, or set ORT_DYLIB_PATH"
        );
    }
}
