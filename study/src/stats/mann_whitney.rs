//! Mann and Whitney's U test, exact (Mann and Whitney 1947, "On a test of whether one of two random variables is
//! stochastically larger than the other").
//!
//! Under the null hypothesis every split of the pooled values into two groups of these sizes is equally likely. The splits
//! are counted by their rank sum, one value after the other, with the mid-ranks that the values really have: ties need no
//! correction. Two-sided p is twice the smaller tail, at most 1, as in scipy.

use super::ranks::twice_mid_ranks;

/// Most values of both groups together: the count of splits grows with the fourth power.
pub const VALUES_MAX: usize = 120;

/// What the test says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MannWhitney {
    /// U of the first group: pairs in which it is greater, and half of those that are equal.
    pub u: f64,
    /// Probability of a U at least as extreme, two-sided.
    pub p: f64,
}

/// Tests `a` against `b`; none where one is empty or both have more than [`VALUES_MAX`] values together.
pub fn mann_whitney(a: &[f64], b: &[f64]) -> Option<MannWhitney> {
    let pooled: Vec<f64> = a.iter().chain(b).copied().collect();
    if a.is_empty() || b.is_empty() || pooled.len() > VALUES_MAX {
        return None;
    }
    let ranks = twice_mid_ranks(&pooled);
    let sum: usize = ranks[..a.len()].iter().sum();
    let splits = splits_by_sum(&ranks, a.len());
    let total: f64 = splits.iter().sum();
    let lower: f64 = splits[..=sum].iter().sum::<f64>() / total;
    let upper: f64 = splits[sum..].iter().sum::<f64>() / total;
    let least = a.len() * (a.len() + 1);
    Some(MannWhitney { u: (sum - least) as f64 / 2.0, p: (2.0 * lower.min(upper)).min(1.0) })
}

/// How many subsets of `size` ranks have each sum.
fn splits_by_sum(ranks: &[usize], size: usize) -> Vec<f64> {
    let most: usize = ranks.iter().sum();
    let mut counts = vec![vec![0.0_f64; most + 1]; size + 1];
    counts[0][0] = 1.0;
    for &rank in ranks {
        // Downwards, so that each rank is taken once.
        for taken in (1..=size).rev() {
            let (smaller, larger) = counts.split_at_mut(taken);
            let (from, to) = (&smaller[taken - 1], &mut larger[0]);
            for sum in rank..=most {
                to[sum] += from[sum - rank];
            }
        }
    }
    counts.swap_remove(size)
}
