//! Tables on disk: what the trainer wrote is read, what is damaged is refused.

mod support;

use std::fs;
use study::plan::Study;
use study::rows::{self, End, Gate};
use support::Stage;

/// Rows of a real evaluation.
#[test]
fn rows_of_the_trainer_are_read() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    fs::write(folder.path().join("episodes.csv"), include_str!("data/episodes.csv")).expect("written");
    let tables = rows::read(&[folder.path().to_owned()]).expect("tables");
    assert_eq!(tables.episodes.len(), 24);
    let (_, first) = &tables.episodes[0];
    assert_eq!(
        (first.policy.as_str(), first.training_seed, first.shield),
        ("hybrid", Some(5), Some(Gate::On))
    );
    assert_eq!((first.family.as_deref(), first.split.as_deref()), (Some("maze"), Some("validation")));
    assert!(tables.episodes.iter().any(|(_, row)| row.end != End::Success && row.path_efficiency.is_none()));
    assert!(tables.episodes.iter().any(|(_, row)| row.training_seed.is_none()), "the rivals");
}

#[test]
fn what_is_damaged_is_refused_with_its_name() {
    let stage = Stage::new();
    let read = || rows::read(&[stage.path("rows")]).map(|_| ()).expect_err("damaged").to_string();
    let whole = fs::read(stage.path("rows/reactive/on.csv")).expect("rows");
    fs::write(stage.path("rows/reactive/on.csv"), &whole[..whole.len() - 40]).expect("written");
    let error = read();
    assert!(error.contains("on.csv") && error.contains("cut short") && error.contains("--resume"), "{error}");
    fs::write(stage.path("rows/reactive/on.csv"), &whole).expect("written");
    let path = stage.path("rows/td3/seed-1/on.csv.gz");
    let compressed = fs::read(&path).expect("rows");
    fs::write(&path, &compressed[..compressed.len() / 2]).expect("written");
    let error = read();
    assert!(error.contains("td3/seed-1/on.csv.gz"), "{error}");
}

#[test]
fn a_folder_without_rows_is_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let error = rows::read(&[folder.path().to_owned()]).expect_err("empty").to_string();
    assert!(error.contains("no evaluation rows below"), "{error}");
    let error = rows::read(&[folder.path().join("none")]).expect_err("not there").to_string();
    assert!(error.contains("cannot read"), "{error}");
}

#[test]
fn jobs_say_what_to_run() {
    let stage = Stage::new();
    let study = Study::read(&stage.path("study.toml")).expect("a study");
    let runs = study.training_runs();
    assert_eq!(runs.len(), 20, "the low level and the rival are not trained");
    let words = |arguments: &[std::ffi::OsString]| {
        arguments.iter().map(|word| word.to_string_lossy().into_owned()).collect::<Vec<_>>().join(" ")
    };
    let config = stage.path("configs/hybrid.toml").display().to_string();
    assert_eq!(
        words(&runs[0].arguments),
        format!("train --config {config} --profile quick --seed 1 --attempts 1")
    );
    assert_eq!((runs[1].method, runs[1].seed, runs[2].seed), (1, 1, 2), "whole seeds first");
    assert_eq!(runs[19].folder, std::path::Path::new("td3/seed-10"));
    let policy =
        |method, seed| study.policy_argument(method, seed, "runs".as_ref()).to_string_lossy().into_owned();
    assert_eq!(policy(0, Some(3)), "hybrid=runs/hybrid/seed-3");
    assert_eq!(policy(2, Some(3)), "low=flat:runs/hybrid/seed-3");
    assert_eq!(policy(3, None), "reactive=reactive");
    assert_eq!(
        words(&study.evaluate_arguments(1, Some(2), Gate::Off, "runs".as_ref())),
        "evaluate --policy td3=runs/td3/seed-2 --families clutter,maze --worlds 30 --split test --disturbance usual \
         --shield off --pictures 0"
    );
}
