//! The trainer as people use it: train, be killed, resume, export, evaluate; and wrong inputs.

mod support;

use std::path::Path;
use std::process::Output;
use std::time::{Duration, Instant};
use support::{TINY, trainer};

fn run(folder: &Path, arguments: &[&str]) -> Output {
    trainer(folder, arguments).output().expect("the trainer starts")
}

fn succeed(folder: &Path, arguments: &[&str]) -> String {
    let output = run(folder, arguments);
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    assert!(output.status.success(), "{arguments:?} failed:\n{}", text(&output.stderr));
    text(&output.stdout) + &text(&output.stderr)
}

/// A refusal is one sentence on standard error and a non-zero exit code.
fn refuse(folder: &Path, arguments: &[&str]) -> String {
    let output = run(folder, arguments);
    let error = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!output.status.success(), "{arguments:?} should be refused");
    assert!(!error.contains("panicked") && error.contains("trainer: "), "{arguments:?}: {error}");
    error
}

#[test]
fn killed_resumed_exported_and_evaluated() {
    let folder = tempfile::tempdir().expect("a folder");
    let here = folder.path();
    // Long enough to be killed in its second stage.
    let config = TINY.replace("decisions = 1500", "decisions = 12000") + "[curve]\npoints = 5\nworlds = 2\n";
    std::fs::write(here.join("tiny.toml"), config).expect("written");

    let mut child = trainer(here, &["train", "--config", "tiny.toml", "--seed", "7", "--out", "runs/killed"])
        .stderr(std::process::Stdio::null())
        .spawn()
        .expect("the trainer starts");
    // The second stage begins with a checkpoint.
    let begun = Instant::now();
    let checkpoints = here.join("runs/killed/checkpoints");
    while std::fs::read_dir(&checkpoints).map_or(0, Iterator::count) == 0 {
        assert!(begun.elapsed() < Duration::from_secs(300), "no checkpoint");
        std::thread::sleep(Duration::from_millis(5));
    }
    let busy = refuse(here, &["train", "--resume", "runs/killed"]);
    assert!(busy.contains("another process is training"), "{busy}");
    child.kill().expect("killed");
    child.wait().expect("reaped");
    assert!(refuse(here, &["export", "--run", "runs/killed"]).contains("has not finished"));

    succeed(here, &["train", "--resume"]);
    assert!(
        succeed(here, &["train", "--config", "tiny.toml", "--seed", "7", "--out", "runs/whole"])
            .contains("gate passed")
    );
    succeed(here, &["export", "--run", "runs/killed", "--out", "killed"]);
    succeed(here, &["export", "--out", "whole"]);
    for file in ["td3.onnx", "dqn.onnx", "golden.json"] {
        let read = |model: &str| std::fs::read(here.join(model).join(file)).expect("exported");
        assert!(read("killed") == read("whole"), "{file}: a killed and resumed run differs from a whole one");
    }
    let scalars = |run: &str| std::fs::read_to_string(here.join(run).join("scalars.csv")).expect("logged");
    let table = scalars("runs/whole");
    assert_eq!(scalars("runs/killed"), table, "what is logged does not depend on the kill");
    let curve = |run: &str| std::fs::read_to_string(here.join(run).join("curve.csv")).expect("drawn");
    let drawn = curve("runs/whole");
    assert_eq!(curve("runs/killed"), drawn, "nor does the learning curve");
    let points = |of: &str| drawn.lines().filter(|row| row.split(',').nth(1) == Some(of)).count();
    assert!(drawn.starts_with("step,hybrid,clutter/success,"), "{drawn}");
    assert_eq!((points("0"), points("1")), (5, 5), "{drawn}");
    for tag in [
        "dqn/q_bias",
        "high/discounted_return",
        "gate/missed",
        "gate/u_trap_success",
        "gate/flat_clutter_spin",
    ] {
        assert!(
            table.lines().next().is_some_and(|header| header.split(',').any(|name| name == tag)),
            "{tag}: {table}"
        );
    }
    let no_sign =
        |field: &str| !field.starts_with('-') || field.parse::<f64>().is_ok_and(|value| value < 0.0);
    assert!(table.split([',', '\n']).all(no_sign), "{table}");

    let arguments =
        ["evaluate", "--model", "whole", "--families", "clutter", "--worlds", "2", "--out", "eval"];
    let table = succeed(here, &arguments);
    for policy in ["hybrid", "td3", "astar", "dijkstra", "reactive", "clairvoyant"] {
        assert!(table.contains(policy), "{table}");
        assert!(here.join("eval").join(format!("{policy}.png")).exists());
    }
    let rows = std::fs::read_to_string(here.join("eval/episodes.csv")).expect("written");
    assert_eq!(rows.lines().count(), 1 + 6 * 2);
}

#[test]
fn a_learning_curve_changes_nothing_of_the_training() {
    let folder = tempfile::tempdir().expect("a folder");
    let here = folder.path();
    let scalars = |name: &str, config: String| {
        std::fs::write(here.join("tiny.toml"), config).expect("written");
        let out = format!("runs/{name}");
        succeed(here, &["train", "--algorithm", "td3", "--config", "tiny.toml", "--out", &out]);
        std::fs::read_to_string(here.join(out).join("scalars.csv")).expect("logged")
    };
    let without = scalars("without", TINY.to_owned());
    let with = scalars("with", format!("{TINY}[curve]\npoints = 3\nworlds = 1\n"));
    assert_eq!(with, without);
    assert!(here.join("runs/with/curve.csv").exists() && !here.join("runs/without/curve.csv").exists());
}

#[test]
fn a_flat_policy_and_a_dqn_above_a_borrowed_low_level() {
    fn train<'a>(more: &[&'a str]) -> Vec<&'a str> {
        [&["train", "--config", "tiny.toml"], more].concat()
    }
    let folder = tempfile::tempdir().expect("a folder");
    let here = folder.path();
    std::fs::write(here.join("tiny.toml"), TINY).expect("written");
    succeed(here, &train(&["--algorithm", "td3", "--out", "runs/flat"]));
    let typo = refuse(here, &train(&["--algorithm", "dqn", "--low", "runs/typo", "--out", "runs/dqn"]));
    assert!(typo.contains("runs/typo holds no run"), "{typo}");
    assert!(!here.join("runs/dqn").exists(), "a refused run leaves no folder that --resume would take");
    assert!(refuse(here, &train(&["--algorithm", "dqn"])).contains("--low"));
    succeed(here, &train(&["--algorithm", "dqn", "--low", "runs/flat", "--out", "runs/dqn"]));
    succeed(here, &["export", "--run", "runs/dqn", "--out", "hybrid"]);
    succeed(here, &["export", "--run", "runs/flat", "--out", "flat"]);
    assert!(here.join("hybrid/dqn.onnx").exists() && !here.join("flat/dqn.onnx").exists());
    for flat in ["flat", "runs/flat"] {
        let table = succeed(
            here,
            &[
                "evaluate",
                "--policy",
                "hybrid=hybrid",
                "--policy",
                &format!("td3={flat}"),
                "--policy",
                "own=flat:runs/dqn",
                "--families",
                "clutter",
                "--worlds",
                "2",
                "--out",
                "eval",
                "--pictures",
                "0",
            ],
        );
        assert!(["hybrid", "td3", "own"].iter().all(|policy| table.contains(policy)), "{table}");
        // Exported or not, the same networks drive the same way.
        let rows = nav_env::rows::read_rows(&here.join("eval/episodes.csv")).expect("rows");
        let poses = |policy: &str| {
            let own = rows.iter().filter(|row| row.policy == policy);
            own.map(|row| (row.path_m.to_bits(), row.steps, row.training_seed)).collect::<Vec<_>>()
        };
        assert_eq!(poses("td3"), poses("own"));
    }
    assert!(
        refuse(here, &["evaluate", "--model", "hybrid", "--families", "clutter,clutter"]).contains("twice")
    );
}

#[test]
fn wrong_inputs_are_refused_in_a_sentence() {
    let folder = tempfile::tempdir().expect("a folder");
    let here = folder.path();
    assert!(refuse(here, &["export"]).contains("trainer train"));
    assert!(refuse(here, &["train", "--resume"]).contains("no unfinished run"));
    assert!(refuse(here, &["train", "--config", "absent.toml"]).contains("absent.toml"));
    std::fs::write(here.join("typo.toml"), "[high]\ndecision = 3").expect("written");
    assert!(refuse(here, &["train", "--config", "typo.toml"]).contains("unknown field `high.decision`"));
    assert!(refuse(here, &["evaluate", "--model", "absent"]).contains("there is no model in absent"));
    std::fs::write(
        here.join("strict.toml"),
        format!("{TINY}\nlow_reach = 1.0").replacen("low_reach = 0.0\n", "", 1),
    )
    .expect("written");
    let strict = ["train", "--config", "strict.toml", "--out", "runs/strict"];
    let missed = [&strict[..], &["export"], &["train", "--resume", "runs/strict"]]
        .map(|arguments| refuse(here, arguments));
    for error in missed {
        assert!(error.contains("gate") && error.contains("reach is") && error.contains("--seed"), "{error}");
    }
    assert!(!here.join("models").exists(), "a refused export leaves nothing");
}

#[test]
fn a_collapsed_run_is_stopped_before_its_time_and_names_a_way_on() {
    let folder = tempfile::tempdir().expect("a folder");
    let here = folder.path();
    // Subgoals out of reach, and an actor that begins in the flat ends of tanh.
    let collapsing = TINY
        .replacen("[low]\n", "[low]\ngoal_share = 0.0\nsubgoal_m = [2.5, 3.0]\nsubgoal_s = 0.1\n", 1)
        .replacen("env_steps = 3000", "env_steps = 60000", 1)
        .replacen("td3.hidden = [16]", "td3.hidden = [16]\ntd3.actor_output_gain = 100.0", 1);
    std::fs::write(here.join("collapsing.toml"), &collapsing).expect("written");
    let error = refuse(here, &["train", "--config", "collapsing.toml", "--out", "runs/collapsed"]);
    assert!(
        error.contains("collapsed") && error.contains("saturated") && error.contains("--seed"),
        "{error}"
    );
    assert!(!error.contains("high level"), "no time is spent on the next stage: {error}");
    assert!(!here.join("runs/collapsed/policy.bin").exists());
    assert!(refuse(here, &["train", "--resume"]).contains("no unfinished run"));
    for arguments in [["train", "--resume", "runs/collapsed"], ["export", "--run", "runs/collapsed"]] {
        let error = refuse(here, &arguments);
        assert!(error.contains("collapsed") && error.contains("--seed"), "{error}");
    }
    let careless = format!("{collapsing}\n[low.collapse]\nfrom_share = 1.0").replacen("60000", "9000", 1);
    std::fs::write(here.join("careless.toml"), careless).expect("written");
    succeed(here, &["train", "--config", "careless.toml", "--out", "runs/careless"]);
}
