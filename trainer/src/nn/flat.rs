//! Passes over whole networks as flat slices.

use super::kernels::{lane_sum, vectorised};

vectorised! {
    /// Polyak averaging: `target += rate * (source - target)`.
    pub fn polyak(target: &mut [f32], source: &[f32], rate: f32) {
        for (target, source) in target.iter_mut().zip(source) {
            *target += rate * (source - *target);
        }
    }
}

vectorised! {
    /// `values *= factor`.
    pub fn scale(values: &mut [f32], factor: f32) {
        for value in values {
            *value *= factor;
        }
    }
}

vectorised! {
    fn sum_of_squares(values: &[f32], result: &mut f32) {
        *result = lane_sum(values, values, |a, b| a * b);
    }
}

/// Euclidean norm.
pub fn norm(values: &[f32]) -> f32 {
    let mut sum = 0.0;
    sum_of_squares(values, &mut sum);
    sum.sqrt()
}

/// Arithmetic mean.
pub fn mean(values: &[f32]) -> f32 {
    values.iter().sum::<f32>() / values.len() as f32
}

/// Shrinks `gradient` so that its Euclidean norm is at most `limit`; 0 means no limit.
///
/// Returns the norm before.
pub fn clip_norm(gradient: &mut [f32], limit: f32) -> f32 {
    let norm = norm(gradient);
    if limit > 0.0 && norm > limit {
        scale(gradient, limit / norm);
    }
    norm
}
