//! Each method over all families: interquartile mean of all scores, performance profile, probability that the study's
//! subject improves on it.

use super::estimate::Estimate;
use crate::cells::{Cells, shared_worlds, table};
use crate::description::Metric;
use crate::plan::Study;
use crate::rows::Gate;
use crate::stats::Interval;
use crate::stats::a12::probability_of_improvement;
use crate::stats::bootstrap::{Scores, Table};
use crate::stats::iqm::iqm;
use crate::stats::profile::profile;

/// Steps of a profile from 0 to 1.
const STEPS: usize = 100;

/// A method with a gate, over families.
#[derive(Clone, Debug, PartialEq)]
pub struct Overall {
    /// Index of the method.
    pub method: usize,
    /// With which gate.
    pub gate: Gate,
    /// Families that it has rows of.
    pub families: usize,
    /// Interquartile mean of success, of every seed on every family.
    pub success: Estimate,
    /// Mean of collisions over seeds and families.
    pub collision: Estimate,
    /// Share of scores above each of [`thresholds`], with its interval.
    pub profile: Vec<Estimate>,
    /// Probability that a seed of the study's subject has more success than one of this method, families weighing alike; of
    /// other methods, with at least two seeds on either side.
    pub improved_on: Option<Estimate>,
}

/// Where profiles are looked at: 0, 0.01 and so on, below 1.
pub fn thresholds() -> Vec<f64> {
    (0..STEPS).map(|step| step as f64 / STEPS as f64).collect()
}

/// Every method and gate that has rows.
pub fn overall(study: &Study, cells: &Cells) -> Vec<Overall> {
    let methods = 0..study.methods.len();
    let arms = methods.flat_map(|method| study.gates.iter().map(move |&gate| (method, gate)));
    arms.filter_map(|(method, gate)| of_arm(study, cells, method, gate)).collect()
}

fn of_arm(study: &Study, cells: &Cells, method: usize, gate: Gate) -> Option<Overall> {
    let tables = |metric| tables(study, cells, (method, gate), None, metric);
    let (success, collision) = (tables(Metric::Success), tables(Metric::Collision));
    let scores: Vec<Vec<f64>> = success.iter().map(Table::scores).collect();
    let thresholds = thresholds();
    let numbers = |scores: &[Vec<f64>]| {
        let mut numbers = vec![iqm(&scores.concat()).unwrap_or(f64::NAN)];
        numbers.extend(profile(scores, &thresholds));
        numbers
    };
    let refs: Vec<&Table> = success.iter().collect();
    let intervals = study.bootstrap.intervals(&[refs], |scores| numbers(&scores[0]));
    let pairs = numbers(&scores).into_iter().zip(intervals);
    let estimates: Option<Vec<Estimate>> =
        pairs.map(|(value, interval)| Some(Estimate { value, interval: interval? })).collect();
    let mut estimates = estimates?;
    let profile = estimates.split_off(1);
    Some(Overall {
        method,
        gate,
        families: success.len(),
        success: *estimates.first()?,
        collision: mean(study, &collision)?,
        profile,
        improved_on: improvement(study, cells, method, gate),
    })
}

/// A metric on each family that the method has rows of, and `other` too where it is named: worlds that both drove.
fn tables(
    study: &Study,
    cells: &Cells,
    (method, gate): (usize, Gate),
    other: Option<usize>,
    metric: Metric,
) -> Vec<Table> {
    let of_family = |family: &String| {
        let runs = cells.runs(method, gate, family)?;
        let mut sharing = vec![runs];
        if let Some(other) = other {
            sharing.push(cells.runs(other, gate, family)?);
        }
        let worlds = shared_worlds(&sharing);
        (!worlds.is_empty()).then(|| table(runs, &worlds, metric))
    };
    study.families.iter().filter_map(of_family).collect()
}

fn mean(study: &Study, tables: &[Table]) -> Option<Estimate> {
    let mean = |scores: &[Vec<f64>]| crate::stats::mean(&scores.concat());
    let refs: Vec<&Table> = tables.iter().collect();
    let of = |scores: &Scores| vec![mean(&scores[0]).unwrap_or(f64::NAN)];
    let interval: Interval = study.bootstrap.intervals(&[refs], of).first().copied()??;
    let scores: Vec<Vec<f64>> = tables.iter().map(Table::scores).collect();
    Some(Estimate { value: mean(&scores)?, interval })
}

fn improvement(study: &Study, cells: &Cells, method: usize, gate: Gate) -> Option<Estimate> {
    let subject = study.subject();
    if subject == method {
        return None;
    }
    let a = tables(study, cells, (subject, gate), Some(method), Metric::Success);
    let b = tables(study, cells, (method, gate), Some(subject), Metric::Success);
    if a.iter().chain(&b).any(|table| table.seeds() < 2) {
        return None;
    }
    let of = |a: &[Vec<f64>], b: &[Vec<f64>]| probability_of_improvement(a, b);
    let scores = |tables: &[Table]| tables.iter().map(Table::scores).collect::<Vec<_>>();
    let value = of(&scores(&a), &scores(&b))?;
    let statistic = |scores: &Scores| vec![of(&scores[0], &scores[1]).unwrap_or(f64::NAN)];
    let both = [a.iter().collect(), b.iter().collect()];
    let interval = study.bootstrap.intervals(&both, statistic).first().copied()??;
    Some(Estimate { value, interval })
}
