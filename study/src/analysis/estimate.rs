//! A value with its interval; each method on each family.

use crate::cells::{Cells, shared_worlds, table};
use crate::description::Metric;
use crate::plan::Study;
use crate::rows::Gate;
use crate::stats::Interval;
use crate::stats::iqm::iqm;

/// A value with its interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// What the rows say.
    pub value: f64,
    /// Where it would lie with other seeds and worlds.
    pub interval: Interval,
}

/// A method with a gate on a family.
#[derive(Clone, Debug, PartialEq)]
pub struct CellEstimate {
    /// Index of the method.
    pub method: usize,
    /// With which gate.
    pub gate: Gate,
    /// Where.
    pub family: String,
    /// The training seeds; a single none of a classical method.
    pub seeds: Vec<Option<u64>>,
    /// Each seed's share of worlds.
    pub scores: Vec<f64>,
    /// Worlds that all seeds drove.
    pub worlds: usize,
    /// Interquartile mean of the seeds.
    pub estimate: Estimate,
}

/// A metric of every method, gate and family that has rows; families first.
pub fn each(study: &Study, cells: &Cells, metric: Metric) -> Vec<CellEstimate> {
    let mut estimates = Vec::new();
    for family in &study.families {
        for method in 0..study.methods.len() {
            for &gate in &study.gates {
                estimates.extend(cell(study, cells, metric, (method, gate, family)));
            }
        }
    }
    estimates
}

fn cell(
    study: &Study,
    cells: &Cells,
    metric: Metric,
    (method, gate, family): (usize, Gate, &str),
) -> Option<CellEstimate> {
    let runs = cells.runs(method, gate, family)?;
    let worlds = shared_worlds(&[runs]);
    let table = table(runs, &worlds, metric);
    let statistic = |scores: &crate::stats::bootstrap::Scores| vec![iqm(&scores[0][0]).unwrap_or(f64::NAN)];
    let interval = study.bootstrap.intervals(&[vec![&table]], statistic).first().copied()??;
    let scores = table.scores();
    let estimate = Estimate { value: iqm(&scores)?, interval };
    let seeds = runs.keys().copied().collect();
    Some(CellEstimate {
        method,
        gate,
        family: family.to_owned(),
        seeds,
        scores,
        worlds: worlds.len(),
        estimate,
    })
}
