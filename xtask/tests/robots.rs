//! `cargo xtask robots` with runs of seconds: everything is made, and nothing is made twice.

use std::path::Path;
use std::process::Command;

/// A run of seconds whose gate anything passes.
const TINY: &str = "
worlds_per_family = 4
[low]
envs = 4
env_steps = 3000
warmup_steps = 500
batch = 32
families = ['clutter', 'u_trap']
td3.hidden = [16]
[high]
envs = 4
decisions = 1000
warmup_decisions = 100
batch = 32
families = ['clutter', 'u_trap']
dqn.hidden = [16]
deviation_margins = [0.0, 0.5]
[gate]
low_reach = 0.0
low_collision = 1.0
spin = 1.0
worlds = 2
clutter_success = 0.0
u_trap_success = 0.0
choosing_worlds = 2
static_collision = 1.0
people_collision_beyond_reactive = 1.0
";

fn robots(folder: &Path, seeds: &str, config: &str) -> String {
    let path = |name: &str| folder.join(name).to_string_lossy().into_owned();
    let mut command = Command::new(env!("CARGO_BIN_EXE_xtask"));
    command.args(["robots", "--robots", "turtlebot4", "--seeds", seeds, "--worlds", "2", "--config", config]);
    command.args(["--work", &path("work"), "--out", &path("out")]);
    let output = command.output().expect("xtask starts");
    let text =
        String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{text}");
    text
}

#[test]
fn a_robot_goes_from_its_profile_to_a_page_of_results_and_what_is_done_is_not_done_again() {
    let folder = tempfile::tempdir().expect("a folder");
    let (config, strict) = (folder.path().join("tiny.toml"), folder.path().join("strict.toml"));
    std::fs::write(&config, TINY).expect("written");
    std::fs::write(&strict, TINY.replace("low_reach = 0.0", "low_reach = 1.0")).expect("written");
    let (config, strict) = (config.to_string_lossy(), strict.to_string_lossy());

    let text = robots(folder.path(), "3", &config);
    assert!(text.contains("turtlebot4-seed3: done in"), "{text}");
    let read = |name: &str| std::fs::read_to_string(folder.path().join("out").join(name)).expect(name);
    let page = read("README.md");
    assert!(page.contains("| turtlebot4 | 1 of 1 |"), "{page}");
    let rows = read("runs.csv");
    let seconds = rows.lines().nth(1).and_then(|row| row.split(',').nth(3));
    assert!(seconds.is_some_and(|seconds| seconds.parse::<u32>().is_ok()), "what the trainer said: {rows}");
    for row in ["turtlebot4,3,true,", ",hybrid,maze,", ",td3,rooms,", "turtlebot4,,,,astar,clutter,"] {
        assert!(rows.contains(row), "{row}: {rows}");
    }
    assert!(read("turtlebot4.md").contains("--robot turtlebot4"), "the card says how it was made");
    assert!(read("turtlebot4.svg").contains("<svg"));
    assert!(folder.path().join("out/turtlebot4.csv.gz").exists() || !read("turtlebot4.csv").is_empty());

    // As if it had been killed: one run without its last file, one that had not begun, and a gate that is missed.
    let work = folder.path().join("work");
    std::fs::remove_file(work.join("turtlebot4-seed3/done.json")).expect("removed");
    std::fs::remove_file(work.join("turtlebot4-seed3/evaluate/summary.json")).expect("removed");
    let trained =
        || std::fs::metadata(work.join("turtlebot4-seed3/run/policy.bin")).and_then(|data| data.modified());
    let before = trained().expect("trained");
    let text = robots(folder.path(), "3,4", &strict);
    assert_eq!(trained().expect("trained"), before, "it was trained already");
    assert!(text.contains("turtlebot4-astar: done before"), "{text}");
    assert!(text.contains("seed4: done") && text.contains("not passed: "), "{text}");
    let page = read("README.md");
    assert!(page.contains("| turtlebot4 | 1 of 2 |") && page.contains("- turtlebot4, seed 4: "), "{page}");
}
