//! `trainer evaluate`: policies on shared held-out worlds, through the runtime's own controller.
//!
//! Reading order: [`nav_env::robot`] (one episode), [`nav_env::batch`] (many), [`nav_rivals`], [`report`].

pub mod report;

use anyhow::{Context, Result, ensure};
use indicatif::{ProgressBar, ProgressStyle};
use nav_core::manifest::Algorithm;
use nav_core::task::Task;
use nav_env::batch::{BatchOptions, drive_all};
use nav_env::robot::Driven;
use nav_env::worlds::{Place, generate_places};
use nav_host::terminal::say;
use nav_model::model::Model;
use nav_rivals::planner::{KnownMapPlanner, Search};
use nav_rivals::reactive::Reactive;
use nav_sim::disturbance::Disturbance;
use nav_sim::drawing::{EpisodeTrace, svg_sheet, write_picture};
use serde::Serialize;
use std::path::Path;

use crate::cli::{EvaluateArgs, PolicyName};
use crate::train::policy::Policy;
use crate::train::run_folder::RunFolder;
use report::{EpisodeRow, Summary};

/// Traced episodes and whose they are.
type Traces = Vec<(PolicyName, EpisodeTrace)>;

/// What was evaluated, for the JSON report.
#[derive(Debug, Serialize)]
struct Report<'a> {
    command: String,
    commit: String,
    model_commit: &'a str,
    model_seed: u64,
    flat_policy: &'a str,
    split: String,
    worlds_per_family: u64,
    disturbance: Disturbance,
    summaries: &'a [Summary],
}

/// Evaluates, prints the table and writes the reports.
///
/// # Errors
/// A model that cannot be driven, or files that cannot be written.
pub fn evaluate(args: &EvaluateArgs) -> Result<()> {
    ensure!(args.worlds > 0, "--worlds must be at least 1");
    ensure!(args.threads > 0, "--threads must be at least 1");
    refuse_twice("--families", &args.families)?;
    refuse_twice("--policies", &args.policies)?;
    let model = Model::read(&args.model)?;
    if args.policies.contains(&PolicyName::Hybrid) {
        ensure!(
            model.manifest().algorithm == Algorithm::Hybrid,
            "{} is a flat model: evaluate it with --policies td3",
            args.model.display()
        );
    }
    let task = model.manifest().task;
    if let Some(folder) = &args.flat_model {
        ensure!(
            same_world(&Flat::read(folder)?.task(), &task),
            "{} was trained for another robot, lidar or episode than {}: they cannot share worlds",
            folder.display(),
            args.model.display()
        );
    }
    let disturbance = args.disturbance.disturbance();
    let places = generate_places(&args.families, args.split, 0..args.worlds, task.robot.radius_m);
    let (rows, traces) = drive_policies(args, &task, &disturbance, &places)?;
    let summaries = report::summarise(&rows);
    let table = report::table(&summaries);
    say(table.trim_end());
    let report = Report {
        command: std::env::args().collect::<Vec<_>>().join(" "),
        commit: crate::commit::commit(),
        model_commit: &model.manifest().trainer_commit,
        model_seed: model.manifest().seed,
        flat_policy: match &args.flat_model {
            Some(_) => "a TD3 trained for the goal alone (--flat-model)",
            None => "the model's own TD3, driven straight at the goal",
        },
        split: args.split.to_string(),
        worlds_per_family: args.worlds,
        disturbance,
        summaries: &summaries,
    };
    report::write(&args.out.join("table.txt"), &table)?;
    report::write(&args.out.join("episodes.csv"), &report::csv(&rows))?;
    report::write(&args.out.join("summary.json"), &serde_json::to_string_pretty(&report)?)?;
    draw(args, &traces)?;
    say(format_args!("\ntable.txt, episodes.csv, summary.json and pictures are in {}", args.out.display()));
    Ok(())
}

/// What drives as `td3`.
enum Flat {
    /// An exported model.
    Exported(Box<Model>),
    /// A finished run: a rival need not be good enough to be exported.
    Trained(Box<Policy>),
}

impl Flat {
    fn read(folder: &Path) -> Result<Self> {
        match RunFolder::open(folder) {
            Ok(run) => Ok(Self::Trained(Box::new(run.policy()?))),
            Err(_) => Ok(Self::Exported(Box::new(Model::read(folder)?))),
        }
    }

    fn task(&self) -> Task {
        match self {
            Self::Exported(model) => model.manifest().task,
            Self::Trained(policy) => policy.task,
        }
    }
}

/// An entry that counts twice would make intervals narrower than they are.
fn refuse_twice<T: PartialEq>(flag: &str, entries: &[T]) -> Result<()> {
    let is_twice = entries.iter().enumerate().any(|(index, entry)| entries[..index].contains(entry));
    ensure!(!is_twice, "{flag} names something twice");
    Ok(())
}

fn same_world(a: &Task, b: &Task) -> bool {
    Task { decision: b.decision, ..*a } == *b
}

fn drive_policies(
    args: &EvaluateArgs,
    task: &Task,
    disturbance: &Disturbance,
    places: &[Place],
) -> Result<(Vec<EpisodeRow>, Traces)> {
    let bar = ProgressBar::new(places.len() as u64 * args.policies.len() as u64).with_style(
        ProgressStyle::with_template("{bar:30} {pos}/{len} episodes, {eta} left  {msg}")
            .context("the bar's template")?,
    );
    let (mut rows, mut traces) = (Vec::new(), Vec::new());
    for &policy in &args.policies {
        bar.set_message(name(policy));
        for places in places.chunks(args.worlds as usize) {
            let options = BatchOptions { task, disturbance, threads: args.threads, traces: args.pictures };
            let driven = drive_policy(args, policy, task, places, &options, || bar.inc(1))?;
            for (place, driven) in places.iter().zip(driven) {
                rows.push(EpisodeRow {
                    policy: name(policy).to_owned(),
                    family: place.scene.to_string(),
                    seed: place.seed,
                    metrics: driven.metrics,
                    tick_mean_ns: driven.tick_mean_ns,
                    tick_max_ns: driven.tick_max_ns,
                });
                traces.extend(driven.trace.map(|trace| (policy, trace)));
            }
        }
    }
    bar.finish_and_clear();
    Ok((rows, traces))
}

fn drive_policy(
    args: &EvaluateArgs,
    policy: PolicyName,
    task: &Task,
    places: &[Place],
    options: &BatchOptions<'_>,
    progress: impl Fn() + Sync,
) -> Result<Vec<Driven>> {
    // Loaded once before the threads, so that an error is a sentence and not a panic.
    let read = |folder: &std::path::Path| Model::read(folder).expect("it was read a moment ago");
    let planner = |search| drive_all(|| KnownMapPlanner::new(search, task), places, options, &progress);
    Ok(match policy {
        PolicyName::Hybrid => {
            let make = || read(&args.model).into_controller().expect("it was checked when read");
            drive_all(make, places, options, &progress)
        }
        PolicyName::Td3 => match Flat::read(args.flat_model.as_ref().unwrap_or(&args.model))? {
            Flat::Exported(model) => {
                let folder = model.folder().to_owned();
                let make = || read(&folder).into_flat_controller().expect("it was checked when read");
                drive_all(make, places, options, &progress)
            }
            Flat::Trained(policy) => {
                let make = || policy.flat_controller().expect("its weights are whole");
                make();
                drive_all(make, places, options, &progress)
            }
        },
        PolicyName::Astar => planner(Search::AStar),
        PolicyName::Dijkstra => planner(Search::Dijkstra),
        PolicyName::Reactive => drive_all(|| Reactive::new(task), places, options, &progress),
    })
}

/// What a policy is called in tables.
fn name(policy: PolicyName) -> &'static str {
    match policy {
        PolicyName::Hybrid => "hybrid",
        PolicyName::Td3 => "td3",
        PolicyName::Astar => "astar",
        PolicyName::Dijkstra => "dijkstra",
        PolicyName::Reactive => "reactive",
    }
}

/// One sheet a policy.
fn draw(args: &EvaluateArgs, traces: &[(PolicyName, EpisodeTrace)]) -> Result<()> {
    for &policy in &args.policies {
        let own: Vec<EpisodeTrace> =
            traces.iter().filter(|(of, _)| *of == policy).map(|(_, trace)| trace.clone()).collect();
        if own.is_empty() {
            continue;
        }
        let sheet = svg_sheet(&own, 3);
        for extension in ["svg", "png"] {
            let path = args.out.join(format!("{}.{extension}", name(policy)));
            write_picture(&path, &sheet).with_context(|| format!("cannot draw {}", path.display()))?;
        }
    }
    Ok(())
}
