//! Every robot that has a profile: trained with several seeds, judged, exported, checked and driven on worlds that training
//! never saw, with a folder of results at the end.
//!
//! | where | what |
//! |---|---|
//! | `--work`, a folder a run | `run/` of the trainer, `model/`, `evaluate/`, `picture/`, logs, and `done.json` when it has ended |
//! | `--out` | `README.md` with the tables, `runs.csv`, and for each robot its episodes, model card and picture |
//!
//! Started again, it goes on: what is done is not done again, and a run that was killed goes on from its last checkpoint.

mod job;
mod outcome;
mod report;

use std::collections::VecDeque;
use std::fs;
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};
use std::thread;

use anyhow::{Context, Result, bail, ensure};
use clap::Args;

use crate::shell::{root, say};
use crate::training::short;
use crate::{libtorch, onnxruntime, programs};
use job::{Job, Setting};

/// Families without people, in which every robot is to be as good as the reference robot.
const FAMILIES: [&str; 4] = ["clutter", "u_trap", "rooms", "maze"];

/// What is trained, and where it goes.
#[derive(Args)]
pub(crate) struct Options {
    /// Robots, by the names of their profiles [default: all of robots/]
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    robots: Vec<String>,
    /// Training seeds of each robot
    #[arg(long, value_delimiter = ',', value_name = "SEEDS", default_value = "1,2,3,4,5")]
    seeds: Vec<u64>,
    /// Test worlds a family
    #[arg(long, default_value_t = 500, value_parser = clap::value_parser!(u32).range(1..))]
    worlds: u32,
    /// Runs side by side, one a core
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u16).range(1..=64))]
    lanes: u16,
    /// Train with this configuration on top of each robot's (as for runs of seconds)
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Where runs, models and logs are kept, and what is done already is found
    #[arg(long, value_name = "FOLDER", default_value = "runs/robots")]
    work: PathBuf,
    /// Where the results go
    #[arg(long, value_name = "FOLDER", default_value = "results/robots")]
    out: PathBuf,
}

/// Trains, judges and drives all of them.
///
/// # Errors
/// A name that is no profile, or a program that fails; a run that misses its gate is a result like any other.
pub(crate) fn run(options: &Options) -> Result<()> {
    let robots = chosen(&options.robots, &known()?)?;
    libtorch::set_up(None)?;
    onnxruntime::set_up()?;
    let programs = programs::build(&["trainer", "runtime"])?;
    let setting = Setting {
        programs,
        // Relative to where the user stands.
        config: options.config.as_ref().map(std::path::absolute).transpose()?,
        work: std::path::absolute(&options.work)?,
        worlds: options.worlds,
    };
    fs::create_dir_all(&setting.work)
        .with_context(|| format!("could not create {}", setting.work.display()))?;
    let jobs: Vec<Job> = robots
        .iter()
        .flat_map(|robot| {
            let seeds = options.seeds.iter().map(|seed| Some(*seed));
            seeds.chain([None]).map(|seed| Job { robot: robot.clone(), seed })
        })
        .collect();
    say(&format!("{} runs of {} robots, {} side by side", jobs.len(), robots.len(), options.lanes));
    side_by_side(jobs.clone(), options.lanes.into(), |job| job.run(&setting))?;
    let out = std::path::absolute(&options.out)?;
    report::write(&setting, &robots, &jobs, &out)?;
    say(&format!("the results are in {}", short(&out)));
    Ok(())
}

/// The profiles that there are.
fn known() -> Result<Vec<String>> {
    let folder = root().join("robots");
    let entries = fs::read_dir(&folder).with_context(|| format!("could not read {}", folder.display()))?;
    let names = entries.flatten().filter_map(|entry| {
        let name = entry.file_name().into_string().ok()?;
        name.strip_suffix(".toml").map(str::to_owned)
    });
    let mut names: Vec<_> = names.collect();
    names.sort();
    Ok(names)
}

/// Those that are asked for; all of them if none is.
fn chosen(wanted: &[String], known: &[String]) -> Result<Vec<String>> {
    if wanted.is_empty() {
        return Ok(known.to_vec());
    }
    for (index, name) in wanted.iter().enumerate() {
        if !known.contains(name) {
            bail!("there is no robot named {name:?}; --robots takes some of {}", known.join(", "));
        }
        ensure!(!wanted[..index].contains(name), "--robots names {name} twice");
    }
    Ok(wanted.to_vec())
}

/// Does all jobs, so many at a time. After a failure those under way end, and no other begins.
fn side_by_side<T: Send>(jobs: Vec<T>, lanes: usize, work: impl Fn(&T) -> Result<()> + Sync) -> Result<()> {
    let waiting = Mutex::new((VecDeque::from(jobs), Ok(())));
    let locked = || waiting.lock().unwrap_or_else(PoisonError::into_inner);
    let lane = || {
        loop {
            let next = {
                let (jobs, result) = &mut *locked();
                if result.is_err() { None } else { jobs.pop_front() }
            };
            let Some(job) = next else { return };
            if let Err(error) = work(&job) {
                let (_, result) = &mut *locked();
                if result.is_ok() {
                    *result = Err(error);
                }
            }
        }
    };
    thread::scope(|scope| {
        for _ in 0..lanes {
            scope.spawn(lane);
        }
    });
    let (_, result) = waiting.into_inner().unwrap_or_else(PoisonError::into_inner);
    result
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};

    #[test]
    fn robots_are_chosen_by_name() {
        let known = known().expect("the workspace has robots/");
        assert!(known.len() >= 7 && known.contains(&"jackal".to_owned()), "{known:?}");
        assert_eq!(chosen(&[], &known).expect("all"), known);
        let names = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>();
        assert_eq!(chosen(&names(&["husky", "agv"]), &known).expect("two"), names(&["husky", "agv"]));
        let unknown = chosen(&names(&["jakal"]), &known).expect_err("unknown").to_string();
        assert!(unknown.contains("turtlebot4"), "{unknown}");
        assert!(chosen(&names(&["agv", "agv"]), &known).is_err());
    }

    #[test]
    fn so_many_run_side_by_side_and_none_begins_after_a_failure() {
        let (now, most, done) = (AtomicUsize::new(0), AtomicUsize::new(0), AtomicUsize::new(0));
        let work = |job: &u32| {
            most.fetch_max(now.fetch_add(1, Ordering::SeqCst) + 1, Ordering::SeqCst);
            thread::sleep(std::time::Duration::from_millis(20));
            now.fetch_sub(1, Ordering::SeqCst);
            done.fetch_add(1, Ordering::SeqCst);
            ensure!(*job != 3, "job {job} fails");
            Ok(())
        };
        side_by_side(vec![0, 1, 2, 4], 2, work).expect("all done");
        assert_eq!((most.load(Ordering::SeqCst), done.load(Ordering::SeqCst)), (2, 4));
        let error = side_by_side(vec![3, 0, 1, 2, 4, 5, 6, 7], 1, work).expect_err("it failed");
        assert!(error.to_string().contains("job 3"), "{error}");
        assert_eq!(done.load(Ordering::SeqCst), 5, "nothing after it");
    }
}
