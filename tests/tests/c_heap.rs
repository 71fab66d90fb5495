//! The runtime's own counter sees what Rust allocates. This one sees libc's heap functions, whoever calls them:
//! while the robot drives, nobody in the process does.

mod support;

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;
use support::programs::{Running, program, wait_until};
use support::{Stage, read_json};

/// Control periods without a call that are asked for.
const PERIODS: u32 = 20;

/// The counter, as a library to preload.
fn counter(stage: &Stage) -> PathBuf {
    let source = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/support/count_heap_calls.c");
    let library = stage.path("count_heap_calls.so");
    let mut gcc = Command::new("gcc");
    gcc.args(["-shared", "-fPIC", "-O1", "-o"]).arg(&library).arg(source).arg("-ldl");
    assert!(gcc.status().expect("gcc starts").success(), "the counter does not compile");
    library
}

/// Heap calls so far.
fn calls(file: &Path) -> u64 {
    let bytes = std::fs::read(file).unwrap_or_default();
    bytes.try_into().map_or(0, u64::from_ne_bytes)
}

#[test]
fn nobody_calls_the_heap_while_the_robot_drives() {
    let stage = Stage::new();
    let (counter, file, report) = (counter(&stage), stage.path("calls"), stage.path("report.json"));
    let simulator = Running::start(
        "simulator",
        &stage,
        &["--family", "clutter", "--seed", "3", "--episodes", "50", "--pace", "realtime"],
    );
    let report_path = report.to_str().expect("a plain path");
    let mut runtime = program("runtime", &stage, &["run", "--quiet", "--report", report_path]);
    runtime.env("LD_PRELOAD", counter).env("COUNT_HEAP_CALLS_INTO", &file);
    let runtime = Running::of("runtime", runtime);
    wait_until("the model is loaded, which takes thousands of heap calls", || calls(&file) > 10_000);
    let mut quiet_periods = 0;
    let mut before = calls(&file);
    wait_until("control periods in a row without a heap call", || {
        std::thread::sleep(Duration::from_millis(100));
        let now = calls(&file);
        quiet_periods = if now == before { quiet_periods + 1 } else { 0 };
        before = now;
        quiet_periods >= PERIODS
    });
    let loaded = before;
    runtime.signal(libc::SIGTERM);
    runtime.end().stopped_by(libc::SIGTERM);
    drop(simulator);
    let ticks = read_json(&report)["ticks"].as_u64().expect("ticks");
    assert!(ticks >= u64::from(PERIODS), "{ticks} ticks: it did not drive meanwhile");
    assert!(calls(&file) > loaded, "the report takes memory: a counter that stands still counts nothing");
}
