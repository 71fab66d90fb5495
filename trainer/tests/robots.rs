//! The trainer for a robot by its name, or by a file of its own.

mod support;

use std::path::Path;
use support::{TINY, trainer};

/// Status and all that it says.
fn run(folder: &Path, arguments: &[&str]) -> (i32, String) {
    let output = trainer(folder, arguments).output().expect("the trainer starts");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code().unwrap_or(-1), text(&output.stdout) + &text(&output.stderr))
}

fn succeed(folder: &Path, arguments: &[&str]) -> String {
    let (status, text) = run(folder, arguments);
    assert_eq!(status, 0, "{arguments:?}: {text}");
    text
}

fn refuse(folder: &Path, arguments: &[&str], parts: &[&str]) {
    let (status, text) = run(folder, arguments);
    assert_eq!(status, 1, "{arguments:?}: {text}");
    for part in parts {
        assert!(text.contains(part), "{part}: {text}");
    }
}

const MINE: &str = "[robot]\nfootprint.circle.radius_m = 0.3\nlinear_max_mps = 0.5\nangular_max_radps = 1.0\n\
                    [lidar]\nbeam_count = 60\nrange_max_m = 8.0\n";

#[test]
fn robots_are_listed_and_looked_at_before_anything_is_trained() {
    let folder = tempfile::tempdir().expect("a folder");
    let here = folder.path();
    let list = succeed(here, &["robot", "list"]);
    assert!(list.contains("\njackal ") && list.contains("pioneer_front_lidar"), "{list}");
    assert_eq!(succeed(here, &["robot", "check"]), list, "without a robot");

    // Only odd is no failure.
    let jackal = succeed(here, &["robot", "check", "jackal"]);
    assert!(jackal.contains("- drives 2 m/s") && jackal.contains("braking distance"), "{jackal}");
    assert!(succeed(here, &["robot", "check", "husky"]).contains("Nothing is odd"));

    std::fs::write(here.join("mine.toml"), MINE).expect("written");
    let mine = succeed(here, &["robot", "check", "mine.toml"]);
    assert!(mine.starts_with("mine: radius 0.3 m") && mine.contains("latency_s is not said"), "{mine}");
    std::fs::write(here.join("bad.toml"), MINE.replace("radius_m", "radus_m")).expect("written");
    refuse(here, &["robot", "check", "bad.toml"], &["line 2", ": radus_m", ": radius_m"]);
    std::fs::write(here.join("bad.toml"), MINE.replace("8.0", "0.4")).expect("written");
    refuse(here, &["robot", "check", "bad.toml"], &["lidar.range_max_m must be at least"]);
    refuse(here, &["robot", "check", "jakal"], &["turtlebot3_burger", "jackal", "TOML file"]);
}

#[test]
fn a_model_for_a_robot_knows_it_by_name_and_drives_no_other() {
    let folder = tempfile::tempdir().expect("a folder");
    let here = folder.path();
    std::fs::write(here.join("mine.toml"), MINE).expect("written");
    let config = format!("{TINY}[task.robot]\nlatency_s = 0.15\n");
    std::fs::write(here.join("tiny.toml"), config).expect("written");
    let train = ["train", "--robot", "mine.toml", "--config", "tiny.toml"];

    let printed = succeed(here, &[&train[..], &["--print-config"]].concat());
    for part in ["robot = \"mine\"", "radius_m = 0.3", "latency_s = 0.15", "beam_count = 60", "hold_s = 6.0"]
    {
        assert!(printed.contains(part), "{part}: {printed}");
    }
    let said = succeed(here, &train);
    assert!(said.contains("training hybrid for mine"), "{said}");
    // The profile is not needed any more.
    std::fs::remove_file(here.join("mine.toml")).expect("removed");
    succeed(here, &["export", "--run", "runs/0001-hybrid-mine-quick-seed1", "--out", "model"]);
    let read = |name: &str| std::fs::read_to_string(here.join("model").join(name)).expect("exported");
    assert!(read("manifest.json").contains("\"robot\": \"mine\""), "{}", read("manifest.json"));
    assert!(read("README.md").contains("| robot | mine: radius 0.3 m"), "{}", read("README.md"));

    let evaluate = |robot: &[&str], policy: &str, out: &str| {
        let usual = ["--policy", policy, "--families=clutter", "--worlds=1", "--pictures=0", "--out", out];
        run(here, &[&["evaluate"], robot, &usual[..]].concat())
    };
    let (status, text) = evaluate(&["--robot", "agv"], "mine=model", "a");
    assert!(status == 1 && text.contains("mine was trained for another robot"), "{text}");
    let (status, text) = evaluate(&["--robot", "agv"], "astar", "b");
    assert_eq!(status, 0, "{text}");
    let plan = std::fs::read_to_string(here.join("b/plan.json")).expect("kept");
    assert!(plan.contains("\"front_m\": 0.6,"), "rivals drive that robot: {plan}");
}
