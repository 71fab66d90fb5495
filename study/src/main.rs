//! The `study` program.

use anyhow::{Context, Result};
use clap::{CommandFactory, Parser, Subcommand};
use nav_host::exit::Exit;
use nav_host::terminal::{LogArguments, say, warn};
use std::path::PathBuf;
use study::plan::Study;
use study::report::{self, Provenance, gallery};
use study::rows;

/// Judges a study: evaluation rows in, statistics, figures and a report out.
#[derive(Debug, Parser)]
#[command(
    name = "study",
    version,
    after_help = "Exit status: 0 when done, 1 on an error, 2 when the command line makes no sense."
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    /// How much to say.
    #[command(flatten)]
    log: LogArguments,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Writes the report of a study: one page, its figures as SVG and PNG, its tables as CSV.
    Report(ReportArgs),
    /// Says whether a study's description makes sense, and what it asks for.
    Check {
        /// The description.
        #[arg(long, value_name = "FILE", default_value = "study/paper.toml")]
        study: PathBuf,
    },
}

#[derive(Debug, clap::Args)]
#[command(after_help = "\
Tables are known by their columns, whatever they are called: evaluation rows as `trainer evaluate` writes them \
(policy, world_seed, end, ...), learning curves as `trainer train` writes them \
(METHOD/seed-N/curve.csv, with scalars.csv beside it), and runs (method, training_seed, outcome, train_s, env_steps, updates, commit, machine, command, note). A row belongs to the \
method whose name its policy is.
Example:
  study report --study study/paper.toml --rows results/study --out out/study")]
struct ReportArgs {
    /// What is compared, with whom, on what; study/paper.toml is one to copy.
    #[arg(long, value_name = "FILE", default_value = "study/paper.toml")]
    study: PathBuf,
    /// A folder with tables, *.csv and *.csv.gz, itself and all below it; any number of times.
    #[arg(long, value_name = "FOLDER", required = true)]
    rows: Vec<PathBuf>,
    /// A folder of pictures, *.svg, as `trainer evaluate --pictures` draws them: wins and losses to be looked at, each under its
    /// file's name.
    #[arg(long, value_name = "FOLDER")]
    gallery: Option<PathBuf>,
    /// Where the report goes.
    #[arg(long, value_name = "FOLDER", default_value = "out/study")]
    out: PathBuf,
}

fn main() -> Exit {
    if let Some(exit) = nav_host::manual::printed(Cli::command()) {
        return exit;
    }
    let cli = Cli::parse();
    cli.log.apply();
    let result = match &cli.command {
        Command::Report(args) => report(args),
        Command::Check { study } => check(study),
    };
    Exit::of("study", result.map(|()| Exit::Done))
}

fn report(args: &ReportArgs) -> Result<()> {
    let study = Study::read(&args.study).context("--study")?;
    let tables = rows::read(&args.rows).context("--rows")?;
    let pictures = args.gallery.as_deref().map_or(Ok(Vec::new()), gallery::read).context("--gallery")?;
    let written =
        report::write(&study, &tables, &pictures, &Provenance::here(), &args.out).context("no report")?;
    if written.gaps > 0 {
        warn(format_args!(
            "what the study names is missing in {} places of these rows; the report says where",
            written.gaps
        ));
    }
    say(format_args!("the report is {}", written.page.display()));
    Ok(())
}

fn check(path: &std::path::Path) -> Result<()> {
    let study = Study::read(path).context("--study")?;
    let runs = study.training_runs();
    let arms = study.methods.iter().map(|method| method.row_seeds().len()).sum::<usize>() * study.gates.len();
    say(format_args!(
        "{} methods, {} training runs of {} steps, {} episodes, {} primary comparisons",
        study.methods.len(),
        runs.len(),
        study.env_steps,
        arms as u64 * study.worlds * study.families.len() as u64,
        study.primaries.len()
    ));
    Ok(())
}
