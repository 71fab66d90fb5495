//! What the runs took, and whether they were given the same.

use crate::plan::{Source, Study};
use crate::rows::{Outcome, RunRow};
use crate::stats::median;

/// How far from the budget a run's steps may be.
const TOLERANCE: f64 = 0.05;

/// The runs of a method.
#[derive(Clone, Debug, PartialEq)]
pub struct Spent {
    /// Index of the method.
    pub method: usize,
    /// Its runs in the study.
    pub runs: Vec<RunRow>,
    /// How many passed the trainer's gate.
    pub passed: usize,
    /// Median environment steps.
    pub env_steps: Option<f64>,
    /// Median updates.
    pub updates: Option<f64>,
    /// Median time to train, s.
    pub train_s: Option<f64>,
    /// What is not as the study says.
    pub complaints: Vec<String>,
}

/// What was spent on each method that was trained and has a table of runs.
pub fn spent(study: &Study, rows: &[RunRow]) -> Vec<Spent> {
    let of_method = |(method, entry): (usize, &crate::plan::Entry)| {
        let is_own = |row: &&RunRow| row.method == entry.name && entry.seeds.contains(&row.training_seed);
        let runs: Vec<RunRow> = rows.iter().filter(is_own).cloned().collect();
        if runs.is_empty() || !matches!(entry.source, Source::Trained { .. }) {
            return None;
        }
        let middle =
            |value: fn(&RunRow) -> Option<f64>| median(&runs.iter().filter_map(value).collect::<Vec<_>>());
        Some(Spent {
            method,
            passed: runs.iter().filter(|run| run.outcome == Outcome::Passed).count(),
            env_steps: middle(|run| run.env_steps.map(|steps| steps as f64)),
            updates: middle(|run| run.updates.map(|updates| updates as f64)),
            train_s: middle(|run| run.train_s),
            complaints: runs.iter().filter_map(|run| complaint(study, run)).collect(),
            runs,
        })
    };
    study.methods.iter().enumerate().filter_map(of_method).collect()
}

fn complaint(study: &Study, run: &RunRow) -> Option<String> {
    let mut parts = Vec::new();
    if let Some(steps) = run.env_steps {
        let share = steps as f64 / study.env_steps.max(1) as f64;
        if (share - 1.0).abs() > TOLERANCE {
            parts.push(format!("took {steps} environment steps, the study says {}", study.env_steps));
        }
    }
    if let Some(updates) = run.updates.filter(|&updates| updates < study.updates_min) {
        parts.push(format!("made {updates} updates, the study says {} at least", study.updates_min));
    }
    if run.outcome != Outcome::Passed {
        parts.push(run.outcome.word().to_owned());
    }
    parts.extend(run.note.as_ref().filter(|note| !note.is_empty()).cloned());
    (!parts.is_empty()).then(|| format!("seed {}: {}", run.training_seed, parts.join(", ")))
}
