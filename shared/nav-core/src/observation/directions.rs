//! The directions of the high level.

use crate::task::DIRECTION_COUNT;

/// Sine and cosine of `k * 22.5` degrees.
pub(super) const DIRECTION_SIN_COS: [(f32, f32); DIRECTION_COUNT] = {
    const A: f32 = 0.382_683_43;
    const B: f32 = core::f32::consts::FRAC_1_SQRT_2;
    const C: f32 = 0.923_879_5;
    [
        (0.0, 1.0),
        (A, C),
        (B, B),
        (C, A),
        (1.0, 0.0),
        (C, -A),
        (B, -B),
        (A, -C),
        (0.0, -1.0),
        (-A, -C),
        (-B, -B),
        (-C, -A),
        (-1.0, 0.0),
        (-C, A),
        (-B, B),
        (-A, C),
    ]
};
