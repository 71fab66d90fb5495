//! A study, checked: every name is known, every comparison is spelt out family by family and gate by gate.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use crate::description::{Description, Method, Metric};
use crate::rows::Gate;
use crate::stats::bootstrap::Bootstrap;

mod check;
mod expand;

pub use check::StudyError;

/// How a method comes to drive.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Source {
    /// Trained with a configuration and flags.
    Trained {
        /// Absolute, or relative to where the program runs.
        config: PathBuf,
        /// Further flags of `trainer train`.
        flags: Vec<String>,
    },
    /// The low level of the runs of another method (an index).
    LowLevelOf(usize),
    /// A classical one, by its name.
    Rival(String),
}

/// A method.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entry {
    /// What rows call it.
    pub name: String,
    /// What figures call it.
    pub label: String,
    /// How it comes to drive.
    pub source: Source,
    /// Its training seeds; none of a classical one, whose rows have no seed.
    pub seeds: Vec<u64>,
}

impl Entry {
    /// Whether it was learned.
    pub fn is_learned(&self) -> bool {
        !matches!(self.source, Source::Rival(_))
    }

    /// Its seeds as rows have them.
    pub fn row_seeds(&self) -> Vec<Option<u64>> {
        if self.is_learned() { self.seeds.iter().copied().map(Some).collect() } else { vec![None] }
    }
}

/// One question: a method against another, on a family, with or without the gate.
#[derive(Clone, Debug, PartialEq)]
pub struct Contrast {
    /// What is compared.
    pub metric: Metric,
    /// Index of the method.
    pub method: usize,
    /// Index of the other.
    pub against: usize,
    /// The family.
    pub family: String,
    /// The safety gate.
    pub gate: Gate,
    /// By how much the method may be worse, where that is the question.
    pub margin: f64,
}

/// What a method is compared with as parts of it come or go.
#[derive(Clone, Debug, PartialEq)]
pub struct Steps {
    /// Each method with the one that it is compared with (none for the first rung) and what the step is about.
    pub steps: Vec<(usize, Option<usize>, String)>,
    /// On which families.
    pub families: Vec<String>,
}

/// A study that makes sense.
#[derive(Clone, Debug, PartialEq)]
pub struct Study {
    /// Where it was read.
    pub path: PathBuf,
    /// Its text, for the report.
    pub text: String,
    /// Headline.
    pub title: String,
    /// What the figures are to hold for.
    pub inference: String,
    /// Environment steps of one run.
    pub env_steps: u64,
    /// Updates of one run at least.
    pub updates_min: u64,
    /// Which worlds.
    pub split: String,
    /// How the robot differed from a perfect one.
    pub disturbance: String,
    /// Families.
    pub families: Vec<String>,
    /// Worlds a family.
    pub worlds: u64,
    /// Gates.
    pub gates: Vec<Gate>,
    /// How intervals are drawn.
    pub bootstrap: Bootstrap,
    /// Who is compared.
    pub methods: Vec<Entry>,
    /// The primary questions.
    pub primaries: Vec<Contrast>,
    /// Where a method must not be worse.
    pub non_inferiority: Vec<Contrast>,
    /// Who is compared world by world; the metric is success.
    pub paired: Vec<Contrast>,
    /// The ladder, if there is one.
    pub ladder: Option<Steps>,
    /// The ablations, if there are any.
    pub ablation: Option<Steps>,
}

impl Study {
    /// Reads and checks a study.
    ///
    /// # Errors
    /// A file that cannot be read, that is no study, or that contradicts itself.
    pub fn read(path: &Path) -> Result<Self, StudyError> {
        let text = std::fs::read_to_string(path)
            .map_err(|source| StudyError::File { path: path.to_owned(), source })?;
        Self::parse(path, text)
    }

    /// Checks a study whose text is at hand; `path` is where its configurations are looked for and what errors name.
    ///
    /// # Errors
    /// A text that is no study, or that contradicts itself.
    pub fn parse(path: &Path, text: String) -> Result<Self, StudyError> {
        let description: Description = toml::from_str(&text)
            .map_err(|error| StudyError::Toml { path: path.to_owned(), problem: error.to_string() })?;
        let wrong = |problem: String| StudyError::Wrong { path: path.to_owned(), problem };
        let methods = check::methods(&description, path).map_err(wrong)?;
        check::numbers(&description).map_err(wrong)?;
        expand::study(path, text, description, methods).map_err(wrong)
    }

    /// The method that rows call so.
    pub fn method(&self, name: &str) -> Option<usize> {
        self.methods.iter().position(|method| method.name == name)
    }

    /// The methods that figures of all methods show: not those that only the ladder or the ablations compare, which have tables
    /// of their own.
    pub fn shown(&self) -> Vec<usize> {
        let steps = self.ladder.iter().chain(&self.ablation).flat_map(|steps| &steps.steps);
        let apart: BTreeSet<usize> =
            steps.filter(|(_, against, _)| against.is_some()).map(|(method, ..)| *method).collect();
        let asked: BTreeSet<usize> = [&self.primaries, &self.non_inferiority, &self.paired]
            .into_iter()
            .flatten()
            .flat_map(|contrast| [contrast.method, contrast.against])
            .collect();
        (0..self.methods.len()).filter(|method| asked.contains(method) || !apart.contains(method)).collect()
    }

    /// The method that the study is about: that of its first primary, else the first.
    pub fn subject(&self) -> usize {
        self.primaries.first().map_or(0, |contrast| contrast.method)
    }
}

/// The first that comes twice.
fn twice<T: Ord + Copy>(values: impl IntoIterator<Item = T>) -> Option<T> {
    let mut seen = BTreeSet::new();
    values.into_iter().find(|value| !seen.insert(*value))
}
