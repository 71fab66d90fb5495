//! Wilcoxon's signed-rank test, exact (Wilcoxon 1945): paired numbers of the same worlds. Differences of zero are dropped, equal
//! ones share mid-ranks.
//!
//! Under the null hypothesis each difference is as likely to have the one sign as the other; the distribution of the rank sum is
//! built up difference by difference, with the ranks that they really have. Two-sided p is twice the smaller tail, at most 1.

use super::ranks::twice_mid_ranks;

/// Most differences: the work grows with the third power.
pub const DIFFERENCES_MAX: usize = 1_200;

/// What the test says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SignedRank {
    /// Sum of the ranks of positive differences.
    pub plus: f64,
    /// Count of differences other than zero.
    pub count: usize,
    /// Probability of a sum at least as extreme, two-sided; 1 without differences.
    pub p: f64,
}

/// Tests whether differences lie about zero; none for more than [`DIFFERENCES_MAX`].
pub fn signed_rank(differences: &[f64]) -> Option<SignedRank> {
    let other: Vec<f64> = differences.iter().copied().filter(|difference| difference.abs() > 0.0).collect();
    if other.len() > DIFFERENCES_MAX {
        return None;
    }
    let ranks = twice_mid_ranks(&other.iter().map(|difference| difference.abs()).collect::<Vec<_>>());
    let plus: usize = ranks.iter().zip(&other).filter(|(_, value)| **value > 0.0).map(|(rank, _)| rank).sum();
    let total: usize = ranks.iter().sum();
    // Either tail: turning all signs mirrors the distribution.
    let tail = share_up_to(&ranks, plus.min(total - plus));
    Some(SignedRank { plus: plus as f64 / 2.0, count: other.len(), p: (2.0 * tail).min(1.0) })
}

/// Share of all choices of signs whose sum of positive ranks is `most` or less.
fn share_up_to(ranks: &[usize], most: usize) -> f64 {
    let mut shares = vec![0.0; most + 1];
    shares[0] = 1.0;
    for &rank in ranks {
        for sum in (0..=most).rev() {
            let with = if sum >= rank { shares[sum - rank] } else { 0.0 };
            shares[sum] = 0.5 * (shares[sum] + with);
        }
    }
    shares.iter().sum()
}
