//! The same worlds driven in this process and through the two processes give the same trajectories, to the bit.

mod support;

use nav_core::geometry::Pose;
use nav_env::robot::SimulatedRobot;
use nav_env::worlds::Place;
use nav_model::model::Model;
use nav_sim::disturbance::Disturbance;
use nav_sim::families::{Family, Split};
use support::programs::{Running, run};
use support::{Stage, read_json};

const EPISODES: u64 = 2;

/// Poses of each episode from the start on, driven by the controller in this process.
fn in_process(stage: &Stage, family: Family, seed: u64, disturbance: &Disturbance) -> Vec<Vec<Pose>> {
    let model = Model::read(&stage.model()).expect("the fixture");
    let task = model.manifest().task;
    let mut controller = model.into_controller().expect("a controller");
    let mut robot = SimulatedRobot::new(&task, disturbance);
    let mut drive = |seed| {
        let place = Place::generated(family, Split::Test, seed, task.robot.radius_m);
        let trace = robot.drive(&mut controller, &place, true).trace.expect("asked for");
        trace.steps.iter().map(|step| step.pose).collect()
    };
    (seed..seed + EPISODES).map(&mut drive).collect()
}

fn through_processes(stage: &Stage, family: Family, seed: u64, disturbance: &str) -> serde_json::Value {
    let report = stage.path("report.json");
    let (seed, episodes) = (seed.to_string(), EPISODES.to_string());
    let path = report.to_str().expect("a plain path");
    let simulator = Running::start(
        "simulator",
        stage,
        &[
            "--family",
            family.id(),
            "--seed",
            &seed,
            "--episodes",
            &episodes,
            "--pace",
            "lockstep",
            "--disturbance",
            disturbance,
            "--poses",
            "--report",
            path,
        ],
    );
    let runtime = run("runtime", stage, &["run", "--pace", "scan", "--assert-no-alloc"]).succeeded();
    assert!(runtime.stdout.contains("\n0 allocations in the loop;"), "{}", runtime.stdout);
    simulator.end().succeeded();
    read_json(&report)
}

fn bits(pose: &Pose) -> [u32; 3] {
    [pose.x_m, pose.y_m, pose.yaw_rad].map(f32::to_bits)
}

fn assert_equal(family: Family, seed: u64, name: &str, disturbance: &Disturbance) {
    assert_equal_on(&Stage::new(), family, seed, name, disturbance);
}

fn assert_equal_on(stage: &Stage, family: Family, seed: u64, name: &str, disturbance: &Disturbance) {
    let expected = in_process(stage, family, seed, disturbance);
    let report = through_processes(stage, family, seed, name);
    let episodes = report["episodes"].as_array().expect("episodes");
    assert_eq!(episodes.len(), expected.len());
    for (episode, expected) in episodes.iter().zip(&expected) {
        let poses: Vec<[f32; 3]> = serde_json::from_value(episode["poses"].clone()).expect("poses");
        let moved = (expected[0].position() - expected[expected.len() / 2].position()).norm();
        assert!(moved > 0.2, "{family}: a robot that stands proves nothing");
        for (step, (found, expected)) in poses.iter().zip(expected).enumerate() {
            assert_eq!(found.map(f32::to_bits), bits(expected), "{family}, step {step}");
        }
        assert_eq!(poses.len(), expected.len(), "{family}");
        assert_eq!(episode["stale_steps"], 0);
    }
}

#[test]
fn in_clutter() {
    assert_equal(Family::Clutter, 3, "none", &Disturbance::none());
}

#[test]
fn in_a_maze_with_all_disturbances() {
    assert_equal(Family::Maze, 11, "usual", &Disturbance::usual());
}

#[test]
fn among_people() {
    assert_equal(Family::Crowd, 7, "none", &Disturbance::none());
}

#[test]
fn with_the_shipped_model() {
    let stage = Stage::with_shipped_model();
    assert_equal_on(&stage, Family::Rooms, 2, "none", &Disturbance::none());
    assert_equal_on(&stage, Family::DeepU, 1, "usual", &Disturbance::usual());
}

#[test]
fn two_runs_of_the_processes_are_equal_and_other_seeds_are_not() {
    let hashes = |seed| {
        let stage = Stage::new();
        let report = through_processes(&stage, Family::UTrap, seed, "usual");
        let episodes = report["episodes"].as_array().expect("episodes").clone();
        let hash = |episode: &serde_json::Value| episode["trajectory_hash"].as_str().map(str::to_owned);
        episodes.iter().map(hash).collect::<Option<Vec<_>>>().expect("hashes")
    };
    let first = hashes(20);
    assert_eq!(first, hashes(20));
    assert_ne!(first[0], first[1], "another world is another trajectory");
}
