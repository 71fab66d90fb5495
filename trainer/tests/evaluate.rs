//! `trainer evaluate` as people use it: several policies, world files, interruptions, full disks, and wrong inputs.
//! Rivals need no model.

use nav_core::metrics::EpisodeEnd;
use nav_core::task::ShieldMode;
use nav_env::rows::{EpisodeRow, read_rows};
use nav_sim::families::{Family, Split, generate};
use nav_sim::world_file;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

const TRAINER: &str = env!("CARGO_BIN_EXE_trainer");
/// Two rivals in eight worlds, and where they go.
const RIVALS: [&str; 11] = [
    "evaluate",
    "--policy",
    "astar",
    "--policy",
    "blind=reactive",
    "--families",
    "clutter,maze",
    "--worlds",
    "4",
    "--out",
    "eval",
];

/// The shipped model, with its safety gate told who moves.
const INFORMED: &str = concat!("informed:", env!("CARGO_MANIFEST_DIR"), "/../models");

fn evaluate(folder: &Path, arguments: &[&str], more: &[&str]) -> Output {
    let mut command = Command::new(TRAINER);
    let command = command.current_dir(folder).args(arguments).args(more);
    command.output().expect("the trainer starts")
}

fn words(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn succeed(folder: &Path, arguments: &[&str], more: &[&str]) -> String {
    let output = evaluate(folder, arguments, more);
    assert!(output.status.success(), "{more:?}: {}", words(&output.stderr));
    words(&output.stdout)
}

/// What it says when it refuses: one sentence.
fn refuse(folder: &Path, arguments: &[&str], more: &[&str]) -> String {
    let output = evaluate(folder, arguments, more);
    let error = words(&output.stderr);
    assert!(!output.status.success(), "{arguments:?} {more:?} should be refused");
    assert!(
        !error.contains("panicked") && ["trainer: ", "error: "].iter().any(|start| error.starts_with(start)),
        "{error}"
    );
    let first = error.split("\n\n").next().unwrap_or_default();
    assert!(first.trim_end().lines().count() <= 2, "one sentence, not {error}");
    error
}

fn rows(folder: &Path) -> Vec<EpisodeRow> {
    read_rows(&folder.join("eval/episodes.csv")).expect("whole rows")
}

/// Without what differs from run to run: the time of ticks.
fn timeless(rows: Vec<EpisodeRow>) -> Vec<EpisodeRow> {
    rows.into_iter().map(|row| EpisodeRow { tick_mean_ns: 0, tick_max_ns: 0, ..row }).collect()
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

/// The rows of [`RIVALS`], driven by as many threads.
fn whole(threads: &str) -> Vec<EpisodeRow> {
    let folder = folder();
    let table = succeed(folder.path(), &RIVALS, &["--threads", threads]);
    assert!(table.contains("astar") && table.contains("blind") && table.contains("believed"), "{table}");
    for file in ["plan.json", "summary.json", "table.txt", "astar.png", "blind.svg"] {
        assert!(folder.path().join("eval").join(file).is_file(), "{file}");
    }
    timeless(rows(folder.path()))
}

#[test]
fn rows_come_in_a_fixed_order_whatever_the_number_of_threads() {
    let rows = whole("1");
    let order: Vec<_> = rows.iter().map(|row| (row.family, row.world_seed, row.policy.as_str())).collect();
    let mut expected = Vec::new();
    for family in [Family::Clutter, Family::Maze] {
        for seed in 0..4 {
            expected.extend(["astar", "blind"].map(|policy| (Some(family), seed, policy)));
        }
    }
    assert_eq!(order, expected);
    assert_eq!(rows, whole("7"));
}

#[test]
fn a_killed_evaluation_goes_on_where_it_was() {
    let folder = folder();
    let here = folder.path();
    let out = here.join("eval/episodes.csv");
    // More worlds than are driven before it is killed.
    let arguments: Vec<_> = RIVALS.iter().map(|text| if *text == "4" { "400" } else { *text }).collect();
    let mut command = Command::new(TRAINER);
    let command = command.current_dir(here).args(&arguments).stdout(Stdio::null()).stderr(Stdio::null());
    let mut child = command.spawn().expect("the trainer starts");
    let begun = Instant::now();
    let lines = || std::fs::read_to_string(&out).map_or(0, |text| text.lines().count());
    while lines() < 4 {
        assert!(begun.elapsed() < Duration::from_secs(300), "no rows");
        std::thread::sleep(Duration::from_millis(2));
    }
    child.kill().expect("killed");
    child.wait().expect("reaped");
    // Somebody who asks for less gets less, and whoever forgot --resume is told.
    assert!(refuse(here, &RIVALS, &["--resume"]).contains("other scenes"));
    assert!(refuse(here, &RIVALS, &[]).contains("--resume"));

    // What a kill in the middle of a row leaves, of an evaluation with the four worlds.
    let folder = self::folder();
    let here = folder.path();
    succeed(here, &RIVALS, &[]);
    let (path, summary) = (here.join("eval/episodes.csv"), here.join("eval/summary.json"));
    let text = std::fs::read_to_string(&path).expect("text");
    let torn = text.lines().nth(6).map(|line| text.find(line).expect("a line") + 20).expect("six rows");
    for length in [torn, 0] {
        std::fs::write(&path, &text[..length]).expect("the disk has room");
        std::fs::remove_file(&summary).expect("it was written");
        succeed(here, &RIVALS, &["--resume", "--threads", "3"]);
        assert!(summary.is_file());
        assert_eq!(timeless(rows(here)), whole("2"), "cut at {length}");
    }
}

#[test]
fn a_signal_keeps_what_was_driven() {
    let folder = folder();
    let here = folder.path();
    let arguments: Vec<_> = RIVALS.iter().map(|text| if *text == "4" { "200" } else { *text }).collect();
    let mut command = Command::new(TRAINER);
    let command = command.current_dir(here).args(&arguments).stderr(Stdio::piped());
    let child = command.spawn().expect("the trainer starts");
    let begun = Instant::now();
    while std::fs::read_to_string(here.join("eval/episodes.csv")).map_or(0, |text| text.lines().count()) < 3 {
        assert!(begun.elapsed() < Duration::from_secs(300), "no rows");
        std::thread::sleep(Duration::from_millis(2));
    }
    let kill = Command::new("kill").args(["-TERM", &child.id().to_string()]).status();
    assert!(kill.expect("kill starts").success());
    let output = child.wait_with_output().expect("it ends");
    assert_eq!(output.status.code(), Some(143));
    let error = words(&output.stderr);
    let driven = rows(here).len();
    assert!(
        error.contains(&format!("after {driven} of 800 episodes")) && error.contains("--resume"),
        "{error}"
    );
}

#[test]
fn a_full_disk_keeps_what_was_driven() {
    let folder = folder();
    let here = folder.path();
    // No file may grow beyond 2 KB; the signal that says so is ignored, so that writing fails as on a full disk.
    let mut command = Command::new("sh");
    command.current_dir(here).args(["-c", "trap '' XFSZ; ulimit -f 4; exec \"$@\"", "sh", TRAINER]);
    let output = command.args(RIVALS).args(["--pictures", "0"]).output().expect("a shell");
    let error = words(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{error}");
    assert!(error.contains("episodes.csv") && error.contains("--resume"), "{error}");
    let driven = rows(here).len();
    assert!((1..16).contains(&driven), "{driven}");
    succeed(here, &RIVALS, &["--resume", "--pictures", "0"]);
    assert_eq!(timeless(rows(here)), whole("2"));
}

#[test]
fn a_closed_pipe_loses_nothing() {
    let folder = folder();
    let mut command = Command::new("sh");
    command.current_dir(folder.path()).args(["-c", "\"$@\" 2>&1 | true", "sh", TRAINER]);
    command.args(RIVALS).status().expect("a shell");
    assert_eq!(rows(folder.path()).len(), 16);
    assert!(folder.path().join("eval/summary.json").is_file());
}

/// Two worlds that generators made, as files.
fn world_files(folder: &Path) -> PathBuf {
    let worlds = folder.join("worlds");
    std::fs::create_dir(&worlds).expect("a folder");
    for (name, seed) in [("w10.toml", 1), ("w9.toml", 0)] {
        let world = generate(Family::Clutter, Split::Test, seed);
        world_file::save(&worlds.join(name), &world).expect("the disk has room");
    }
    worlds
}

#[test]
fn world_files_and_limits() {
    let folder = folder();
    let here = folder.path();
    world_files(here);
    let arguments = ["evaluate", "--policy", "astar", "--world-files", "worlds", "--out", "eval"];
    let table = succeed(here, &arguments, &["--disturbance", "none"]);
    assert!(table.contains("world files") && !table.contains("clutter"), "{table}");
    let whole = rows(here);
    let names: Vec<_> = whole.iter().map(|row| (row.world_file.as_deref(), row.world_seed)).collect();
    assert_eq!(names, [(Some("w9.toml"), 0), (Some("w10.toml"), 1)]);
    assert!(whole.iter().all(|row| row.end == EpisodeEnd::Success && row.time_s > 4.0), "{whole:?}");
    succeed(here, &arguments, &["--disturbance", "none", "--time-limit", "4"]);
    assert!(rows(here).iter().all(|row| row.end == EpisodeEnd::Timeout && row.steps == 40));
    succeed(here, &arguments, &["--disturbance", "none", "--goal-radius", "1.5"]);
    for (near, far) in rows(here).iter().zip(&whole) {
        assert!(near.end == EpisodeEnd::Success && near.time_s < far.time_s - 0.5, "{near:?} {far:?}");
    }
}

#[test]
fn wrong_inputs_are_refused_before_anything_is_driven() {
    let folder = folder();
    let here = folder.path();
    std::fs::create_dir(here.join("empty")).expect("a folder");
    for (more, part) in [
        (&["--threads", "100000"][..], "1..=64"),
        (&["--threads", "0"], "1..=64"),
        (&["--worlds", "0"], "--worlds"),
        (&["--worlds", "4294967295"], "--worlds"),
        (&["--time-limit", "0"], "--time-limit"),
        (&["--goal-radius", "nan"], "--goal-radius"),
        (&["--policy", "astar"], "twice"),
        (&["--policy", "runs/1"], "give it a name"),
        (&["--policy", "mine=runs/1"], "no model in runs/1"),
        (&["--policy", INFORMED, "--shield", "off"], "leave out --shield off"),
        (&["--policy", "x/y=reactive"], "label"),
        (&["--families", "maze,maze"], "twice"),
        (&["--families", "moon"], "moon"),
        (&["--world-files", "empty"], "no world"),
        (&["--world-files", "absent"], "absent"),
        (&["--resume"], "leave out --resume"),
    ] {
        let arguments: &[&str] = if more[0] == "--worlds" || more[0] == "--families" {
            &["evaluate", "--policy", "astar", "--out", "eval"]
        } else {
            &RIVALS
        };
        let error = refuse(here, arguments, more);
        assert!(error.contains(part), "{more:?}: {error}");
        assert!(!here.join("eval/episodes.csv").exists(), "{more:?}");
    }
    // A report that cannot be written is better known now than after hours.
    std::fs::create_dir_all(here.join("eval/table.txt")).expect("a folder");
    assert!(refuse(here, &RIVALS, &[]).contains("table.txt cannot be written"));
    assert!(!here.join("eval/episodes.csv").exists());
}

/// Every collision has its strip, and the pictures of another evaluation do not stay.
#[test]
fn the_last_seconds_of_collisions_are_drawn() {
    let folder = tempfile::tempdir().expect("a folder");
    let here = folder.path();
    let drive = |more: &[&str]| {
        let stream = [
            "evaluate",
            "--policy",
            "reactive",
            "--families",
            "stream,clutter",
            "--worlds",
            "3",
            "--out",
            "eval",
        ];
        succeed(here, &stream, more);
        let ends: Vec<_> = rows(here).iter().map(|row| (row.family, row.end)).collect();
        ends.into_iter().filter(|end| *end == (Some(Family::Stream), EpisodeEnd::Collision)).count()
    };
    let collided = drive(&["--shield", "off"]);
    assert!(collided > 0, "somebody is hit");
    let strips = std::fs::read_to_string(here.join("eval/collisions/reactive-stream.svg")).expect("drawn");
    assert_eq!(strips.matches("<title>stream").count(), collided);
    assert!(here.join("eval/collisions/reactive-stream.png").exists());
    assert!(!here.join("eval/collisions/reactive-clutter.svg").exists(), "nothing was hit there");
    drive(&["--pictures", "0"]);
    assert!(!here.join("eval/collisions/reactive-stream.svg").exists(), "of another evaluation");
}

/// Worlds with people, with the safety gate and without: the rows say which, and the gate makes a difference.
#[test]
fn the_safety_gate_is_on_unless_it_is_switched_off() {
    let folder = tempfile::tempdir().expect("a folder");
    let drive = |more: &[&str]| {
        let plan =
            ["evaluate", "--policy", "reactive", "--families", "crowd", "--worlds", "12", "--out", "eval"];
        succeed(folder.path(), &plan, more);
        rows(folder.path())
    };
    let (on, off) = (drive(&[]), drive(&["--shield", "off"]));
    assert!(on.iter().all(|row| row.shield == Some(ShieldMode::On)));
    assert!(off.iter().all(|row| row.shield == Some(ShieldMode::Off)));
    let collisions = |rows: &[EpisodeRow]| rows.iter().filter(|row| row.end == EpisodeEnd::Collision).count();
    assert!(collisions(&on) < collisions(&off), "{} with it, {} without", collisions(&on), collisions(&off));
    refuse(folder.path(), &["evaluate", "--shield", "perhaps"], &[]);
}
