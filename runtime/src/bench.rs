//! Latency of loaded networks: our executor, tract, and ONNX Runtime beside each other in one run.
//!
//! Each engine computes the same input of the same model on one thread. Three states are measured:
//!
//! - **hot**: run after run, weights and code in the caches;
//! - **cold**: before each run the caches are emptied by writing a buffer twice as large as the last one, as between two
//!   ticks of a 20 Hz loop that shares its core;
//! - **rehearsed** (executor only): cold, then one dummy run, then [`REHEARSAL`] asleep, then the measured run: what a
//!   dummy run before each deadline would give. The loop makes none.
//!
//! A measured time holds about 20 ns of clock reading. ONNX Runtime is not part of the robot's program: its column needs the
//! cargo feature `onnxruntime`, and says so when it is missing.
//!
//! ```no_run
//! use runtime::bench::{self, BenchOptions, NamedNetwork};
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let (bytes, contract) = (Vec::<u8>::new(), nav_model::model::actor_contract());
//! let loaded = nav_model::load::load_network(&bytes, &contract)?;
//! let report = bench::networks(&mut [NamedNetwork::new("td3", loaded)], &BenchOptions::default())?;
//! println!("{report}");
//! # Ok(())
//! # }
//! ```

mod caches;
mod samples;
mod engines;
#[cfg(feature = "onnxruntime")]
mod onnxruntime;
mod report;

pub use engines::Engine;
pub use report::{EngineFigures, Machine, NetworkFigures, NetworkReport};

use caches::Caches;
use nav_model::load::{LoadError, LoadedNetwork};
use std::time::Duration;

/// Time between the dummy run and the measured run of the rehearsed state.
pub const REHEARSAL: Duration = Duration::from_micros(300);

/// A loaded network and what the report calls it.
#[derive(Debug)]
pub struct NamedNetwork {
    name: String,
    network: LoadedNetwork,
}

impl NamedNetwork {
    /// Names a network.
    pub fn new(name: impl Into<String>, network: LoadedNetwork) -> Self {
        Self { name: name.into(), network }
    }
}

/// How much is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BenchOptions {
    /// Hot runs an engine.
    pub hot_runs: usize,
    /// Cold runs an engine and state; each takes some milliseconds to empty the caches.
    pub cold_runs: usize,
}

impl Default for BenchOptions {
    /// 10,000 hot and 100 cold runs: some seconds for two networks.
    fn default() -> Self {
        Self { hot_runs: 10_000, cold_runs: 100 }
    }
}

/// Why a network was not measured.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// tract failed on a network that it ran while loading.
    #[error("tract failed while being measured: {0}")]
    Tract(#[from] LoadError),
    /// ONNX Runtime failed.
    #[error("ONNX Runtime failed: {problem}; check ORT_DYLIB_PATH")]
    OnnxRuntime {
        /// Its own words.
        problem: String,
    },
    /// There is nothing to measure with.
    #[error("a bench needs at least one hot and one cold run")]
    NoRuns,
}

/// Measures each network on each engine that this build has.
///
/// # Errors
/// When an engine fails, or the options ask for no runs.
pub fn networks(networks: &mut [NamedNetwork], options: &BenchOptions) -> Result<NetworkReport, BenchError> {
    if options.hot_runs == 0 || options.cold_runs == 0 {
        return Err(BenchError::NoRuns);
    }
    let mut caches = Caches::new();
    let figures = networks
        .iter_mut()
        .map(|named| engines::measure(&named.name, &mut named.network, options, &mut caches))
        .collect::<Result<Vec<_>, _>>()?;
    Ok(NetworkReport {
        machine: Machine::of_this_process(&caches),
        hot_runs: options.hot_runs,
        cold_runs: options.cold_runs,
        networks: figures,
    })
}
