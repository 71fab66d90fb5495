//! tract's own execution of the graph: the reference for the executor, never used in the loop.

use super::{LoadError, NetworkContract};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use tract_onnx::prelude::{IntoRunnable, Tensor, TractResult, TypedModel, TypedSimplePlan, tvec};

/// A runnable tract plan of a loaded model, optimised as tract would run it.
#[derive(Clone, Debug)]
pub struct TractOracle {
    plan: Arc<TypedSimplePlan>,
    input_shape: [usize; 2],
    output_len: usize,
}

impl TractOracle {
    pub(super) fn new(typed: TypedModel, contract: &NetworkContract) -> Result<Self, LoadError> {
        let plan = guarded(|| typed.into_optimized()?.into_runnable())?;
        let input_shape = [contract.input.rows, contract.input.cols];
        Ok(Self { plan, input_shape, output_len: contract.output.elements() })
    }

    /// Runs tract on one row-major input. Allocates.
    ///
    /// # Errors
    /// When the length is wrong or tract fails.
    pub fn run(&self, input: &[f32]) -> Result<Vec<f32>, LoadError> {
        let output = guarded(|| {
            let input = Tensor::from_shape(&self.input_shape, input)?;
            let outputs = self.plan.run(tvec![input.into()])?;
            Ok(outputs[0].try_as_plain_ram()?.as_slice::<f32>()?.to_vec())
        })?;
        if output.len() != self.output_len {
            let problem = format!("tract gave {} outputs, expected {}", output.len(), self.output_len);
            return Err(LoadError::Tract { problem });
        }
        Ok(output)
    }
}

/// Calls into tract with its errors and panics turned into ours.
pub(super) fn guarded<T>(work: impl FnOnce() -> TractResult<T>) -> Result<T, LoadError> {
    // What was being built is dropped on a panic, so that no broken state is seen.
    match catch_unwind(AssertUnwindSafe(work)) {
        Ok(Ok(value)) => Ok(value),
        Ok(Err(error)) => Err(LoadError::Tract { problem: format!("{error:#}") }),
        Err(panic) => {
            let problem = panic
                .downcast_ref::<String>()
                .map(String::as_str)
                .or_else(|| panic.downcast_ref::<&str>().copied())
                .unwrap_or("no message");
            Err(LoadError::Panicked { problem: problem.to_owned() })
        }
    }
}
