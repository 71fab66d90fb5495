//! Networks that run without allocating.
//!
//! A network is described once by a [`NetworkSpec`] (steps over row-major matrices, with borrowed weights), packed once into
//! memory that the caller owns, and then run any number of times:
//!
//! ```
//! use nav_core::network::{Activation, CpuLevel, Layer, MlpSpec, MlpWeights, Network};
//!
//! # fn main() -> Result<(), nav_core::network::NetworkError> {
//! // An actor 3 -> 4 -> 2 with weights as PyTorch stores them: row-major [out][in].
//! let (w1, b1) = ([0.1_f32; 12], [0.0_f32; 4]);
//! let (w2, b2) = ([0.2_f32; 8], [0.5_f32; 2]);
//! let layers = [Layer { weights: &w1, bias: &b1 }, Layer { weights: &w2, bias: &b2 }];
//!
//! let mlp = MlpSpec::new(&[3, 4, 2])?.hidden(Activation::Relu).output(Activation::Tanh);
//! let spec = mlp.spec(&MlpWeights::new(&layers))?;
//!
//! let level = CpuLevel::detect();
//! let mut memory = vec![0.0; spec.memory_len(level)]; // any `AsRef<[f32]> + AsMut<[f32]>`; it is never resized
//! let mut network = Network::new(&spec, &mut memory[..], level)?;
//!
//! let mut action = [0.0; 2];
//! network.run(&[1.0, -1.0, 0.5], &mut action);
//!
//! // After a learning step: the same shapes with new numbers. Nothing is allocated.
//! network.repack(&mlp.spec(&MlpWeights::new(&layers))?)?;
//! # Ok(())
//! # }
//! ```
//!
//! - **Shapes.** A value is a matrix `[rows, cols]`, row-major. The row count is fixed when the spec is built: one for an
//!   actor, one row a candidate for a scorer ([`MlpSpec::rows`]). Every row is computed alike: a row of a batch has the same
//!   bits as the same row alone.
//! - **Memory.** `[constants, packed for the machine | values]`, one slice, 64-byte aligned inside whatever it is given.
//! - **Numbers.** Inner products differ between [`CpuLevel`]s by rounding only; on one level the same input gives the same
//!   bits. Element-wise functions are identical on all levels. NaN in, NaN out: nothing hides it from the guard.
//! - **Bounds.** At most [`MAX_STEPS`] steps and [`MAX_CONSTANTS`] constants.
//!
//! `unsafe` lives in the folder `kernels` only, behind functions that check every length.

mod functions;
mod step;
mod spec;
mod mlp;
mod kernels;
mod executor;
mod error;

pub use error::NetworkError;
pub use executor::Network;
pub use functions::Activation;
pub use kernels::CpuLevel;
pub use mlp::{Layer, MAX_LAYERS, MlpSpec, MlpWeights};
pub use spec::{NetworkSpec, Operand};
pub use step::{Combine, Reduce, Value};

/// The most steps a network may have.
pub const MAX_STEPS: usize = 64;
/// The most constants (weight matrices, bias and scale vectors) a network may have.
pub const MAX_CONSTANTS: usize = 128;
/// The longest side of any matrix, the bound under which all sizes fit their types.
pub const MAX_SIDE: usize = 1 << 16;
/// The most floats a network may need, constants and values together (256 MiB).
pub const MAX_MEMORY_FLOATS: usize = 1 << 26;
