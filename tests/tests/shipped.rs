//! The model that this repository ships drives held-out worlds through the two processes.

mod support;

use support::programs::{Running, run};
use support::{Stage, read_json};

const EPISODES: &str = "20";

/// Share of held-out worlds in which the goal was reached, and how often the robot collided.
fn drive(family: &str) -> (f64, f64) {
    let stage = Stage::with_shipped_model();
    let report = stage.path("report.json");
    let path = report.to_str().expect("a plain path");
    let arguments = ["--family", family, "--episodes", EPISODES, "--pace", "lockstep", "--report", path];
    let simulator = Running::start("simulator", &stage, &arguments);
    run("runtime", &stage, &["run", "--pace", "scan", "--assert-no-alloc"]).succeeded();
    simulator.end().succeeded();
    let summary = read_json(&report)["summary"].clone();
    let number = |name: &str| summary[name].as_f64().expect("a number");
    (number("success_rate"), number("collision_rate"))
}

#[test]
fn it_passes_its_own_check() {
    let ended = run("runtime", &Stage::with_shipped_model(), &["check"]).succeeded();
    assert!(ended.stdout.contains("hybrid") && ended.stdout.contains("golden pairs"), "{}", ended.stdout);
}

/// The bar of the demo, on its worlds; the same model and worlds give the same figures on every run.
#[test]
fn it_reaches_goals_in_clutter_and_gets_out_of_traps() {
    let (success, collision) = drive("clutter");
    assert!(success >= 0.95, "clutter: success {success}, collision {collision}");
    let (success, collision) = drive("u_trap");
    assert!(success >= 0.85, "u_trap: success {success}, collision {collision}");
}
