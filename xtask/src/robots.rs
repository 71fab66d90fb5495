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

use std::fs;
use std::path::PathBuf;

use anyhow::{Context, Result, bail, ensure};
use clap::Args;

use crate::lanes::side_by_side;
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

#[cfg(test)]
mod tests {
    use super::*;

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
}
