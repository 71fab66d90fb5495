//! What a study may say.

use std::io;
use std::path::{Path, PathBuf};

use super::{Description, Entry, Method, Source, twice};
use crate::stats::mann_whitney::VALUES_MAX;
use crate::stats::signed_rank::DIFFERENCES_MAX;

/// Why a study was refused.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// The file system refused.
    #[error("cannot read the study {}: {source}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// It is no TOML of a study.
    #[error("{} is no study: {}", path.display(), problem.trim_end())]
    Toml {
        /// The file.
        path: PathBuf,
        /// What is wrong, and in which line.
        problem: String,
    },
    /// It contradicts itself.
    #[error("{}: {problem}", path.display())]
    Wrong {
        /// The file.
        path: PathBuf,
        /// What is wrong, and what to do.
        problem: String,
    },
}

/// The methods of a study at `path`.
pub(super) fn methods(description: &Description, path: &Path) -> Result<Vec<Entry>, String> {
    let typed = &description.methods;
    if typed.is_empty() {
        return Err("there is nothing to compare: add a [[method]]".to_owned());
    }
    if let Some(name) = twice(typed.iter().map(|method| method.name.as_str())) {
        return Err(format!("two methods are named {name}: give each a name of its own"));
    }
    typed.iter().map(|method| entry(method, description, path)).collect()
}

fn entry(method: &Method, description: &Description, path: &Path) -> Result<Entry, String> {
    let name = &method.name;
    let is_plain = |letter: char| letter.is_ascii_alphanumeric() || "_-.+".contains(letter);
    if name.is_empty() || name.len() > 40 || !name.chars().all(is_plain) || name.starts_with('.') {
        return Err(format!("method {name:?}: a name has 1 to 40 letters, digits and _ - . +"));
    }
    let source = match (&method.train, &method.low_level_of, &method.rival) {
        (Some(train), None, None) => {
            let config = path.parent().unwrap_or(Path::new("")).join(&train.config);
            if !config.is_file() {
                return Err(format!("method {name}: there is no configuration {}", config.display()));
            }
            let taken = ["--seed", "--out", "--config", "--resume", "--print-config"];
            let is_taken = |flag: &&String| taken.iter().any(|taken| flag.split('=').next() == Some(taken));
            if let Some(flag) = train.flags.iter().find(is_taken) {
                return Err(format!("method {name}: {flag} is for the study to say; take it out of flags"));
            }
            Source::Trained { config, flags: train.flags.clone() }
        }
        (None, Some(of), None) => {
            let position = description.methods.iter().position(|other| other.name == *of);
            let Some(of) = position.filter(|&of| description.methods[of].train.is_some()) else {
                return Err(format!(
                    "method {name}: low_level_of names {of}, which is no method with `train`"
                ));
            };
            Source::LowLevelOf(of)
        }
        (None, None, Some(rival)) if method.seeds.is_some() => {
            return Err(format!("method {name}: {rival} learns nothing; take its seeds out"));
        }
        (None, None, Some(rival)) => Source::Rival(rival.clone()),
        _ => return Err(format!("method {name} needs exactly one of train, low_level_of and rival")),
    };
    let seeds = match &source {
        Source::Rival(_) => Vec::new(),
        Source::Trained { .. } => method.seeds.as_ref().unwrap_or(&description.training.seeds).clone(),
        // A low level has the seeds of its whole, unless it is to have fewer.
        Source::LowLevelOf(of) => {
            let whole = description.methods[*of].seeds.as_ref().unwrap_or(&description.training.seeds);
            let own = method.seeds.as_ref().unwrap_or(whole);
            if let Some(seed) = own.iter().find(|seed| !whole.contains(seed)) {
                let of = &description.methods[*of].name;
                return Err(format!("method {name}: {of} is not trained with seed {seed}"));
            }
            own.clone()
        }
    };
    if let Some(problem) = seeds_problem(&seeds) {
        return Err(format!("method {name}: {problem}"));
    }
    if !matches!(source, Source::Rival(_)) && seeds.is_empty() {
        return Err(format!("method {name} has no seed: name some in training.seeds"));
    }
    Ok(Entry { name: name.clone(), label: method.label.clone(), source, seeds })
}

fn seeds_problem(seeds: &[u64]) -> Option<String> {
    if let Some(seed) = twice(seeds.iter().copied()) {
        return Some(format!("seed {seed} is named twice"));
    }
    let most = VALUES_MAX / 2;
    (seeds.len() > most).then(|| format!("{} seeds are named, {most} at most can be compared", seeds.len()))
}

/// Whether the numbers can be worked with.
pub(super) fn numbers(description: &Description) -> Result<(), String> {
    let evaluation = &description.evaluation;
    let interval = &description.interval;
    if evaluation.families.is_empty() || evaluation.gates.is_empty() {
        return Err("evaluation needs at least one of families and one of gates".to_owned());
    }
    if let Some(family) = twice(evaluation.families.iter().map(String::as_str)) {
        return Err(format!("evaluation.families names {family} twice"));
    }
    if let Some(gate) = twice(evaluation.gates.iter().copied()) {
        return Err(format!("evaluation.gates names {} twice", gate.word()));
    }
    let worlds_max = DIFFERENCES_MAX as u64;
    if !(1..=worlds_max).contains(&evaluation.worlds) {
        return Err(format!("evaluation.worlds is {}, but must be 1 to {worlds_max}", evaluation.worlds));
    }
    if !(0.5..1.0).contains(&interval.coverage) {
        return Err(format!("interval.coverage is {}, but must be 0.5 to below 1", interval.coverage));
    }
    if !(100..=1_000_000).contains(&interval.resamples) {
        return Err(format!("interval.resamples is {}, but must be 100 to 1000000", interval.resamples));
    }
    if description.primaries.iter().any(|asked| asked.margin.is_some()) {
        return Err("a primary has a margin: ask for it under [[non_inferiority]]".to_owned());
    }
    for margin in description.non_inferiority.iter().map(|asked| asked.margin) {
        let Some(margin) = margin else {
            return Err("a non_inferiority needs a margin: 0.02 is two points of a hundred".to_owned());
        };
        if !(0.0..=1.0).contains(&margin) {
            return Err(format!("a margin is {margin}, but must be 0 to 1: 0.02 is two points of a hundred"));
        }
    }
    Ok(())
}
