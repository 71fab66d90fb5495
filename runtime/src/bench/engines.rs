//! The engines, measured one after the other on the same input.

use super::caches::Caches;
use super::report::{EngineFigures, NetworkFigures};
use super::samples::time;
use super::{BenchError, BenchOptions, REHEARSAL};
use crate::latency::Percentiles;
use nav_model::alloc;
use nav_model::load::LoadedNetwork;
use serde::Serialize;
use std::fmt;
use std::hint::black_box;

/// Runs before the hot measurement and between the counted ones.
const WARM_UP_RUNS: usize = 200;
/// Runs over which allocations are counted.
const COUNTED_RUNS: u32 = 100;

/// What runs a network.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Engine {
    /// This project's executor: what drives the robot.
    Executor,
    /// tract's optimised plan.
    Tract,
    /// ONNX Runtime with bound input and output, one thread.
    OnnxRuntime,
}

impl fmt::Display for Engine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Executor => "executor",
            Self::Tract => "tract",
            Self::OnnxRuntime => "ONNX Runtime",
        })
    }
}

/// Measures `network` on every engine.
pub(super) fn measure(
    name: &str,
    network: &mut LoadedNetwork,
    options: &BenchOptions,
    caches: &mut Caches,
) -> Result<NetworkFigures, BenchError> {
    let contract = network.contract().clone();
    let input = test_input(contract.input.elements());
    let mut output = vec![0.0; contract.output.elements()];

    let executor = network.network_mut();
    let mut run = || {
        executor.run(black_box(&input), black_box(&mut output));
        Ok(())
    };
    let mut figures = engine(Engine::Executor, options, caches, &mut run)?;
    let executor = network.network_mut();
    figures.rehearsed = Some(rehearsed(options, caches, || {
        executor.run(black_box(&input), black_box(&mut output));
    })?);
    let (steps, weights_bytes) = (network.network().step_count(), network.network().constants_bytes());
    let mut engines = vec![figures];

    let oracle = network.oracle();
    let mut run = || {
        black_box(oracle.run(black_box(&input))?);
        Ok(())
    };
    engines.push(engine(Engine::Tract, options, caches, &mut run)?);
    let missing = onnxruntime(network, &input, options, caches, &mut engines)?;
    Ok(NetworkFigures {
        name: name.to_owned(),
        input: [contract.input.rows, contract.input.cols],
        output: [contract.output.rows, contract.output.cols],
        steps,
        weights_bytes,
        parity: network.parity(),
        engines,
        missing,
    })
}

/// Hot and cold times of one engine, and its allocations.
fn engine(
    engine: Engine,
    options: &BenchOptions,
    caches: &mut Caches,
    run: &mut dyn FnMut() -> Result<(), BenchError>,
) -> Result<EngineFigures, BenchError> {
    for _ in 0..WARM_UP_RUNS {
        run()?;
    }
    let hot = time(options.hot_runs, || Ok(()), &mut *run)?;
    let (result, counts) = alloc::count(|| (0..COUNTED_RUNS).try_for_each(|_| run()));
    result?;
    #[expect(clippy::cast_precision_loss, reason = "some thousand allocations")]
    let allocations = counts.allocations as f64 / f64::from(COUNTED_RUNS);
    let cold = time(
        options.cold_runs,
        || {
            caches.empty();
            Ok(())
        },
        run,
    )?;
    let allocations_per_run = alloc::is_installed().then_some(allocations);
    Ok(EngineFigures { engine, hot, cold, rehearsed: None, allocations_per_run })
}

fn rehearsed(
    options: &BenchOptions,
    caches: &mut Caches,
    run: impl FnMut(),
) -> Result<Percentiles, BenchError> {
    // Shared by preparation and measurement, which never run at once.
    let run = std::cell::RefCell::new(run);
    let prepare = || {
        caches.empty();
        (run.borrow_mut())();
        std::thread::sleep(REHEARSAL);
        Ok(())
    };
    time(options.cold_runs, prepare, || {
        (run.borrow_mut())();
        Ok(())
    })
}

/// Adds ONNX Runtime's figures, or tells how to get them.
#[cfg(feature = "onnxruntime")]
fn onnxruntime(
    network: &LoadedNetwork,
    input: &[f32],
    options: &BenchOptions,
    caches: &mut Caches,
    engines: &mut Vec<EngineFigures>,
) -> Result<Option<String>, BenchError> {
    if let Err(missing) = super::onnxruntime::library() {
        return Ok(Some(missing));
    }
    let mut session = super::onnxruntime::BoundSession::new(network.onnx(), network.contract(), input)?;
    let expected = network.oracle().run(input)?;
    session.check(&expected)?;
    engines.push(engine(Engine::OnnxRuntime, options, caches, &mut || session.run())?);
    Ok(None)
}

#[cfg(not(feature = "onnxruntime"))]
fn onnxruntime(
    _network: &LoadedNetwork,
    _input: &[f32],
    _options: &BenchOptions,
    _caches: &mut Caches,
    _engines: &mut Vec<EngineFigures>,
) -> Result<Option<String>, BenchError> {
    let how = "not in this build: `cargo xtask onnxruntime`, then \
               `cargo run --release -p runtime --features onnxruntime -- bench`";
    Ok(Some(how.to_owned()))
}

/// Numbers in `[-1, 1)` that no layer turns into zeros.
#[expect(clippy::cast_precision_loss, reason = "a remainder below 256")]
fn test_input(len: usize) -> Vec<f32> {
    (0..len).map(|index| (index * 97 % 256) as f32 / 128.0 - 1.0).collect()
}
