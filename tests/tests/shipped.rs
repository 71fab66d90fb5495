//! The model that this repository ships drives held-out worlds through the two processes.

mod support;

use support::programs::{Running, run};
use support::{Stage, read_json, shipped_robots};

const EPISODES: &str = "20";

/// Share of held-out worlds in which the goal was reached, and how often the robot collided.
fn drive(stage: &Stage, family: &str, robot: &[&str]) -> (f64, f64) {
    let report = stage.path("report.json");
    let path = report.to_str().expect("a plain path");
    let arguments = ["--family", family, "--episodes", EPISODES, "--pace", "lockstep", "--report", path];
    let simulator = Running::start("simulator", stage, &[&arguments, robot].concat());
    run("runtime", stage, &["run", "--pace", "scan", "--assert-no-alloc"]).succeeded();
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
    let stage = Stage::with_shipped_model();
    let (success, collision) = drive(&stage, "clutter", &[]);
    assert!(success >= 0.95, "clutter: success {success}, collision {collision}");
    let (success, collision) = drive(&stage, "u_trap", &[]);
    assert!(success >= 0.85, "u_trap: success {success}, collision {collision}");
}

/// Each on its own robot, as `robots/` describes it now.
#[test]
fn so_do_those_of_the_other_robots() {
    let robots = shipped_robots();
    assert!(robots.len() >= 2, "{robots:?}");
    for robot in robots {
        let stage = Stage::with_shipped_robot(&robot);
        run("runtime", &stage, &["check"]).succeeded();
        for (family, least) in [("clutter", 0.95), ("u_trap", 0.85)] {
            let (success, collision) = drive(&stage, family, &["--robot-profile", &robot]);
            assert!(success >= least, "{robot}, {family}: success {success}, collision {collision}");
        }
    }
}
