//! `cargo xtask study` with a trainer of milliseconds: everything is done once, whatever ends it, and what failed is told.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::thread::sleep;
use std::time::Duration;

use study::provenance::Provenance;
use study::rows::{self, End, Outcome, Tables};

const STUDY: &str = r#"
title = "Made up"
inference = "Nothing."
[training]
seeds = [1, 2, 3]
env_steps = 1_000
updates_min = 300
[evaluation]
split = "test"
families = ["clutter", "maze"]
worlds = 3
gates = ["off", "on"]
[[method]]
name = "hybrid"
label = "Hybrid"
train = { config = "hybrid.toml" }
[[method]]
name = "td3"
label = "TD3"
train = { config = "td3.toml", flags = ["--profile", "quick"] }
seeds = [1, 2]
[[method]]
name = "low"
label = "Low"
low_level_of = "hybrid"
[[method]]
name = "astar"
label = "A*"
rival = "astar"
"#;

/// A study in a folder of its own.
struct Stage {
    folder: tempfile::TempDir,
}

impl Stage {
    fn new() -> Self {
        let stage = Self { folder: tempfile::tempdir().expect("a folder") };
        for (name, text) in [("study.toml", STUDY), ("hybrid.toml", "seed = 5\n"), ("td3.toml", "")] {
            stage.write(name, text);
        }
        stage
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn write(&self, name: &str, text: &str) {
        fs::write(self.path(name), text).expect("written");
    }

    fn remove(&self, name: &str) {
        fs::remove_file(self.path(name)).expect("removed");
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_xtask"));
        command.env("STUB", self.folder.path()).current_dir(self.folder.path()).arg("study");
        command.arg("--programs").arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/stub"));
        command.args(["--work", "work", "--out", "out"]).args(arguments);
        command
    }

    fn start(&self, arguments: &[&str]) -> Child {
        let mut command = self.command(&["--study", "study.toml"]);
        command.args(arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("it starts")
    }

    /// Everything that it said, and whether it ended well.
    fn run(&self, arguments: &[&str]) -> (bool, String) {
        said(&self.start(arguments).wait_with_output().expect("it ends"))
    }

    /// What the stubs were told since the last time that somebody asked.
    fn calls(&self) -> Vec<String> {
        let text = fs::read_to_string(self.path("calls")).unwrap_or_default();
        let _ = fs::remove_file(self.path("calls"));
        text.lines().map(str::to_owned).collect()
    }

    fn tables(&self) -> Tables {
        rows::read(&[self.path("out/rows")]).expect("rows")
    }

    /// Waits for a file of a stub, and takes it away.
    fn wait_for(&self, name: &str) {
        while fs::remove_file(self.path(name)).is_err() {
            sleep(Duration::from_millis(10));
        }
    }

    fn kill_stub(&self) {
        let pid = fs::read_to_string(self.path("pid")).expect("it is at work");
        assert!(Command::new("kill").args(["-9", pid.trim()]).status().expect("kill").success());
    }
}

fn said(output: &Output) -> (bool, String) {
    let text = [&output.stdout[..], &output.stderr].map(String::from_utf8_lossy).concat();
    (output.status.success(), text)
}

fn count(calls: &[String], words: &str) -> usize {
    calls.iter().filter(|call| call.contains(words)).count()
}

#[test]
fn everything_is_trained_driven_and_kept_once() {
    let stage = Stage::new();
    stage.write("collapses", "hybrid/seed-2\n");
    stage.write("misses", "td3/seed-1\n");
    let (is_well, text) = stage.run(&[]);
    assert!(is_well && text.contains("the report is somewhere"), "{text}");
    for line in [
        "hybrid, seed 1: training 0 %",
        "hybrid, seed 1: done, trained in 1:02\n",
        "td3, seed 1: done, trained in 1:02, its gate missed",
        "hybrid, seed 2: failed: the run left no policy",
        "low, seed 2: failed",
        "astar: done\n",
    ] {
        assert!(text.contains(line), "{line}: {text}");
    }
    let calls = stage.calls();
    assert_eq!((count(&calls, "train --"), count(&calls, "evaluate --policy")), (5, 2 * (2 + 2 + 2 + 1)));
    assert_eq!(count(&calls, "--policy low=flat:"), 4);
    assert_eq!(count(&calls, "--threads 1"), 14, "one a core");
    let report = calls.last().expect("some");
    assert!(report.starts_with("study report --study ") && report.contains("--rows "), "{report}");

    let tables = stage.tables();
    assert_eq!(tables.episodes.len(), 2 * 2 * 3 * (3 + 2 + 3 + 1));
    let nothing = tables.episodes.iter().filter(|(_, row)| row.end == End::NoPolicy).map(|(_, row)| row);
    let nothing: Vec<_> = nothing.map(|row| (row.policy.as_str(), row.training_seed)).collect();
    assert_eq!(nothing.len(), 2 * 2 * 3 * 2, "rows say that nothing drove");
    assert!(nothing.contains(&("low", Some(2))) && nothing.contains(&("hybrid", Some(2))));
    let curves: Vec<_> = tables.curves.iter().map(|row| (row.method.as_str(), row.training_seed)).collect();
    assert_eq!(curves, [("hybrid", 1), ("hybrid", 2), ("hybrid", 3), ("td3", 1), ("td3", 2)]);
    assert_eq!((tables.curves[0].env_steps, tables.curves[0].episode_return), (1_000, Some(1.5)));
    let run = |method: &str, seed| {
        let mut runs = tables.runs.iter();
        runs.find(|run| run.method == method && run.training_seed == seed).expect("a run")
    };
    let passed = run("hybrid", 1);
    assert_eq!((passed.outcome, passed.train_s, passed.updates), (Outcome::Passed, Some(62.0), Some(300)));
    let here = Provenance::at(env!("CARGO_MANIFEST_DIR").as_ref());
    assert_eq!((passed.commit.as_ref(), passed.machine.as_ref()), (Some(&here.commit), Some(&here.machine)));
    assert!(
        run("td3", 2)
            .command
            .as_ref()
            .is_some_and(|told| told.ends_with("--profile quick --seed 2 --attempts 1"))
    );
    let missed = run("td3", 1);
    assert_eq!(
        (missed.outcome, missed.note.as_deref()),
        (Outcome::Missed, Some("maze: success 10 %, 80 % needed"))
    );
    let failed = run("hybrid", 2);
    assert_eq!((failed.outcome, failed.env_steps), (Outcome::Failed, Some(500)));
    assert_eq!(failed.note.as_deref(), Some("the low level collapsed, \"it spins\""));
    assert!(stage.path("out/rows/td3/config.toml").is_file());

    let (is_well, text) = stage.run(&[]);
    assert!(is_well && text.contains("hybrid, seed 2: failed"), "{text}");
    assert_eq!(stage.calls(), std::slice::from_ref(report), "what is done is not done again");
    assert_eq!(stage.tables(), tables);
}

#[test]
fn killed_in_the_middle_it_goes_on() {
    let stage = Stage::new();
    let only = ["--only", "td3", "--lanes", "1"];
    // Killed while a trainer is at work, which goes on: it is waited for.
    stage.write("hold-train", "");
    let mut first = stage.start(&only);
    stage.wait_for("training");
    first.kill().expect("killed");
    first.wait().expect("it ends");
    let second = stage.start(&only);
    sleep(Duration::from_millis(300));
    let (is_well, text) = stage.run(&only);
    assert!(!is_well && text.contains("another study is under way"), "{text}");
    // Killed with its trainer: the run goes on from its checkpoint.
    stage.kill_stub();
    stage.wait_for("training");
    stage.remove("hold-train");
    stage.write("hold-evaluate", "");
    stage.wait_for("evaluating");
    let mut second = second;
    second.kill().expect("killed");
    let (_, text) = said(&second.wait_with_output().expect("it ends"));
    assert!(text.contains("td3, seed 1: training 50 %"), "half of the steps are done: {text}");
    stage.kill_stub();
    let calls = stage.calls();
    assert_eq!((count(&calls, "train --config"), count(&calls, "train --resume")), (1, 1), "{calls:?}");
    // The evaluation goes on after its second row, too.
    stage.remove("hold-evaluate");
    let (is_well, text) = stage.run(&only);
    assert!(is_well, "{text}");
    let calls = stage.calls();
    assert_eq!((count(&calls, "train --"), count(&calls, "--resume")), (1, 1), "the other seed; {calls:?}");
    assert_eq!(stage.tables().episodes.len(), 2 * 2 * 3 * 2);
}

#[test]
fn a_program_that_fails_holds_nothing_else_up() {
    let stage = Stage::new();
    stage.write("breaks", "td3\n");
    let (is_well, text) = stage.run(&["--lanes", "1"]);
    assert!(!is_well, "{text}");
    assert!(text.contains("td3, seed 1: error: the policy td3 cannot be driven"), "{text}");
    assert!(text.contains("td3, seed 1; td3, seed 2 did not come to an end"), "{text}");
    let calls = stage.calls();
    assert_eq!((count(&calls, "train --"), count(&calls, "study report")), (5, 1), "{calls:?}");
    assert_eq!(stage.tables().episodes.len(), 2 * 2 * 3 * (3 + 3 + 1));
    stage.remove("breaks");
    let (is_well, text) = stage.run(&[]);
    assert!(is_well, "{text}");
    let calls = stage.calls();
    assert_eq!((count(&calls, "train --"), count(&calls, "evaluate --policy td3=")), (0, 4), "{calls:?}");
    assert_eq!(calls.len(), 5, "{calls:?}");
}

#[test]
fn only_what_is_asked_for_is_done() {
    let stage = Stage::new();
    let (is_well, text) = stage.run(&["--only", "low,astar"]);
    assert!(is_well, "{text}");
    let calls = stage.calls();
    assert_eq!((count(&calls, "train --"), count(&calls, "evaluate --policy low=")), (3, 6), "{calls:?}");
    assert_eq!((count(&calls, "--policy astar=astar"), count(&calls, "--policy")), (2, 8), "{calls:?}");
    let (is_well, text) = stage.run(&["--only", "hybrid,sac"]);
    assert!(
        !is_well && text.contains("--only names \"sac\"") && text.contains("there are hybrid, td3"),
        "{text}"
    );
    assert!(stage.calls().is_empty());
}

#[test]
fn what_was_made_by_another_recipe_is_not_taken_for_this_one() {
    let stage = Stage::new();
    let only = ["--only", "hybrid"];
    assert!(stage.run(&only).0);
    stage.calls();
    stage.write("hybrid.toml", "# A remark.\nseed  = 5\n");
    let (is_well, text) = stage.run(&only);
    assert!(is_well && stage.calls().len() == 1, "{text}");
    // Other worlds are driven anew, with the same policies.
    stage.write("study.toml", &STUDY.replace("worlds = 3", "worlds = 4"));
    let (is_well, text) = stage.run(&only);
    let calls = stage.calls();
    assert!(
        is_well && (count(&calls, "train --"), count(&calls, "evaluate --")) == (0, 6),
        "{text} {calls:?}"
    );
    assert_eq!(stage.tables().episodes.len(), 2 * 2 * 4 * 3);
    // So is everything if the policy is another one.
    stage.write("work/hybrid/seed-1/policy.bin", "another");
    assert!(stage.run(&only).0);
    assert_eq!(count(&stage.calls(), "evaluate --"), 2);
    // Another configuration is refused.
    stage.write("hybrid.toml", "seed = 6\n");
    let (is_well, text) = stage.run(&only);
    assert!(!is_well && text.contains("was begun with another configuration"), "{text}");
}

#[test]
fn the_quick_study_is_one() {
    let stage = Stage::new();
    let (is_well, text) = said(&stage.command(&["--quick"]).output().expect("it ends"));
    assert!(is_well, "{text}");
    let calls = stage.calls();
    assert_eq!((count(&calls, "train --"), count(&calls, "evaluate --")), (6, 12), "{calls:?}");
    let tables = stage.tables();
    assert_eq!(tables.episodes.len() % 12, 0);
    assert!(
        tables.runs.iter().all(|run| run
            .command
            .as_ref()
            .is_some_and(|told| told.contains("--config study/configs/quick-")))
    );
}
