//! The bench of networks measures what it says, for people and for scripts. No figure is judged here.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

#[path = "../../shared/nav-model/tests/support"]
mod support {
    pub(crate) mod models;
    pub(crate) mod onnx;
}

use nav_model::alloc::CheckedAllocator;
use nav_model::load::load_network;
use runtime::bench::{self, BenchError, BenchOptions, Engine, NamedNetwork};
use support::models;

#[global_allocator]
static ALLOCATOR: CheckedAllocator = CheckedAllocator;

fn named((name, bytes, contract): models::Model) -> NamedNetwork {
    NamedNetwork::new(name, load_network(&bytes, &contract).unwrap())
}

#[test]
fn engines_are_measured_beside_each_other() {
    let options = BenchOptions { hot_runs: 50, cold_runs: 2 };
    let mut networks = [named(models::actor()), named(models::scorer())];
    let report = bench::networks(&mut networks, &options).unwrap();
    assert_eq!(report.networks.len(), 2);
    for network in &report.networks {
        let [executor, tract, ..] = &network.engines[..] else { panic!("{network:?}") };
        assert_eq!((executor.engine, tract.engine), (Engine::Executor, Engine::Tract));
        assert_eq!(executor.allocations_per_run.map(f64::to_bits), Some(0.0_f64.to_bits()));
        assert!(tract.allocations_per_run.unwrap() >= 1.0, "tract allocates in every run");
        assert!(executor.rehearsed.is_some() && tract.rehearsed.is_none());
        for figures in [executor.hot, executor.cold, tract.hot, tract.cold] {
            assert!(figures.p50_ns > 0 && figures.p50_ns <= figures.p99_ns);
            assert!(figures.p99_ns <= figures.p999_ns && figures.p999_ns <= figures.max_ns);
        }
        assert_eq!(network.engines.len() == 2, network.missing.is_some(), "a missing engine is explained");
    }

    let text = report.to_string();
    assert!(text.contains("actor: [1, 82] -> [1, 2], 7 steps, "), "{text}");
    let json: serde_json::Value = serde_json::to_value(&report).unwrap();
    assert_eq!(json["networks"][1]["engines"][0]["engine"], "executor");
}

#[test]
fn no_runs_are_refused() {
    for options in [BenchOptions { hot_runs: 0, cold_runs: 1 }, BenchOptions { hot_runs: 1, cold_runs: 0 }] {
        assert!(matches!(bench::networks(&mut [], &options), Err(BenchError::NoRuns)));
    }
}
