//! The whole chain on a fresh clone: train, export, then simulator and runtime as two processes over
//! shared memory, on worlds that training never saw, and other policies on the same worlds.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use clap::Args;
use serde_json::Value;

use crate::shell::{remove_folder, root, run_shown, say};
use crate::two_processes::{Drive, Score};
use crate::{libtorch, onnxruntime, programs};

/// How the simulated robot differs from a perfect one: noise, dropout, latency and drift.
const DISTURBANCE: &str = "trained";

/// What the demo does.
#[derive(Args)]
pub(crate) struct Options {
    /// Drive with this exported model (as `models`) instead of training one
    #[arg(long, value_name = "FOLDER")]
    model: Option<PathBuf>,
    /// Worlds a family
    #[arg(long, default_value_t = 50, value_parser = clap::value_parser!(u32).range(1..))]
    worlds: u32,
    /// Families of worlds to drive in
    #[arg(long, value_delimiter = ',', default_value = "clutter,u_trap,rooms,crowd")]
    families: Vec<String>,
    /// Seed of the training run [default: the trainer's own]
    #[arg(long, conflicts_with = "model")]
    seed: Option<u64>,
}

/// Runs the demo.
///
/// # Errors
/// The first step that fails, named.
pub(crate) fn run(options: &Options) -> Result<()> {
    let started = Instant::now();
    let out = root().join("out/demo");
    let model = match &options.model {
        // Relative to where the user stands.
        Some(folder) => std::path::absolute(folder)?,
        None => out.join("models"),
    };
    if options.model.is_some() && !model.join("manifest.json").exists() {
        bail!(
            "{} holds no manifest.json; --model needs a folder made by `cargo trainer export`",
            model.display()
        );
    }
    if model.starts_with(&out) && options.model.is_some() {
        bail!("the demo empties {} first; copy the model elsewhere for --model", out.display());
    }
    libtorch::set_up(None)?;
    onnxruntime::set_up()?;
    say("1/4 build");
    let programs = programs::build(&["trainer", "runtime", "simulator"])?;
    remove_folder(&out)?;
    fs::create_dir_all(&out).with_context(|| format!("could not create {}", out.display()))?;
    if options.model.is_none() {
        train_and_export(options, &programs, &model)?;
    } else {
        say(&format!("2/4 no training: driving with {}", model.display()));
    }
    say("3/4 drive: simulator and runtime as two processes, on worlds that training never saw");
    let mut scores = Vec::new();
    for family in &options.families {
        let drive = Drive {
            programs: &programs,
            model: &model,
            family,
            worlds: options.worlds,
            disturbance: DISTURBANCE,
            out: &out,
        };
        let score = drive.run()?;
        say(&format!("  {family}: {:.1} % of {} worlds", score.success * 100.0, options.worlds));
        scores.push(score);
    }
    say("4/4 compare: the same worlds in one process, with other policies beside");
    scores.extend(compare(options, &programs, &model, &out.join("evaluate"))?);
    print_table(&options.families, &scores, options.worlds);
    let short = |path: &Path| path.strip_prefix(root()).unwrap_or(path).display().to_string();
    say(&format!("pictures: {0}/FAMILY/ (two processes), {0}/evaluate/ (policies)", short(&out)));
    say("drive with it yourself, in two terminals:");
    say("  cargo simulator --world maze --view terminal --episodes 5");
    say(&format!("  cargo runtime --model {}", short(&model)));
    let seconds = started.elapsed().as_secs();
    say(&format!("done in {} min {:02} s", seconds / 60, seconds % 60));
    Ok(())
}

fn train_and_export(options: &Options, programs: &Path, model: &Path) -> Result<()> {
    let run = root().join("runs/demo");
    remove_folder(&run)?;
    say("2/4 train (profile quick, about six minutes on two cores) and export");
    let mut train = trainer(programs);
    train.args(["train", "--profile", "quick", "--out"]).arg(&run);
    if let Some(seed) = options.seed {
        train.args(["--seed", &seed.to_string()]);
    }
    run_shown(&mut train, "trainer train")?;
    let mut export = trainer(programs);
    export.args(["export", "--run"]).arg(&run).arg("--out").arg(model);
    run_shown(&mut export, "trainer export")
}

/// Evaluates the model and its rivals in one process and reads the summary.
fn compare(options: &Options, programs: &Path, model: &Path, out: &Path) -> Result<Vec<Score>> {
    let mut evaluate = trainer(programs);
    evaluate
        .args(["evaluate", "--policies", "hybrid,td3,astar,reactive", "--split", "test"])
        .args(["--families", &options.families.join(","), "--worlds", &options.worlds.to_string()])
        .args(["--disturbance", DISTURBANCE, "--model"])
        .arg(model)
        .arg("--out")
        .arg(out);
    run_shown(&mut evaluate, "trainer evaluate")?;
    let path = out.join("summary.json");
    let text = fs::read_to_string(&path).with_context(|| format!("evaluate left no {}", path.display()))?;
    let report: Value =
        serde_json::from_str(&text).with_context(|| format!("{} is no JSON", path.display()))?;
    let rows = report["summaries"].as_array();
    let rows = rows.with_context(|| format!("{} has no list `summaries`", path.display()))?;
    rows.iter()
        .map(|row| {
            let text = |name: &str| row[name].as_str().map(str::to_owned);
            let score = Score {
                policy: match text("policy").context("a summary names no policy")?.as_str() {
                    "hybrid" => "hybrid, one process".to_owned(),
                    rival => rival.to_owned(),
                },
                family: text("family").context("a summary names no family")?,
                success: row["success"].as_f64().context("a summary has no success rate")?,
                collision: row["collision"].as_f64().context("a summary has no collision rate")?,
                time_s: row["time_s"].as_f64(),
            };
            Ok(score)
        })
        .collect()
}

fn trainer(programs: &Path) -> Command {
    let mut command = Command::new(programs.join("trainer"));
    command.current_dir(root());
    command
}

fn print_table(families: &[String], scores: &[Score], worlds: u32) {
    println!("\n{worlds} held-out worlds a family\n");
    println!("{:<10} {:<22} {:>9} {:>11} {:>8}", "family", "policy", "success %", "collision %", "time s");
    for family in families {
        for score in scores.iter().filter(|score| score.family == *family) {
            let time = score.time_s.map_or_else(|| "-".to_owned(), |time_s| format!("{time_s:.1}"));
            println!(
                "{:<10} {:<22} {:>9.1} {:>11.1} {:>8}",
                family,
                score.policy,
                score.success * 100.0,
                score.collision * 100.0,
                time
            );
        }
    }
    println!(
        "\ntd3: the same TD3 without the DQN above it, straight at the goal. astar: knows the whole map.\n"
    );
}
