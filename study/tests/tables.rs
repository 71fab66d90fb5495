//! Tables on disk: what the trainer wrote is read, what is damaged is refused.

mod support;

use std::fs;
use study::description::Metric;
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
fn what_results_keep_says_the_same_to_four_figures() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (from, to) = (folder.path().join("episodes.csv"), folder.path().join("kept/on.csv.gz"));
    fs::write(&from, include_str!("data/episodes.csv")).expect("written");
    fs::create_dir(folder.path().join("kept")).expect("made");
    rows::keep::episodes(&from, &to).expect("kept");
    let kept = rows::read(&[folder.path().join("kept")]).expect("tables").episodes;
    fs::remove_dir_all(folder.path().join("kept")).expect("removed");
    let whole = rows::read(&[folder.path().to_owned()]).expect("tables").episodes;
    assert_eq!(kept.len(), whole.len());
    let numbers = |row: &rows::EpisodeRow| {
        let some = [row.spl, row.path_efficiency].map(|number| number.unwrap_or(-1.0));
        [row.time_s, row.smoothness, row.clearance_min_m, row.spin, some[0], some[1]]
    };
    for ((_, kept), (_, whole)) in kept.iter().zip(&whole) {
        for (kept, whole) in numbers(kept).into_iter().zip(numbers(whole)) {
            assert!((kept - whole).abs() <= 5e-4 * whole.abs(), "{kept} of {whole}");
        }
        let labels = |row: &rows::EpisodeRow| {
            (row.policy.clone(), row.training_seed, row.family.clone(), row.world_seed, row.shield, row.end)
        };
        assert_eq!(labels(kept), labels(whole));
    }
    assert!(kept.iter().zip(&whole).any(|((_, kept), (_, whole))| kept != whole), "shorter");
}

#[test]
fn a_run_without_a_policy_counts_as_no_success_and_no_collision() {
    let stage = Stage::new();
    let study = Study::read(&stage.path("study.toml")).expect("a study");
    for gate in [Gate::Off, Gate::On] {
        let to = stage.path(&format!("rows/td3/seed-4/{}.csv.gz", gate.word()));
        rows::keep::no_policy(&study, 1, 4, gate, &to).expect("written");
    }
    let tables = rows::read(&[stage.path("rows")]).expect("tables");
    let cells = study::cells::Cells::sort(&study, &tables.episodes, &tables.files).expect("cells");
    assert!(cells.gaps.is_empty(), "every world counts: {:?}", cells.gaps);
    let run = &cells.runs(1, Gate::On, "maze").expect("rows")[&Some(4)];
    let sum = |metric: Metric| run.values().map(|episode| metric.of(episode)).sum::<f64>();
    assert_eq!(run.len(), 30);
    assert!(sum(Metric::Success).abs() + sum(Metric::Collision).abs() + sum(Metric::Spl).abs() < 1e-12);
}

#[test]
fn a_curve_without_families_is_refused_and_one_of_nobody_is_not_read() {
    let stage = Stage::new();
    let curve = "step,hybrid,clutter/success\n1,0,0.5\n";
    stage.write("rows/elsewhere/curve.csv", curve);
    let tables = rows::read(&[stage.path("rows")]).expect("tables");
    assert!(tables.unread.is_empty() && tables.curves.len() == 200, "{:?}", tables.unread);
    stage.write("rows/td3/seed-1/curve.csv", curve);
    let error = rows::read(&[stage.path("rows")]).map(|_| ()).expect_err("refused").to_string();
    assert!(error.contains("seed-1/curve.csv: row 1 has no FAMILY/collision"), "{error}");
}

#[test]
fn a_recipe_is_the_same_whatever_its_remarks_say() {
    let stage = Stage::new();
    let study = Study::read(&stage.path("study.toml")).expect("a study");
    let recipe = |run: usize| study.training_runs()[run].recipe().expect("a recipe");
    stage.write("configs/td3.toml", "[low]\nenvs = 4\nbatch = 32\n");
    let first = recipe(1);
    assert!(first.contains("seed 1") && recipe(0).contains("--profile quick") && recipe(3) != first);
    stage.write("configs/td3.toml", "# A remark.\n[low]\nbatch  = 32\nenvs = 4\n");
    assert_eq!(recipe(1), first);
    stage.write("configs/td3.toml", "[low]\nbatch = 64\nenvs = 4\n");
    assert_ne!(recipe(1), first);
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
