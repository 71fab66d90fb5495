//! The statistics that the plan of a study declares, one file each.
//!
//! The unit is the training seed: a method has one score a seed and family, its mean over worlds. All functions are exact, but
//! for the bootstrap, which draws from a seeded generator: the same rows give the same figures.
//!
//! | file | holds |
//! |---|---|
//! | [`ranks`] | mid-ranks, rank correlation |
//! | [`mann_whitney`] | do the seeds of one method score higher than those of another? |
//! | [`holm`] | p-values of several such questions |
//! | [`a12`] | how much higher: Vargha-Delaney's effect size, and the probability of improvement over families |
//! | [`iqm`] | the interquartile mean |
//! | [`bootstrap`] | intervals over new seeds and new worlds |
//! | [`profile`] | performance profiles |
//! | [`non_inferiority`] | not worse by more than a margin |
//! | [`mcnemar`] | two policies in the same worlds: success |
//! | [`signed_rank`] | two policies in the same worlds: times and lengths |

pub mod ranks;
pub mod mann_whitney;
pub mod holm;
pub mod a12;
pub mod iqm;
pub mod bootstrap;
pub mod profile;
pub mod non_inferiority;
pub mod mcnemar;
pub mod signed_rank;

/// From `low` to `high`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

impl Interval {
    /// Whether a value lies outside.
    pub fn excludes(self, value: f64) -> bool {
        value < self.low || value > self.high
    }
}

/// Arithmetic mean; none of nothing.
pub fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// Quantile `share` (0 to 1) with linear interpolation between order statistics, as numpy's default; none of nothing.
/// `sorted` ascends.
pub fn quantile(sorted: &[f64], share: f64) -> Option<f64> {
    let place = share.clamp(0.0, 1.0) * sorted.len().checked_sub(1)? as f64;
    let (below, above) = (sorted[place.floor() as usize], sorted[place.ceil() as usize]);
    Some(below + (above - below) * place.fract())
}

/// Median; none of nothing.
pub fn median(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    quantile(&sorted, 0.5)
}
