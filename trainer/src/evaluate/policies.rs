//! What drives: learned policies by their folders, rivals by their names.

use anyhow::{Context, Result};
use nav_core::controller::Controller;
use nav_core::manifest::MANIFEST_FILE;
use nav_core::task::{ShieldMode, Task};
use nav_env::informed::Informed;
use nav_env::robot::Driver;
use nav_host::sha256::sha256_hex;
use nav_model::model::Model;
use nav_rivals::Rival;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use crate::train::policy::Policy;
use crate::train::run_folder::RunFolder;

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
    Folder(Way, PathBuf),
    /// A classical one.
    Rival(Rival),
}

/// What of a learned policy drives, and how.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// As it is.
    Whole,
    /// Its low level alone, straight at the goal.
    Flat,
    /// As it is, with its safety gate told who moves: a ceiling.
    Informed,
    /// Its low level alone, and told.
    InformedFlat,
}

impl Way {
    const ALL: [Self; 4] = [Self::Flat, Self::Informed, Self::InformedFlat, Self::Whole];

    /// What stands before the folder.
    const fn prefix(self) -> &'static str {
        match self {
            Self::Whole => "",
            Self::Flat => "flat:",
            Self::Informed => "informed:",
            Self::InformedFlat => "informed-flat:",
        }
    }

    const fn is_flat(self) -> bool {
        matches!(self, Self::Flat | Self::InformedFlat)
    }

    const fn is_informed(self) -> bool {
        matches!(self, Self::Informed | Self::InformedFlat)
    }
}

impl FromStr for PolicyArg {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (label, policy) = match text.split_once('=') {
            Some((label, policy)) => (Some(label), policy),
            None => (None, text),
        };
        let folder = |way: Way| Some(Source::Folder(way, policy.strip_prefix(way.prefix())?.into()));
        let source =
            Rival::named(policy).map(Source::Rival).or_else(|| Way::ALL.into_iter().find_map(folder));
        let Some(source) = source else { return Err("it is no policy".to_owned()) };
        let label = match (label, &source) {
            (Some(label), _) => label,
            (None, Source::Rival(rival)) => rival.id(),
            (None, Source::Folder(way, _)) if way.is_informed() => way.prefix().trim_end_matches(':'),
            (None, Source::Folder(..)) => return Err(format!("give it a name, as in mine={text}")),
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
            Self { label: "hybrid".to_owned(), source: Source::Folder(Way::Whole, model.to_path_buf()) },
            Self { label: "td3".to_owned(), source: Source::Folder(Way::Flat, model.to_path_buf()) },
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
    /// Whether its safety gate is told who moves.
    pub is_informed: bool,
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
        let (folder, way) = match &arg.source {
            Source::Rival(rival) => {
                return Ok(Self {
                    label,
                    run: rival.id().to_owned(),
                    learned: None,
                    kind: Kind::Rival(*rival),
                });
            }
            Source::Folder(way, folder) => (folder, way),
        };
        let (is_flat, is_informed) = (way.is_flat(), way.is_informed());
        let run = format!("{}{}", way.prefix(), folder.display());
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
                    is_informed,
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
                    is_informed,
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
                self.driven(Model::read(folder)?.into_flat_controller()?, shield)
            }
            Kind::Exported(folder) => self.driven(Model::read(folder)?.into_controller()?, shield),
            Kind::Trained(policy) if is_flat => self.driven(policy.flat_controller()?, shield),
            Kind::Trained(policy) => {
                self.driven(Controller::new(&policy.task, policy.high()?, policy.low()?)?, shield)
            }
            Kind::Rival(rival) => rival.driver(&Task { shield, ..*task }),
        })
    }

    /// Whether its safety gate is told who moves.
    pub fn is_informed(&self) -> bool {
        self.learned.as_ref().is_some_and(|learned| learned.is_informed)
    }

    fn driven<S>(&self, mut controller: Controller<S>, shield: ShieldMode) -> Box<dyn Driver + Send>
    where
        S: AsRef<[f32]> + AsMut<[f32]> + Send + 'static,
    {
        controller.set_shield(shield);
        if self.is_informed() { Box::new(Informed(controller)) } else { Box::new(controller) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_policy_is_a_folder_the_low_level_of_one_or_a_rival() {
        let parse = |text: &str| text.parse::<PolicyArg>().map(|arg| (arg.label, arg.source));
        let folder = |path: &str| Source::Folder(Way::Whole, path.into());
        let special = |label: &str, way| Ok((label.to_owned(), Source::Folder(way, "models".into())));
        assert_eq!(parse("mine=runs/7"), Ok(("mine".into(), folder("runs/7"))));
        assert_eq!(parse("td3=flat:models"), special("td3", Way::Flat));
        assert_eq!(parse("told=informed:models"), special("told", Way::Informed));
        assert_eq!(parse("informed:models"), special("informed", Way::Informed));
        assert_eq!(parse("informed-flat:models"), special("informed-flat", Way::InformedFlat));
        assert_eq!(parse("astar"), Ok(("astar".into(), Source::Rival(Rival::Astar))));
        assert_eq!(parse("upper=astar"), Ok(("upper".into(), Source::Rival(Rival::Astar))));
        assert_eq!(parse("mine=./astar"), Ok(("mine".into(), folder("./astar"))));
        for bad in ["runs/7", "=models", "a,b=models", "../x=models", "flat:models", ""] {
            assert!(parse(bad).is_err(), "{bad}");
        }
    }
}
