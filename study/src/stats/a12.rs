//! Vargha and Delaney's A (2000, "A critique and improvement of the CL common language effect size statistics"): the
//! probability that a seed of the one method scores higher than a seed of the other, equal scores counted half.
//!
//! Its mean over families is the probability of improvement of Agarwal et al. (2021, "Deep reinforcement learning at the
//! edge of the statistical precipice").

use std::cmp::Ordering;

/// A of `a` over `b`: 0.5 where neither is larger, 1 where each of `a` is; none where one is empty.
pub fn a12(a: &[f64], b: &[f64]) -> Option<f64> {
    let pairs = a.iter().flat_map(|x| b.iter().map(move |y| x.partial_cmp(y)));
    let wins: f64 = pairs
        .map(|order| match order {
            Some(Ordering::Greater) => 1.0,
            Some(Ordering::Equal) => 0.5,
            _ => 0.0,
        })
        .sum();
    let count = a.len() * b.len();
    (count > 0).then(|| wins / count as f64)
}

/// Mean of [`a12`] over families: `a` and `b` hold the seeds' scores of each.
pub fn probability_of_improvement(a: &[Vec<f64>], b: &[Vec<f64>]) -> Option<f64> {
    let each: Option<Vec<f64>> = a.iter().zip(b).map(|(a, b)| a12(a, b)).collect();
    super::mean(&each?)
}

/// What a size of A is called (their thresholds: 0.56, 0.64, 0.71).
pub fn words(a: f64) -> &'static str {
    match (a - 0.5).abs() {
        d if d < 0.06 => "negligible",
        d if d < 0.14 => "small",
        d if d < 0.21 => "medium",
        _ => "large",
    }
}
