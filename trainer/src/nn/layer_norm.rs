//! Layer normalisation of the rows of a matrix (Ba, Kiros and Hinton 2016), followed by the rectifier.
//!
//! For a row `z`: `xhat = (z - mean(z)) / sqrt(var(z) + EPSILON)`, `y = max(scale * xhat + shift, 0)`. The
//! variance is the biased one, as in torch.

use super::kernels::{lane_sum, vectorised};

/// Added to the variance, as torch's default.
pub const EPSILON: f32 = 1e-5;

vectorised! {
    /// Forward pass, in place: `values` `[rows, n]` goes in as `z` without its bias and comes out as `y`.
    ///
    /// `normal` `[rows, n]` receives `xhat`, `inverse_deviation` `[rows]` receives `1 / sqrt(var + EPSILON)`.
    pub fn forward(
        values: &mut [f32],
        normal: &mut [f32],
        inverse_deviation: &mut [f32],
        bias: &[f32],
        scale: &[f32],
        shift: &[f32],
    ) {
        let n = bias.len();
        let rows = values.chunks_exact_mut(n).zip(normal.chunks_exact_mut(n)).zip(inverse_deviation);
        for ((row, normal), inverse_deviation) in rows {
            for (value, bias) in row.iter_mut().zip(bias) {
                *value += bias;
            }
            let mean = lane_sum(row, row, |value, _| value) / n as f32;
            let variance = lane_sum(row, row, |value, _| (value - mean) * (value - mean)) / n as f32;
            let inverse = 1.0 / (variance + EPSILON).sqrt();
            *inverse_deviation = inverse;
            for (((value, normal), scale), shift) in row.iter_mut().zip(normal).zip(scale).zip(shift) {
                *normal = (*value - mean) * inverse;
                *value = (*normal * scale + shift).max(0.0);
            }
        }
    }
}

vectorised! {
    /// Backward pass, in place: `gradient` `[rows, n]` goes in as the derivative by `xhat * scale + shift`
    /// (the rectifier's derivative already applied) and comes out as the derivative by `z`.
    ///
    /// `scale_gradient` and `shift_gradient` `[n]` are added to.
    pub fn backward(
        gradient: &mut [f32],
        normal: &[f32],
        inverse_deviation: &[f32],
        scale: &[f32],
        scale_gradient: &mut [f32],
        shift_gradient: &mut [f32],
    ) {
        let n = scale.len();
        let rows = gradient.chunks_exact_mut(n).zip(normal.chunks_exact(n)).zip(inverse_deviation);
        for ((row, normal), inverse) in rows {
            let sums = scale_gradient.iter_mut().zip(shift_gradient.iter_mut());
            for (((value, normal), scale), (scale_sum, shift_sum)) in
                row.iter_mut().zip(normal).zip(scale).zip(sums)
            {
                *shift_sum += *value;
                *scale_sum += *value * normal;
                *value *= scale;
            }
            let mean = lane_sum(row, row, |value, _| value) / n as f32;
            let mean_normal = lane_sum(row, normal, |value, normal| value * normal) / n as f32;
            for (value, normal) in row.iter_mut().zip(normal) {
                *value = (*value - mean - normal * mean_normal) * inverse;
            }
        }
    }
}
