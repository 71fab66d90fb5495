//! Small dense networks, trained without automatic differentiation.
//!
//! libtorch does the matrix products; everything else (bias, normalisation, activation, their
//! derivatives, Adam, Polyak averaging) is a loop over plain `f32` slices. All parameters of a network
//! live in one flat buffer, and so do its gradients and moments, so that an optimiser step, a target
//! update and a checkpoint are each one pass over one slice.
//!
//! | file | holds |
//! |---|---|
//! | [`buffer`] | a matrix that is both a tensor and a slice |
//! | [`mlp`] | the network: shape, parameters, forward |
//! | `tape` | what a forward pass keeps for the backward pass |
//! | `backward` | its hand-written derivatives |
//! | [`layer_norm`] | layer normalisation of a row and its derivative |
//! | [`flat`] | Polyak averaging, means and gradient norms over flat slices |
//! | [`adam`] | the optimiser, and a step of a network with it |
//! | `kernels` | the element-wise passes, compiled twice |
//!
//! Every random number comes from a generator the caller passes in; torch's own, which is global to the
//! process, is never used.

pub mod buffer;
pub mod mlp;
mod tape;
mod backward;
pub mod layer_norm;
pub mod flat;
pub mod adam;
mod kernels;
#[cfg(test)]
mod tests;

pub use adam::{Adam, AdamState, descend};
pub use buffer::{Buffer, View};
pub use mlp::{Activation, Dense, Mlp, MlpShape};
pub use nav_env::seeds::Rng;

/// No return of any reward here comes near this: a value beyond it has exploded.
pub const EXPLODED: f32 = 1e5;

/// Prepares the process for training; call once, before the first tensor.
///
/// One torch thread a process: with more, the learner slows down by an order of magnitude as soon as
/// anything else runs on the machine, and results depend on the thread count. Large freed blocks are kept
/// instead of being given back to the kernel on every update.
pub fn init_torch() {
    tch::set_num_threads(1);
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    // SAFETY: mallopt only changes a parameter of the allocator, and both arguments are valid for it.
    unsafe {
        libc::mallopt(libc::M_MMAP_THRESHOLD, 1 << 30);
    }
}
