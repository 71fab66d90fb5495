//! What must be run before there is something to judge: the command lines of training and evaluation, for whoever starts them.

use std::ffi::OsString;
use std::io;
use std::path::{Path, PathBuf};

use crate::plan::{Source, Study};
use crate::rows::Gate;

/// One training run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TrainingRun {
    /// Index of the method.
    pub method: usize,
    /// The training seed.
    pub seed: u64,
    /// Where it goes, below the folder of all runs.
    pub folder: PathBuf,
    /// What `trainer` is told, but for `--out`.
    pub arguments: Vec<OsString>,
    config: PathBuf,
    flags: Vec<String>,
}

impl TrainingRun {
    /// What is trained, as a text that is the same as long as the same is: flags and configuration, wherever that lies and
    /// whatever its comments say.
    ///
    /// # Errors
    /// A configuration that cannot be read.
    pub fn recipe(&self) -> io::Result<String> {
        let text = std::fs::read_to_string(&self.config)?;
        // What is no TOML the trainer will refuse.
        let fields = text.parse::<toml::Table>().map_or(text, |table| table.to_string());
        Ok(format!("seed {}\n{}\n{fields}", self.seed, self.flags.join(" ")))
    }
}

impl Study {
    /// Every training run, all methods of one seed before those of the next: a study that is stopped early has whole seeds.
    pub fn training_runs(&self) -> Vec<TrainingRun> {
        let seeds: std::collections::BTreeSet<u64> =
            self.methods.iter().flat_map(|method| method.seeds.iter().copied()).collect();
        let runs = seeds.into_iter().flat_map(|seed| {
            let with_seed = move |(index, method): (usize, &crate::plan::Entry)| {
                let Source::Trained { config, flags } = &method.source else { return None };
                method.seeds.contains(&seed).then(|| TrainingRun {
                    method: index,
                    seed,
                    folder: arm_folder(&method.name, Some(seed)),
                    arguments: train_arguments(config, flags, seed),
                    config: config.clone(),
                    flags: flags.clone(),
                })
            };
            self.methods.iter().enumerate().filter_map(with_seed)
        });
        runs.collect()
    }

    /// Where what is of a method and a training seed goes, below the folder of all runs.
    pub fn folder(&self, method: usize, seed: Option<u64>) -> PathBuf {
        arm_folder(&self.methods[method].name, seed)
    }

    /// What `trainer evaluate --policy` is told for a method: runs lie in `runs` as [`TrainingRun::folder`] says; a
    /// classical method has no seed.
    pub fn policy_argument(&self, method: usize, seed: Option<u64>, runs: &Path) -> OsString {
        let entry = &self.methods[method];
        let mut argument = OsString::from(format!("{}=", entry.name));
        match &entry.source {
            Source::Rival(rival) => argument.push(rival),
            Source::Trained { .. } => {
                argument.push(runs.join(arm_folder(&entry.name, seed)));
            }
            Source::LowLevelOf(of) => {
                argument.push("flat:");
                argument.push(runs.join(arm_folder(&self.methods[*of].name, seed)));
            }
        }
        argument
    }

    /// What `trainer` is told to evaluate a method with a gate, but for `--out`.
    pub fn evaluate_arguments(
        &self,
        method: usize,
        seed: Option<u64>,
        gate: Gate,
        runs: &Path,
    ) -> Vec<OsString> {
        let fixed = |text: &str| OsString::from(text);
        vec![
            fixed("evaluate"),
            fixed("--policy"),
            self.policy_argument(method, seed, runs),
            fixed("--families"),
            fixed(&self.families.join(",")),
            fixed("--worlds"),
            fixed(&self.worlds.to_string()),
            fixed("--split"),
            fixed(&self.split),
            fixed("--disturbance"),
            fixed(&self.disturbance),
            fixed("--shield"),
            fixed(gate.word()),
            fixed("--pictures"),
            fixed("0"),
        ]
    }
}

fn arm_folder(name: &str, seed: Option<u64>) -> PathBuf {
    seed.map_or_else(|| PathBuf::from(name), |seed| Path::new(name).join(format!("seed-{seed}")))
}

/// One attempt: another seed in place of one that failed would be a choice.
fn train_arguments(config: &Path, flags: &[String], seed: u64) -> Vec<OsString> {
    let mut arguments: Vec<OsString> = vec!["train".into(), "--config".into(), config.into()];
    arguments.extend(flags.iter().map(OsString::from));
    arguments.extend(["--seed".into(), seed.to_string().into(), "--attempts".into(), "1".into()]);
    arguments
}
