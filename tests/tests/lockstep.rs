//! The same worlds driven in this process and through the two processes give the same trajectories, to the bit.

mod support;

use nav_core::geometry::Pose;
use nav_core::metrics::EpisodeEnd;
use nav_core::task::Task;
use nav_env::limits::Limits;
use nav_env::robot::SimulatedRobot;
use nav_env::worlds::Place;
use nav_model::model::Model;
use nav_sim::disturbance::Disturbance;
use nav_sim::families::{Family, Split, generate};
use nav_sim::world_file;
use std::sync::Arc;
use support::programs::{Running, run};
use support::{Stage, read_json};

const EPISODES: u64 = 2;

/// Poses from the start on, and how it ended.
struct Driven {
    poses: Vec<Pose>,
    end: EpisodeEnd,
}

/// The places one after the other, driven by the controller in this process.
fn in_process(stage: &Stage, places: &[Place], disturbance: &Disturbance, limits: Limits) -> Vec<Driven> {
    let model = Model::read(&stage.model()).expect("the model");
    let mut robot = SimulatedRobot::new(&model.manifest().task, disturbance).with_limits(limits);
    let mut controller = model.into_controller().expect("a controller");
    let mut drive = |place| {
        let driven = robot.drive(&mut controller, place, true);
        let poses = driven.trace.expect("asked for").steps.iter().map(|step| step.pose).collect();
        Driven { poses, end: driven.metrics.end }
    };
    places.iter().map(&mut drive).collect()
}

/// The worlds of a family from a seed on.
fn places(family: Family, seed: u64) -> Vec<Place> {
    let footprint = &Task::default().robot.footprint;
    (seed..seed + EPISODES).map(|seed| Place::generated(family, Split::Test, seed, footprint)).collect()
}

/// The simulator's report, driven by the runtime in two processes.
fn through_processes(stage: &Stage, worlds: &[&str], disturbance: &str) -> serde_json::Value {
    let report = stage.path("report.json");
    let path = report.to_str().expect("a plain path");
    let common = ["--pace", "lockstep", "--disturbance", disturbance, "--poses", "--report", path];
    let simulator = Running::start("simulator", stage, &[worlds, &common].concat());
    let runtime = run("runtime", stage, &["run", "--pace", "scan", "--assert-no-alloc"]).succeeded();
    assert!(runtime.stdout.contains("\n0 allocations in the loop;"), "{}", runtime.stdout);
    simulator.end().succeeded();
    read_json(&report)
}

fn family_through_processes(
    stage: &Stage,
    family: Family,
    seed: u64,
    disturbance: &str,
) -> serde_json::Value {
    let (seed, episodes) = (seed.to_string(), EPISODES.to_string());
    let worlds = ["--family", family.id(), "--seed", &seed, "--episodes", &episodes];
    through_processes(stage, &worlds, disturbance)
}

fn bits(pose: &Pose) -> [u32; 3] {
    [pose.x_m, pose.y_m, pose.yaw_rad].map(f32::to_bits)
}

fn assert_equal(family: Family, seed: u64, name: &str, disturbance: &Disturbance) {
    assert_equal_on(&Stage::new(), family, seed, name, disturbance);
}

fn assert_equal_on(stage: &Stage, family: Family, seed: u64, name: &str, disturbance: &Disturbance) {
    let expected = in_process(stage, &places(family, seed), disturbance, Limits::default());
    assert_same(&family_through_processes(stage, family, seed, name), &expected);
}

fn assert_same(report: &serde_json::Value, expected: &[Driven]) {
    let episodes = report["episodes"].as_array().expect("episodes");
    assert_eq!(episodes.len(), expected.len());
    for (episode, expected) in episodes.iter().zip(expected) {
        let (world, end) = (&episode["world"], expected.end);
        let poses: Vec<[f32; 3]> = serde_json::from_value(episode["poses"].clone()).expect("poses");
        let half_way = expected.poses[expected.poses.len() / 2];
        let moved = (expected.poses[0].position() - half_way.position()).norm();
        assert!(moved > 0.2, "{world}: a robot that stands proves nothing");
        for (step, (found, expected)) in poses.iter().zip(&expected.poses).enumerate() {
            assert_eq!(found.map(f32::to_bits), bits(expected), "{world}, step {step}");
        }
        assert_eq!(
            (poses.len(), episode["end"].as_str()),
            (expected.poses.len(), Some(end.word())),
            "{world}"
        );
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
        let report = family_through_processes(&stage, Family::UTrap, seed, "usual");
        let episodes = report["episodes"].as_array().expect("episodes").clone();
        let hash = |episode: &serde_json::Value| episode["trajectory_hash"].as_str().map(str::to_owned);
        episodes.iter().map(hash).collect::<Option<Vec<_>>>().expect("hashes")
    };
    let first = hashes(20);
    assert_eq!(first, hashes(20));
    assert_ne!(first[0], first[1], "another world is another trajectory");
}

/// Also how long an episode lasts and where it ends, whatever the policy was trained with, and with which seed.
#[test]
fn in_a_folder_of_world_files_with_other_limits() {
    let stage = Stage::new();
    let folder = stage.path("worlds");
    std::fs::create_dir(&folder).expect("a folder");
    let mut expected = Vec::new();
    for (number, name) in ["w9.toml", "w10.toml"].into_iter().enumerate() {
        let world = generate(Family::Rooms, Split::Test, 5 + number as u64);
        world_file::save(&folder.join(name), &world).expect("written");
        let footprint = &Task::default().robot.footprint;
        expected.push(Place::read(name, Arc::new(world), number as u64, footprint));
    }
    let limits = Limits { time_limit_s: Some(20.0), goal_radius_m: Some(1.0) };
    let expected = in_process(&stage, &expected, &Disturbance::usual(), limits);
    let worlds = folder.to_str().expect("a plain path");
    let limited = ["--world-file", worlds, "--time-limit", "20", "--goal-radius", "1"];
    let report = through_processes(&stage, &limited, "usual");
    assert_same(&report, &expected);
    let files = report["episodes"].as_array().expect("episodes").iter().map(|episode| &episode["world_file"]);
    assert_eq!(files.collect::<Vec<_>>(), ["w9.toml", "w10.toml"]);
    assert!(expected.iter().all(|driven| driven.poses.len() <= 201));
}

/// With a goal smaller than the drift the robot stands beside it, and both ways of driving say so.
#[test]
fn an_arrival_that_is_only_believed() {
    let stage = Stage::with_shipped_model();
    let limits = Limits { time_limit_s: Some(40.0), goal_radius_m: Some(0.05) };
    // Which worlds end so depends on the model.
    let drive =
        |seed| in_process(&stage, &places(Family::Rooms, seed), &Disturbance::without_localiser(), limits);
    let ends_so = |driven: &Driven| driven.end == EpisodeEnd::BelievedArrived;
    let found =
        (1..40).find_map(|seed| Some((seed, drive(seed))).filter(|(_, driven)| driven.iter().any(ends_so)));
    let (seed, expected) = found.expect("a robot that stands beside its goal in eighty worlds");
    let seed = seed.to_string();
    let limited = [
        "--family",
        "rooms",
        "--seed",
        &seed,
        "--episodes",
        "2",
        "--time-limit",
        "40",
        "--goal-radius",
        "0.05",
    ];
    let report = through_processes(&stage, &limited, "no_localiser");
    assert_same(&report, &expected);
    let of_end = expected.iter().filter(|driven| driven.end == EpisodeEnd::BelievedArrived).count();
    let rate = report["summary"]["believed_arrived_rate"].as_f64().expect("a rate");
    assert!((rate - of_end as f64 / EPISODES as f64).abs() < 1e-9, "{rate}");
}
