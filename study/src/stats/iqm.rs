//! The interquartile mean: the mean of the middle half. It is moved less by one odd seed than the mean, and wastes less than the
//! median (Agarwal et al. 2021).

use super::mean;

/// Mean without the lowest and the highest quarter, each rounded down to whole values (two of ten), as scipy's
/// `trim_mean(values, 0.25)`; none of nothing.
pub fn iqm(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let cut = sorted.len() / 4;
    mean(&sorted[cut..sorted.len() - cut])
}
