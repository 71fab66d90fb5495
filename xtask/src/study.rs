//! A study from its description to its report: what is missing is trained, so many runs at a time, then driven without and with
//! the safety gate, then judged. Started again, it goes on, whatever ended it: a run from its last checkpoint, an evaluation
//! from its last row.
//!
//! | file | holds |
//! |---|---|
//! | [`mod@unit`] | a training run with everything that is driven with what it left |
//! | [`board`] | the table of all runs while they are under way |
//! | [`results`] | the folder of results |

mod board;
mod results;
mod unit;

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use anyhow::{Context, Result, bail, ensure};
use clap::Args;
use study::plan::Study;
use study::provenance::Provenance;

use crate::lanes::side_by_side;
use crate::shell::{root, say};
use crate::training::short;
use crate::{libtorch, programs};
use board::{Board, Cell, title};
use results::Results;
use unit::{Setting, Unit, units};

/// What is studied, and where it goes.
#[derive(Args)]
#[command(after_help = "\
A study is a TOML file: methods, training seeds, families of worlds, questions. study/paper.toml is the committed one, \
study/quick.toml a small one. To learn whether a change of yours helps, copy one of them, name your configuration as a \
method's `train`, and ask for it among the primaries.
Whatever ends it (Ctrl-C, a kill, a power cut), the same command goes on. A training run that misses its gate or \
collapses is a result like any other.
Examples:
  cargo xtask study --quick                        hybrid against flat TD3 in a quarter of an hour
  cargo xtask study --only hybrid,td3              the headline first
  cargo xtask study --study mine.toml --out out/mine
  cargo xtask study --out results/study            the committed study where it is committed (days)")]
pub(crate) struct Options {
    /// The study [default: study/paper.toml]
    #[arg(long, value_name = "FILE")]
    study: Option<PathBuf>,
    /// Take study/quick.toml: two families, two methods, three seeds, at most 15 minutes on two cores
    #[arg(long, conflicts_with = "study")]
    quick: bool,
    /// Train and drive these methods only, by their names in the study; the report tells what is missing of the others
    #[arg(long, value_delimiter = ',', value_name = "METHODS")]
    only: Vec<String>,
    /// Runs side by side, one a core
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u16).range(1..=64))]
    lanes: u16,
    /// Where runs and logs are kept, and what is done already is found [default: runs/study/ and the study's file name]
    #[arg(long, value_name = "FOLDER")]
    work: Option<PathBuf>,
    /// Where the report and its rows go, these as they come [default: out/study/ and the study's file name]
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    /// Start trainer and study from this folder instead of building them
    #[arg(long, value_name = "FOLDER")]
    programs: Option<PathBuf>,
}

impl Options {
    /// Where the study lies; that of the workspace is found from everywhere.
    fn study(&self) -> Result<PathBuf> {
        let own = root().join(if self.quick { "study/quick.toml" } else { "study/paper.toml" });
        Ok(self.study.as_ref().map(std::path::absolute).transpose()?.unwrap_or(own))
    }

    /// A folder that was named, or the study's own below another.
    fn folder(named: Option<&PathBuf>, below: &str, study: &Study) -> Result<PathBuf> {
        let own = || root().join(below).join(study.path.file_stem().unwrap_or_default());
        Ok(named.map(std::path::absolute).transpose()?.unwrap_or_else(own))
    }
}

/// Trains, drives and judges what is missing.
///
/// # Errors
/// A study that makes no sense, programs that fail (the others go on meanwhile), or files that cannot be written.
pub(crate) fn run(options: &Options) -> Result<()> {
    let study = Study::read(&options.study()?).context("--study")?;
    let only = chosen(&options.only, &study)?;
    let programs = match &options.programs {
        Some(folder) => std::path::absolute(folder)?,
        None => {
            libtorch::set_up(None)?;
            programs::build(&["trainer", "study"])?
        }
    };
    let work = Options::folder(options.work.as_ref(), "runs/study", &study)?;
    let out = Options::folder(options.out.as_ref(), "out/study", &study)?;
    let _lock = own(&work)?;
    let units = units(&study, |method| only.contains(&method));
    let board = Board::new(cells(&study, &units));
    let results = Results { study: &study, out: &out };
    let setting = Setting {
        study: &study,
        programs: &programs,
        work: &work,
        results: &results,
        board: &board,
        provenance: &Provenance::at(&root()),
    };
    say(&format!(
        "{} runs and classical methods of {}, {} side by side; logs are in {}",
        units.len(),
        short(&study.path),
        options.lanes,
        short(&work)
    ));
    let failed = Mutex::new(Vec::new());
    side_by_side(units, options.lanes.into(), |unit| {
        if let Err(error) = unit.run(&setting) {
            unit.driven.iter().for_each(|&method| unit.tell(&setting, method, Cell::Error));
            let name = title(&study.methods[unit.driven[0]].name, unit.seed());
            board.say(&format!("{name}: {error:#}"));
            failed.lock().unwrap_or_else(PoisonError::into_inner).push(name);
        }
        Ok(())
    })?;
    board.finish();
    let failed = failed.into_inner().unwrap_or_else(PoisonError::into_inner);
    let reported = results.report(&work, &programs);
    if !failed.is_empty() {
        let report = if reported.is_ok() { "the report is of the others" } else { "there is no report" };
        bail!(
            "{} did not come to an end, as told above; {report}; started again, they are tried again",
            failed.join("; ")
        );
    }
    reported
}

/// The methods (indices) that are asked for; all of them if none is.
fn chosen(wanted: &[String], study: &Study) -> Result<Vec<usize>> {
    if wanted.is_empty() {
        return Ok((0..study.methods.len()).collect());
    }
    let known = || study.methods.iter().map(|method| method.name.as_str()).collect::<Vec<_>>().join(", ");
    let find = |name: &String| {
        study.method(name).with_context(|| {
            format!(
                "--only names {name:?}, which is no method of {}: there are {}",
                short(&study.path),
                known()
            )
        })
    };
    wanted.iter().map(find).collect()
}

/// Rows and columns of the table.
fn cells(study: &Study, units: &[Unit]) -> Vec<(String, Vec<Option<u64>>)> {
    let row = |(method, entry): (usize, &study::plan::Entry)| {
        let own = units.iter().filter(|unit| unit.driven.contains(&method));
        let seeds: Vec<_> = own.map(Unit::seed).collect();
        (!seeds.is_empty()).then(|| (entry.name.clone(), seeds))
    };
    study.methods.iter().enumerate().filter_map(row).collect()
}

/// Keeps every other study out of a folder of runs for as long as the result lives.
fn own(work: &Path) -> Result<File> {
    fs::create_dir_all(work).with_context(|| format!("could not create {}", work.display()))?;
    let path = work.join("lock");
    let file = File::create(&path).with_context(|| format!("could not write {}", path.display()))?;
    ensure!(
        file.try_lock().is_ok(),
        "another study is under way in {}: wait for it, stop it, or name another --work",
        short(work)
    );
    Ok(file)
}
