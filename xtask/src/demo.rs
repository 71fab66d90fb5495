//! The whole chain on a fresh clone: train, export, then simulator and runtime as two processes over
//! shared memory, on worlds that training never saw, and other policies on the same worlds.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use clap::Args;
use serde_json::Value;

use crate::shell::{print_line, remove_folder, root, run_shown, say};
use crate::training::{Training, short, trainer};
use crate::two_processes::{Drive, Score};
use crate::{libtorch, onnxruntime, programs};

/// How the simulated robot differs from a perfect one: noise, dropout, latency and drift.
const DISTURBANCE: &str = "usual";

/// Width of a policy's column.
const COLUMN: usize = 13;

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
    let flat = if options.model.is_none() {
        say("2/4 train (profile quick, five to six minutes on two cores) and export");
        Training { programs: &programs, seed: options.seed, model: &model, out: &out }.run().map(Some)?
    } else {
        say(&format!("2/4 no training: driving with {}", model.display()));
        None
    };
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
    say("4/4 compare: the same worlds in one process, and other policies on them");
    scores.extend(compare(options, &programs, &model, flat.as_deref(), &out.join("evaluate"))?);
    print_table(&options.families, &scores, options.worlds, flat.is_some());
    say(&format!("more figures: {}/evaluate/table.txt", short(&out)));
    say(&format!("pictures: {0}/FAMILY/ (two processes), {0}/evaluate/ (policies)", short(&out)));
    say("drive with it yourself, in two terminals:");
    say("  cargo simulator --world maze --view terminal --episodes 5");
    say(&format!("  cargo runtime --model {}", short(&model)));
    let seconds = started.elapsed().as_secs();
    say(&format!("done in {} min {:02} s", seconds / 60, seconds % 60));
    Ok(())
}

/// Evaluates the model and its rivals in one process and reads the summary.
fn compare(
    options: &Options,
    programs: &Path,
    model: &Path,
    flat: Option<&Path>,
    out: &Path,
) -> Result<Vec<Score>> {
    let td3 = match flat {
        Some(flat) => format!("td3={}", flat.display()),
        None => format!("td3=flat:{}", model.display()),
    };
    let mut evaluate = trainer(programs);
    evaluate
        .args(["evaluate", "--policy", &format!("hybrid={}", model.display()), "--policy", &td3])
        .args(["--policy", "astar", "--policy", "reactive", "--split", "test"])
        .args(["--families", &options.families.join(","), "--worlds", &options.worlds.to_string()])
        .args(["--disturbance", DISTURBANCE, "--out"])
        .arg(out);
    // The table below says it shorter; the whole one is in `table.txt`.
    run_shown(evaluate.stdout(Stdio::null()), "trainer evaluate")?;
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
                    "hybrid" => "in process".to_owned(),
                    rival => rival.to_owned(),
                },
                family: text("family").context("a summary names no family")?,
                success: row["success"].as_f64().context("a summary has no success rate")?,
                collision: row["collision"].as_f64().context("a summary has no collision rate")?,
            };
            Ok(score)
        })
        .collect()
}

/// One row a family, one column a policy, each with success and collision.
fn print_table(families: &[String], scores: &[Score], worlds: u32, is_flat_trained: bool) {
    let mut policies: Vec<&str> = Vec::new();
    for score in scores {
        if !policies.contains(&score.policy.as_str()) {
            policies.push(&score.policy);
        }
    }
    print_line(&format!("\n{worlds} held-out worlds a family: success % / collision %\n"));
    let heads = policies.iter().map(|policy| format!(" {policy:>COLUMN$}"));
    print_line(&format!("{:<10}{}", "family", heads.collect::<String>()));
    for family in families {
        let cells = policies.iter().map(|policy| {
            let score = scores.iter().find(|score| score.family == *family && score.policy == *policy);
            let cell = score.map_or_else(
                || "-".to_owned(),
                |score| format!("{:.1} / {:.1}", 100.0 * score.success, 100.0 * score.collision),
            );
            format!(" {cell:>COLUMN$}")
        });
        print_line(&format!("{family:<10}{}", cells.collect::<String>()));
    }
    let td3 = if is_flat_trained {
        "a flat TD3, trained for the goal alone with as many steps as the hybrid's low level"
    } else {
        "the hybrid's own TD3 without the DQN above it, straight at the goal"
    };
    print_line(&format!(
        "\ntd3: {td3}.\nastar: knows the whole map. reactive: steers by the newest scan alone.\n"
    ));
}
