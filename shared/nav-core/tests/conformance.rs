//! The metrics against the vectors that other projects can be run against (`conformance/metrics/README.md`), and the vectors
//! against the reference in Python that they come from.

use nav_core::footprint::Footprint;
use nav_core::geometry::{Point, Pose};
use nav_core::metrics::{EpisodeEnd, EpisodeRecorder, StepTruth};
use nav_core::task::{Robot, Task};
use serde_json::{Map, Value};
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("conformance/metrics")
}

/// The vectors of a folder, by name.
fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).expect("the folder").map(|entry| entry.expect("a file").path());
    let mut files: Vec<PathBuf> =
        entries.filter(|path| path.extension().is_some_and(|extension| extension == "json")).collect();
    files.sort();
    files
}

fn number(value: &Value) -> f32 {
    value.as_f64().expect("a number") as f32
}

fn task(case: &Value) -> Task {
    let robot = &case["robot"];
    let robot = Robot {
        footprint: Footprint::circle(number(&robot["radius_m"])),
        linear_max_mps: number(&robot["linear_max_mps"]),
        angular_max_radps: number(&robot["angular_max_radps"]),
        ..Robot::default()
    };
    Task { control_period_s: number(&case["dt_s"]), ..Task::of(robot) }
}

/// As the simulation ends an episode: a contact comes before the goal.
fn end_of(case: &Value, last: Pose, goal: Point, has_contact: bool) -> EpisodeEnd {
    let is_there = (goal - last.position()).norm() <= number(&case["goal_radius_m"]);
    match (has_contact, is_there, case["believes_it_arrived"] == true) {
        (true, _, _) => EpisodeEnd::Collision,
        (false, true, _) => EpisodeEnd::Success,
        (false, false, true) => EpisodeEnd::BelievedArrived,
        (false, false, false) => EpisodeEnd::Timeout,
    }
}

/// What nav-core says of an episode, by the names of the metrics.
fn measured(case: &Value) -> Map<String, Value> {
    let start = &case["start"];
    let start = Pose::new(number(&start["x_m"]), number(&start["y_m"]), number(&start["yaw_rad"]));
    let goal = Point::new(number(&case["goal_m"][0]), number(&case["goal_m"][1]));
    let mut recorder = EpisodeRecorder::new(start, goal, &task(case));
    let column = |name: &str| case["steps"][name].as_array().expect("a column");
    let [x, y, yaw, speed, clearance, collision, contact] =
        ["x_m", "y_m", "yaw_rad", "linear_mps", "clearance_m", "time_to_collision_s", "contact"].map(column);
    let mut last = start;
    for (step, x_m) in x.iter().enumerate() {
        last = Pose::new(number(x_m), number(&y[step]), number(&yaw[step]));
        recorder.step(&StepTruth {
            pose: last,
            linear_mps: number(&speed[step]),
            clearance_m: number(&clearance[step]),
            time_to_collision_s: collision[step].as_f64().map_or(f32::INFINITY, |seconds| seconds as f32),
        });
    }
    let has_contact = contact.iter().any(|contact| contact == true);
    let shortest_m = case["shortest_way_m"].as_f64().map(|shortest_m| shortest_m as f32);
    let metrics = recorder.finish(end_of(case, last, goal, has_contact), false, shortest_m);
    let Value::Object(mut all) = serde_json::to_value(metrics).expect("plain numbers") else {
        panic!("metrics have names")
    };
    all.remove("hit_while_standing").expect("it is given, not measured");
    all
}

/// What of an episode is not as expected.
fn differences(case: &Value) -> Vec<String> {
    let (found, expected) = (measured(case), case["expected"].as_object().expect("what is expected"));
    let names = |of: &Map<String, Value>| of.keys().cloned().collect::<BTreeSet<String>>();
    assert_eq!(names(&found), names(expected), "every metric has its vectors");
    let allowed = |name: &str| case["tolerance"][name].as_f64().expect("a tolerance");
    let is_met = |found: &Value, expected: &Value| match (found.as_f64(), expected.as_f64()) {
        (Some(found), Some(expected)) => {
            (found - expected).abs() <= allowed("absolute") + allowed("relative") * expected.abs()
        }
        _ => found == expected,
    };
    let differing = expected.iter().filter(|(name, value)| !is_met(&found[*name], value));
    differing.map(|(name, value)| format!("{name} is {}, not {value}", found[name])).collect()
}

fn read(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).expect("a vector")).expect("JSON")
}

#[test]
fn the_metrics_are_those_of_the_vectors() {
    let files = files(&folder());
    assert!(files.len() >= 14, "{files:?}");
    for path in files {
        let differences = differences(&read(&path));
        assert!(differences.is_empty(), "{}: {}", path.display(), differences.join("; "));
    }
}

/// What every other implementation should be caught at is expected nowhere by chance.
#[test]
fn a_vector_with_another_expectation_is_not_met() {
    let case = read(&folder().join("swell_10hz.json"));
    for name in case["expected"].as_object().expect("metrics").keys() {
        let mut other = case.clone();
        other["expected"][name] = match &case["expected"][name] {
            Value::Number(number) => (number.as_f64().expect("a number") + 0.01).into(),
            _ => "something else".into(),
        };
        assert_eq!(differences(&other).len(), 1, "{name}");
    }
}

/// Runs a script of the folder.
fn python(arguments: &[&Path]) -> String {
    let output = Command::new("python3").arg("-B").args(arguments).output();
    let output = output.expect("python3 can be started");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{text}{}", String::from_utf8_lossy(&output.stderr));
    text
}

#[test]
fn the_reference_in_python_reproduces_the_vectors() {
    let told = python(&[&folder().join("reference.py")]);
    assert!(told.contains(&format!("{} vectors, 0 differences", files(&folder()).len())), "{told}");
    // And they are what it makes today, no more and no fewer.
    let made = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("conformance-metrics");
    let _ = fs::remove_dir_all(&made);
    fs::create_dir_all(&made).expect("a folder");
    python(&[&folder().join("make_vectors.py"), &made]);
    let names = |folder: &Path| {
        files(folder).iter().map(|path| path.file_name().expect("a name").to_owned()).collect::<Vec<_>>()
    };
    assert_eq!(names(&made), names(&folder()));
    for path in files(&made) {
        let name = path.file_name().expect("a name");
        assert!(read(&path) == read(&folder().join(name)), "{} is not what is made", name.display());
    }
}
