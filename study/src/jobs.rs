//! What must be run before there is something to judge: the command lines of training and evaluation, for whoever starts them.

use std::ffi::OsString;
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
                    folder: run_folder(&method.name, seed),
                    arguments: train_arguments(config, flags, seed),
                })
            };
            self.methods.iter().enumerate().filter_map(with_seed)
        });
        runs.collect()
    }

    /// What `trainer evaluate --policy` is told for a method: runs lie in `runs` as [`TrainingRun::folder`] says; a
    /// classical method has no seed.
    pub fn policy_argument(&self, method: usize, seed: Option<u64>, runs: &Path) -> OsString {
        let entry = &self.methods[method];
        let mut argument = OsString::from(format!("{}=", entry.name));
        match &entry.source {
            Source::Rival(rival) => argument.push(rival),
            Source::Trained { .. } => {
                argument.push(runs.join(run_folder(&entry.name, seed.unwrap_or_default())))
            }
            Source::LowLevelOf(of) => {
                argument.push("flat:");
                argument.push(runs.join(run_folder(&self.methods[*of].name, seed.unwrap_or_default())));
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

fn run_folder(name: &str, seed: u64) -> PathBuf {
    Path::new(name).join(format!("seed-{seed}"))
}

/// One attempt: another seed in place of one that failed would be a choice.
fn train_arguments(config: &Path, flags: &[String], seed: u64) -> Vec<OsString> {
    let mut arguments: Vec<OsString> = vec!["train".into(), "--config".into(), config.into()];
    arguments.extend(flags.iter().map(OsString::from));
    arguments.extend(["--seed".into(), seed.to_string().into(), "--attempts".into(), "1".into()]);
    arguments
}
