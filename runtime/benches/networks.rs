//! Latency of typical policies on this machine, without a trained model: `cargo bench -p runtime --bench networks`.
//!
//! With `--features onnxruntime` and `ORT_DYLIB_PATH`, ONNX Runtime is a third engine. See [`runtime::bench`] for what is
//! measured; `runtime bench --model DIR` measures a trained model the same way.

#[path = "../../shared/nav-model/tests/support"]
mod support {
    pub(crate) mod models;
    pub(crate) mod onnx;
}

use nav_model::alloc::CheckedAllocator;
use nav_model::load::load_network;
use runtime::bench::{self, BenchOptions, NamedNetwork};
use support::models;

#[global_allocator]
static ALLOCATOR: CheckedAllocator = CheckedAllocator;

fn main() -> anyhow::Result<()> {
    let policies = [models::actor(), models::scorer(), models::layer_norm(), models::dueling()];
    let mut networks = policies
        .into_iter()
        .map(|(name, bytes, contract)| Ok(NamedNetwork::new(name, load_network(&bytes, &contract)?)))
        .collect::<anyhow::Result<Vec<_>>>()?;
    print!("{}", bench::networks(&mut networks, &BenchOptions::default())?);
    Ok(())
}
