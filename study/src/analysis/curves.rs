//! Learning curves: every seed, their interquartile mean, whether they stay where they came to, and whether what was
//! paid for is what was wanted.

use std::collections::BTreeMap;

use crate::plan::Study;
use crate::rows::CurveRow;
use crate::stats::iqm::iqm;
use crate::stats::median;
use crate::stats::ranks::rank_correlation;

/// Last share of a run in which it should stay where it is.
const LAST_SHARE: f64 = 0.2;

/// A seed's curve, ascending in steps.
#[derive(Clone, Debug, PartialEq)]
pub struct SeedCurve {
    /// The training seed.
    pub seed: u64,
    /// Its looks.
    pub points: Vec<CurveRow>,
}

/// The interquartile means of seeds at a look.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Middle {
    /// Environment steps: the median, since what a high level decides says how many its stage takes.
    pub env_steps: u64,
    /// Of success.
    pub success: f64,
    /// Of collisions.
    pub collision: f64,
}

/// The curves of a method.
#[derive(Clone, Debug, PartialEq)]
pub struct MethodCurves {
    /// Index of the method.
    pub method: usize,
    /// By seed.
    pub seeds: Vec<SeedCurve>,
    /// Of all seeds, look by look, as long as at least half of them were looked at.
    pub iqm: Vec<Middle>,
    /// By how much success over the last fifth strays from its median at most, of the seed that strays most.
    pub strays: Option<f64>,
    /// Mean spin of the last look, over seeds.
    pub spin: Option<f64>,
    /// Median over seeds of the rank correlation of return and success over training.
    pub return_follows_success: Option<f64>,
}

/// The curves of each method that has any; rows of others, and of seeds that are not in the study, are not its.
pub fn by_method(study: &Study, rows: &[CurveRow]) -> Vec<MethodCurves> {
    let of_method = |(index, entry): (usize, &crate::plan::Entry)| {
        let mut seeds: BTreeMap<u64, Vec<CurveRow>> = BTreeMap::new();
        let own =
            rows.iter().filter(|row| row.method == entry.name && entry.seeds.contains(&row.training_seed));
        for row in own {
            seeds.entry(row.training_seed).or_default().push(row.clone());
        }
        (!seeds.is_empty()).then(|| curves(index, seeds))
    };
    study.methods.iter().enumerate().filter_map(of_method).collect()
}

fn curves(method: usize, seeds: BTreeMap<u64, Vec<CurveRow>>) -> MethodCurves {
    let seed_curve = |(seed, mut points): (u64, Vec<CurveRow>)| {
        points.sort_by_key(|point| point.env_steps);
        SeedCurve { seed, points }
    };
    let seeds: Vec<SeedCurve> = seeds.into_iter().map(seed_curve).collect();
    let strays = seeds.iter().filter_map(strays).reduce(f64::max);
    let last_spin: Vec<f64> = seeds.iter().filter_map(|curve| curve.points.last()?.spin).collect();
    let correlations: Vec<f64> = seeds.iter().filter_map(correlation).collect();
    MethodCurves {
        method,
        iqm: middle(&seeds),
        strays,
        spin: crate::stats::mean(&last_spin),
        return_follows_success: median(&correlations),
        seeds,
    }
}

fn middle(seeds: &[SeedCurve]) -> Vec<Middle> {
    let longest = seeds.iter().map(|curve| curve.points.len()).max().unwrap_or(0);
    let of_look = |look: usize| {
        let points: Vec<&CurveRow> = seeds.iter().filter_map(|curve| curve.points.get(look)).collect();
        if 2 * points.len() < seeds.len() {
            return None;
        }
        let values =
            |value: fn(&CurveRow) -> f64| points.iter().map(|point| value(point)).collect::<Vec<_>>();
        Some(Middle {
            env_steps: median(&values(|point| point.env_steps as f64))? as u64,
            success: iqm(&values(|point| point.success))?,
            collision: iqm(&values(|point| point.collision))?,
        })
    };
    (0..longest).map_while(of_look).collect()
}

/// By how much success strays from its median over the last fifth of a curve; none with fewer than three looks there.
fn strays(curve: &SeedCurve) -> Option<f64> {
    let from = curve.points.last()?.env_steps as f64 * (1.0 - LAST_SHARE);
    let last = curve.points.iter().filter(|point| point.env_steps as f64 >= from);
    let last: Vec<f64> = last.map(|point| point.success).collect();
    let middle = median(&last)?;
    (last.len() >= 3).then(|| last.iter().map(|success| (success - middle).abs()).fold(0.0, f64::max))
}

fn correlation(curve: &SeedCurve) -> Option<f64> {
    let pairs: Vec<(f64, f64)> =
        curve.points.iter().filter_map(|point| Some((point.episode_return?, point.success))).collect();
    let (returns, successes): (Vec<f64>, Vec<f64>) = pairs.into_iter().unzip();
    rank_correlation(&returns, &successes)
}
