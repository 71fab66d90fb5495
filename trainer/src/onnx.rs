//! Networks as ONNX files, written without help and then checked by three engines.
//!
//! | file | holds |
//! |---|---|
//! | `schema` | the few messages of `onnx.proto` that a perceptron needs |
//! | `write` | [`write_mlp`]: a trained network to bytes |
//! | `verify` | [`verify`]: the robot's executor, tract and ONNX Runtime against the trainer's own answers |
//! | `onnx_runtime` | [`OnnxRuntime`]: the library behind the third engine |

mod schema;
mod write;
mod verify;
mod onnx_runtime;
#[cfg(test)]
mod tests;

pub use onnx_runtime::OnnxRuntime;
pub use verify::{Case, TOLERANCE, Verified, VerifyError, verify};
pub use write::{Normalisation, WriteError, write_mlp};
