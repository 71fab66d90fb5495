//! What a bench found, for people and for scripts.

use super::Engine;
use super::caches::Caches;
use crate::latency::Percentiles;
use nav_core::network::CpuLevel;
use nav_host::cpu::Cpu;
use serde::Serialize;
use std::fmt;

/// Figures of all networks of one run.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NetworkReport {
    /// Where it was measured.
    pub machine: Machine,
    /// Hot runs an engine.
    pub hot_runs: usize,
    /// Cold runs an engine.
    pub cold_runs: usize,
    /// One entry a network.
    pub networks: Vec<NetworkFigures>,
}

/// The machine of a measurement.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Machine {
    /// The processor's name, as the system tells it.
    pub processor: String,
    /// Logical cores this process may use.
    pub cores: usize,
    /// Instructions that the executor used.
    pub level: String,
    /// Size of the last cache, bytes.
    pub last_cache_bytes: usize,
}

/// Figures of one network.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NetworkFigures {
    /// As the caller named it.
    pub name: String,
    /// Rows and columns.
    pub input: [usize; 2],
    /// Rows and columns.
    pub output: [usize; 2],
    /// Steps of the executor.
    pub steps: usize,
    /// Packed weights, bytes.
    pub weights_bytes: usize,
    /// Largest relative difference between executor and tract.
    pub parity: f32,
    /// One entry an engine, the executor first.
    pub engines: Vec<EngineFigures>,
    /// How to get ONNX Runtime's figures, when they are missing.
    pub missing: Option<String>,
}

/// Figures of one engine on one network.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EngineFigures {
    /// Which engine.
    pub engine: Engine,
    /// Run after run.
    pub hot: Percentiles,
    /// With emptied caches.
    pub cold: Percentiles,
    /// With emptied caches and a dummy run shortly before; only the executor.
    pub rehearsed: Option<Percentiles>,
    /// Heap allocations through Rust; `None` when the program does not count. C code's own are never seen.
    pub allocations_per_run: Option<f64>,
}

impl Machine {
    pub(super) fn of_this_process(caches: &Caches) -> Self {
        Self {
            processor: Cpu::of_this_machine().name,
            cores: std::thread::available_parallelism().map_or(1, usize::from),
            level: CpuLevel::detect().to_string(),
            last_cache_bytes: caches.last_bytes(),
        }
    }
}

impl fmt::Display for NetworkReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Machine { processor, cores, level, last_cache_bytes } = &self.machine;
        let (hot, cold, cache) = (self.hot_runs, self.cold_runs, last_cache_bytes >> 20);
        writeln!(
            f,
            "{processor}, {cores} cores, {level}, last cache {cache} MiB; {hot} hot and {cold} cold runs"
        )?;
        for network in &self.networks {
            write!(f, "\n{network}")?;
        }
        Ok(())
    }
}

impl fmt::Display for NetworkFigures {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, input, output, steps, weights_bytes, parity, .. } = self;
        let kib = weights_bytes.div_ceil(1024);
        writeln!(
            f,
            "{name}: {input:?} -> {output:?}, {steps} steps, {kib} KiB of weights, parity {parity:.1e}"
        )?;
        let head = ["median", "p99", "p99.9", "max"].map(|name| format!("{name:>9}")).concat();
        writeln!(f, "  {:<13}{:<10}{head}   us      allocations a run", "engine", "caches")?;
        for engine in &self.engines {
            let allocations = match engine.allocations_per_run {
                _ if engine.engine == Engine::OnnxRuntime => "not seen (C++)".to_owned(),
                Some(count) => format!("{count:.0}"),
                None => "not counted".to_owned(),
            };
            write_row(f, engine.engine, "hot", &engine.hot, &allocations)?;
            write_row(f, engine.engine, "cold", &engine.cold, "")?;
            if let Some(rehearsed) = &engine.rehearsed {
                write_row(f, engine.engine, "rehearsed", rehearsed, "")?;
            }
        }
        if let [executor, others @ ..] = &self.engines[..] {
            let ratios = others.iter().map(|other| {
                let ratio = |a: u64, b: u64| a as f64 / b.max(1) as f64;
                let hot = ratio(other.hot.p50_ns, executor.hot.p50_ns);
                let cold = ratio(other.cold.p50_ns, executor.cold.p50_ns);
                format!("{} takes {hot:.1} times as long hot, {cold:.1} times cold", other.engine)
            });
            writeln!(f, "  {}", ratios.collect::<Vec<_>>().join("; "))?;
        }
        match &self.missing {
            Some(missing) => writeln!(f, "  {:<13}{missing}", Engine::OnnxRuntime),
            None => Ok(()),
        }
    }
}

fn write_row(
    f: &mut fmt::Formatter<'_>,
    engine: Engine,
    state: &str,
    figures: &Percentiles,
    allocations: &str,
) -> fmt::Result {
    let Percentiles { p50_ns, p99_ns, p999_ns, max_ns, .. } = *figures;
    let times = [p50_ns, p99_ns, p999_ns, max_ns].map(|ns| format!("{:>9.2}", ns as f64 / 1000.0)).concat();
    let row = format!("  {engine:<13}{state:<10}{times}           {allocations}");
    writeln!(f, "{}", row.trim_end())
}
