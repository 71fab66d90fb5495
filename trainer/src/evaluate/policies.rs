//! What drives: learned policies by their folders, rivals by their names.

use anyhow::{Context, Result};
use nav_core::controller::Controller;
use nav_core::manifest::MANIFEST_FILE;
use nav_core::task::{ShieldMode, Task};
use nav_env::robot::Driver;
use nav_host::sha256::sha256_hex;
use nav_model::model::Model;
use nav_rivals::Rival;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use crate::train::policy::Policy;
use crate::train::run_folder::RunFolder;

/// Before a folder: its low level alone, straight at the goal.
const FLAT: &str = "flat:";

/// `[LABEL=]POLICY`, as typed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PolicyArg {
    /// What it is called in tables.
    pub label: String,
    /// What it is.
    pub source: Source,
}

/// Where a policy comes from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Source {
    /// The folder of an exported model or of a finished run.
    Folder(PathBuf),
    /// Of such a folder the low level alone, straight at the goal.
    Flat(PathBuf),
    /// A classical one.
    Rival(Rival),
}

impl FromStr for PolicyArg {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (label, policy) = match text.split_once('=') {
            Some((label, policy)) => (Some(label), policy),
            None => (None, text),
        };
        let source = match (Rival::named(policy), policy.strip_prefix(FLAT)) {
            (Some(rival), _) => Source::Rival(rival),
            (None, Some(folder)) => Source::Flat(folder.into()),
            (None, None) => Source::Folder(policy.into()),
        };
        let label = match (label, &source) {
            (Some(label), _) => label,
            (None, Source::Rival(rival)) => rival.id(),
            (None, _) => return Err(format!("give it a name, as in mine={text}")),
        };
        // It names files, too.
        let is_plain = |letter: char| letter.is_ascii_alphanumeric() || "_-.+".contains(letter);
        if label.is_empty() || label.len() > 40 || !label.chars().all(is_plain) || label.starts_with('.') {
            return Err("a label has 1 to 40 letters, digits and _ - . +".to_owned());
        }
        Ok(Self { label: label.to_owned(), source })
    }
}

impl PolicyArg {
    /// What a model is usually compared with: its own low level straight at the goal, and every rival.
    pub fn usual(model: &Path) -> Vec<Self> {
        let own = [
            Self { label: "hybrid".to_owned(), source: Source::Folder(model.to_path_buf()) },
            Self { label: "td3".to_owned(), source: Source::Flat(model.to_path_buf()) },
        ];
        let rivals =
            Rival::ALL.map(|rival| Self { label: rival.id().to_owned(), source: Source::Rival(rival) });
        own.into_iter().chain(rivals).collect()
    }
}

/// A policy, read and checked.
#[derive(Debug)]
pub struct NamedPolicy {
    /// What it is called in tables.
    pub label: String,
    /// Its folder as typed, or its name.
    pub run: String,
    /// Of a learned one.
    pub learned: Option<Learned>,
    kind: Kind,
}

/// What identifies a learned policy.
#[derive(Clone, Debug, Serialize)]
pub struct Learned {
    /// The seed that it was trained with.
    pub training_seed: u64,
    /// The trainer that made it.
    pub commit: String,
    /// SHA-256 of the manifest (which has those of the networks), or of the run's policy.
    pub sha256: String,
    /// What it was trained for.
    pub task: Task,
    /// Whether its low level drives alone.
    pub is_flat: bool,
}

#[derive(Debug)]
enum Kind {
    Exported(PathBuf),
    Trained(Box<Policy>),
    Rival(Rival),
}

impl NamedPolicy {
    /// Reads a policy.
    ///
    /// # Errors
    /// A folder that holds neither a model nor a finished run, or one that is damaged.
    pub fn read(arg: &PolicyArg) -> Result<Self> {
        let label = arg.label.clone();
        let (folder, is_flat) = match &arg.source {
            Source::Rival(rival) => {
                return Ok(Self {
                    label,
                    run: rival.id().to_owned(),
                    learned: None,
                    kind: Kind::Rival(*rival),
                });
            }
            Source::Folder(folder) => (folder, false),
            Source::Flat(folder) => (folder, true),
        };
        let run = format!("{}{}", if is_flat { FLAT } else { "" }, folder.display());
        let (kind, learned) = match RunFolder::open(folder) {
            Ok(run) => {
                let policy = run.policy()?;
                let bytes = postcard::to_stdvec(&policy).context("the policy cannot be hashed")?;
                let learned = Learned {
                    training_seed: policy.config()?.seed,
                    commit: policy.commit.clone(),
                    sha256: sha256_hex(&bytes),
                    task: policy.task,
                    is_flat: is_flat || policy.scorer.is_none(),
                };
                (Kind::Trained(Box::new(policy)), learned)
            }
            Err(_) => {
                let model = Model::read(folder)?;
                let path = folder.join(MANIFEST_FILE);
                let bytes =
                    std::fs::read(&path).with_context(|| format!("cannot read {}", path.display()))?;
                let manifest = model.manifest();
                let learned = Learned {
                    training_seed: manifest.seed,
                    commit: manifest.trainer_commit.as_str().to_owned(),
                    sha256: sha256_hex(&bytes),
                    task: manifest.task,
                    is_flat: is_flat || model.dqn().is_none(),
                };
                (Kind::Exported(folder.clone()), learned)
            }
        };
        Ok(Self { label, run, learned: Some(learned), kind })
    }

    /// A driver for a robot of `task`; one for each thread.
    ///
    /// # Errors
    /// A folder that was changed since it was read.
    pub fn driver(&self, task: &Task, shield: ShieldMode) -> Result<Box<dyn Driver + Send>> {
        let is_flat = self.learned.as_ref().is_some_and(|learned| learned.is_flat);
        Ok(match &self.kind {
            Kind::Exported(folder) if is_flat => {
                with_shield(Model::read(folder)?.into_flat_controller()?, shield)
            }
            Kind::Exported(folder) => with_shield(Model::read(folder)?.into_controller()?, shield),
            Kind::Trained(policy) if is_flat => with_shield(policy.flat_controller()?, shield),
            Kind::Trained(policy) => {
                with_shield(Controller::new(&policy.task, policy.high()?, policy.low()?)?, shield)
            }
            Kind::Rival(rival) => rival.driver(&Task { shield, ..*task }),
        })
    }
}

fn with_shield<S>(mut controller: Controller<S>, shield: ShieldMode) -> Box<dyn Driver + Send>
where
    S: AsRef<[f32]> + AsMut<[f32]> + Send + 'static,
{
    controller.set_shield(shield);
    Box::new(controller)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_policy_is_a_folder_the_low_level_of_one_or_a_rival() {
        let parse = |text: &str| text.parse::<PolicyArg>().map(|arg| (arg.label, arg.source));
        let folder = |path: &str| Source::Folder(path.into());
        assert_eq!(parse("mine=runs/7"), Ok(("mine".into(), folder("runs/7"))));
        assert_eq!(parse("td3=flat:models"), Ok(("td3".into(), Source::Flat("models".into()))));
        assert_eq!(parse("astar"), Ok(("astar".into(), Source::Rival(Rival::Astar))));
        assert_eq!(parse("upper=astar"), Ok(("upper".into(), Source::Rival(Rival::Astar))));
        assert_eq!(parse("mine=./astar"), Ok(("mine".into(), folder("./astar"))));
        for bad in ["runs/7", "=models", "a,b=models", "../x=models", "flat:models", ""] {
            assert!(parse(bad).is_err(), "{bad}");
        }
    }
}
