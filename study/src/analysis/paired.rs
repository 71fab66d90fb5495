//! A method against another world by world. These tests hold for the trained policies at hand and new worlds, not for new training
//! seeds: a world is the unit.
//!
//! Success: McNemar's exact test where both are one policy; else Wilcoxon's signed ranks of the worlds' success over seeds.
//! Times and lengths: on worlds that both solved, each side's mean over the seeds that did.

use std::collections::BTreeMap;

use super::estimate::Estimate;
use crate::cells::{Cells, Episode, Runs, shared_worlds, table};
use crate::description::Metric;
use crate::plan::{Contrast, Study};
use crate::rows::End;
use crate::stats::bootstrap::{Scores, Table};
use crate::stats::mcnemar::mcnemar;
use crate::stats::signed_rank::signed_rank;
use crate::stats::{mean, median};

/// Two methods in the same worlds.
#[derive(Clone, Debug, PartialEq)]
pub struct Pair {
    /// Who, where.
    pub contrast: Contrast,
    /// Worlds that both drove.
    pub worlds: usize,
    /// Worlds that were solved more often by the one, and by the other.
    pub wins: [usize; 2],
    /// Difference of mean success.
    pub success: Estimate,
    /// Two-sided p over worlds.
    pub success_p: f64,
    /// Of times and lengths, where there are worlds that both solved.
    pub quantities: Vec<Quantity>,
}

/// A quantity on worlds that both solved.
#[derive(Clone, Debug, PartialEq)]
pub struct Quantity {
    /// What, with its unit.
    pub name: &'static str,
    /// Worlds that both solved.
    pub worlds: usize,
    /// Median of both sides.
    pub medians: [f64; 2],
    /// Mean of the differences.
    pub difference: Estimate,
    /// Two-sided p of the signed-rank test.
    pub p: f64,
}

/// What is measured of a success.
type Measure = fn(&Episode) -> Option<f64>;

const QUANTITIES: [(&str, Measure); 4] = [
    ("time to the goal, s", |episode| Some(episode.time_s)),
    ("path efficiency", |episode| episode.path_efficiency),
    ("smoothness", |episode| Some(episode.smoothness)),
    ("least clearance, m", |episode| Some(episode.clearance_min_m)),
];

/// All pairs of a study that have rows.
pub fn pairs(study: &Study, cells: &Cells) -> Vec<Pair> {
    study.paired.iter().filter_map(|contrast| pair(study, cells, contrast)).collect()
}

fn pair(study: &Study, cells: &Cells, contrast: &Contrast) -> Option<Pair> {
    let runs = |method| cells.runs(method, contrast.gate, &contrast.family);
    let (first, second) = (runs(contrast.method)?, runs(contrast.against)?);
    let worlds = shared_worlds(&[first, second]);
    let tables = [first, second].map(|runs| table(runs, &worlds, Metric::Success));
    let [a, b] = tables.each_ref().map(Table::by_world);
    let differences: Vec<f64> = a.iter().zip(&b).map(|(a, b)| a - b).collect();
    let wins = [
        differences.iter().filter(|&&difference| difference > 0.0).count(),
        differences.iter().filter(|&&difference| difference < 0.0).count(),
    ];
    let is_single = tables.iter().all(|table| table.seeds() == 1);
    let success_p = if is_single { mcnemar(wins[0], wins[1]) } else { signed_rank(&differences)?.p };
    Some(Pair {
        contrast: contrast.clone(),
        worlds: worlds.len(),
        wins,
        success: difference(study, &tables)?,
        success_p,
        quantities: quantities(study, &worlds, [first, second]),
    })
}

/// Difference of means, with its interval.
fn difference(study: &Study, [a, b]: &[Table; 2]) -> Option<Estimate> {
    let of = |scores: &Scores| {
        let mean = |method: usize| mean(&scores[method][0]).unwrap_or(f64::NAN);
        vec![mean(0) - mean(1)]
    };
    let interval = study.bootstrap.intervals(&[vec![a], vec![b]], of).first().copied()??;
    Some(Estimate { value: mean(&a.scores())? - mean(&b.scores())?, interval })
}

fn quantities(study: &Study, worlds: &[u64], sides: [&Runs; 2]) -> Vec<Quantity> {
    let quantity = |&(name, measure): &(&'static str, Measure)| {
        let [a, b] = sides.map(|runs| solved(runs, worlds, measure));
        let both: Vec<(f64, f64)> = a.iter().filter_map(|(world, &a)| Some((a, *b.get(world)?))).collect();
        let differences: Vec<f64> = both.iter().map(|(a, b)| a - b).collect();
        let medians = [
            median(&both.iter().map(|pair| pair.0).collect::<Vec<_>>())?,
            median(&both.iter().map(|pair| pair.1).collect::<Vec<_>>())?,
        ];
        let table = Table::new(vec![differences.clone()]);
        let mean_of = |scores: &Scores| vec![scores[0][0][0]];
        let interval = study.bootstrap.intervals(&[vec![&table]], mean_of).first().copied()??;
        Some(Quantity {
            name,
            worlds: both.len(),
            medians,
            difference: Estimate { value: mean(&differences)?, interval },
            p: signed_rank(&differences)?.p,
        })
    };
    QUANTITIES.iter().filter_map(quantity).collect()
}

/// A measure in each world that at least one run solved: the mean over the runs that did.
fn solved(runs: &Runs, worlds: &[u64], measure: Measure) -> BTreeMap<u64, f64> {
    let of_world = |&world: &u64| {
        let episodes = runs.values().filter_map(|run| run.get(&world));
        let values: Vec<f64> =
            episodes.filter(|episode| episode.end == End::Success).filter_map(measure).collect();
        Some((world, mean(&values)?))
    };
    worlds.iter().filter_map(of_world).collect()
}
