//! Element-wise functions, written from multiplications, additions and divisions only.
//!
//! Nothing here depends on the instruction set: all levels give the same bits, and loops over these functions vectorise.
//! Comparisons are written so that NaN stays NaN (`f32::min` and `max` would drop it).
//!
//! Largest error against `f64`, over all of the `f32` values tried in the tests: `tanh` 3 units in the last place, `sigmoid`
//! 3 (above 1e-37), `silu` 4.

/// A function applied to each element.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Activation {
    /// `x`
    Identity,
    /// `max(x, 0)`
    Relu,
    /// `x` where positive, else `slope * x`
    LeakyRelu {
        /// Factor on negative inputs.
        slope: f32,
    },
    /// Hyperbolic tangent.
    Tanh,
    /// `1 / (1 + exp(-x))`
    Sigmoid,
    /// `x * sigmoid(x)`, also called swish.
    Silu,
    /// `ln(1 + exp(x))`
    Softplus,
    /// `x` limited to `[min, max]`.
    Clip {
        /// Lower limit.
        min: f32,
        /// Upper limit.
        max: f32,
    },
}

/// Applies `activation` to each element in place. Inlined into one copy an instruction level.
#[inline(always)]
pub(super) fn apply(activation: Activation, values: &mut [f32]) {
    match activation {
        Activation::Identity => {}
        Activation::Relu => each(values, |x| if x < 0.0 { 0.0 } else { x }),
        Activation::LeakyRelu { slope } => each(values, |x| if x < 0.0 { slope * x } else { x }),
        Activation::Tanh => each(values, tanh),
        Activation::Sigmoid => each(values, sigmoid),
        Activation::Silu => each(values, |x| x * sigmoid(x)),
        Activation::Softplus => each(values, softplus),
        Activation::Clip { min, max } => each(values, |x| clip(x, min, max)),
    }
}

#[inline(always)]
fn each(values: &mut [f32], function: impl Fn(f32) -> f32) {
    for value in values {
        *value = function(*value);
    }
}

/// `x` limited to `[min, max]`; NaN stays NaN.
#[inline(always)]
fn clip(x: f32, min: f32, max: f32) -> f32 {
    let x = if x < min { min } else { x };
    if x > max { max } else { x }
}

/// `(2^n, e^r - 1)` with `x = n ln 2 + r` and `|r| <= ln 2 / 2`, for `|x| <= 88`.
///
/// The rounding to `n` adds a number so large that only whole steps remain; its low bits then hold `n`. The polynomial is the
/// Taylor series to the seventh power, whose remainder (5e-9 relative) is below half a unit in the last place.
#[inline(always)]
fn split_exp(x: f32) -> (f32, f32) {
    const ROUNDER: f32 = 12_582_912.0; // 1.5 * 2^23
    const LN_2_HIGH: f32 = 0.693_359_4; // 355 / 512: products with |n| < 2^15 are exact
    const LN_2_LOW: f32 = -2.121_944_4e-4;

    let shifted = x * core::f32::consts::LOG2_E + ROUNDER;
    let n = shifted - ROUNDER;
    let r = (x - n * LN_2_HIGH) - n * LN_2_LOW;
    let power = f32::from_bits((shifted.to_bits() << 23).wrapping_add(127 << 23));

    let p = 1.0 / 5040.0;
    let p = p * r + 1.0 / 720.0;
    let p = p * r + 1.0 / 120.0;
    let p = p * r + 1.0 / 24.0;
    let p = p * r + 1.0 / 6.0;
    let p = p * r + 0.5;
    (power, p * r * r + r)
}

/// Hyperbolic tangent by `t / (t + 2)` with `t = exp(2|x|) - 1`, which keeps its relative accuracy near zero.
#[inline(always)]
fn tanh(x: f32) -> f32 {
    // Above 10 the result rounds to 1.
    let twice = clip(x.abs() * 2.0, 0.0, 20.0);
    let (power, small) = split_exp(twice);
    let t = power * small + (power - 1.0);
    (t / (t + 2.0)).copysign(x)
}

/// `1 / (1 + exp(-x))`
#[inline(always)]
fn sigmoid(x: f32) -> f32 {
    let (power, small) = split_exp(clip(-x, -87.0, 87.0));
    1.0 / (1.0 + (power + power * small))
}

/// `ln(1 + exp(x))` as `max(x, 0) + ln(1 + exp(-|x|))`, which neither overflows nor cancels.
#[inline(always)]
fn softplus(x: f32) -> f32 {
    let positive = if x < 0.0 { 0.0 } else { x };
    positive + libm::log1pf(libm::expf(-x.abs()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn one(activation: Activation, x: f32) -> f32 {
        let mut value = [x];
        apply(activation, &mut value);
        value[0]
    }

    /// Error in units in the last place of the true value.
    fn ulps(found: f32, truth: f64) -> f64 {
        let nearest = truth as f32;
        let unit = f64::from(f32::from_bits(nearest.abs().to_bits() + 1)) - f64::from(nearest.abs());
        (f64::from(found) - truth).abs() / unit
    }

    /// Every 997th finite `f32` of both signs: four million values of every size.
    fn sweep(largest: f32, mut visit: impl FnMut(f32)) {
        for bits in (0..largest.to_bits()).step_by(997) {
            visit(f32::from_bits(bits));
            visit(-f32::from_bits(bits));
        }
    }

    #[test]
    fn tanh_is_within_three_units_in_the_last_place() {
        let mut worst = 0.0_f64;
        sweep(f32::MAX, |x| {
            if x.abs() >= f32::MIN_POSITIVE {
                worst = worst.max(ulps(one(Activation::Tanh, x), libm::tanh(f64::from(x))));
            }
        });
        assert!(worst <= 3.0, "worst error {worst} units");
    }

    #[test]
    fn sigmoid_and_silu_are_within_four_units_in_the_last_place() {
        let (mut worst_sigmoid, mut worst_silu) = (0.0_f64, 0.0_f64);
        sweep(85.0, |x| {
            let truth = 1.0 / (1.0 + libm::exp(-f64::from(x)));
            worst_sigmoid = worst_sigmoid.max(ulps(one(Activation::Sigmoid, x), truth));
            if x.abs() >= 1e-30 {
                worst_silu = worst_silu.max(ulps(one(Activation::Silu, x), f64::from(x) * truth));
            }
        });
        assert!(worst_sigmoid <= 3.0 && worst_silu <= 4.0, "sigmoid {worst_sigmoid}, silu {worst_silu}");
    }

    #[test]
    fn softplus_matches_its_definition() {
        sweep(80.0, |x| {
            let truth = libm::log1p(libm::exp(f64::from(x)));
            let found = f64::from(one(Activation::Softplus, x));
            assert!(
                (found - truth).abs() <= 1e-6 * truth.max(1e-3),
                "softplus({x}) = {found}, expected {truth}"
            );
        });
    }

    #[test]
    fn limits_are_exact() {
        for (activation, low, high) in [(Activation::Tanh, -1.0, 1.0), (Activation::Sigmoid, 0.0, 1.0)] {
            assert!((one(activation, f32::INFINITY) - high).abs() < 1e-30);
            assert!((one(activation, f32::NEG_INFINITY) - low).abs() < 1e-30);
        }
        let clip = Activation::Clip { min: -0.5, max: 2.0 };
        let clipped = [-1.0_f32, -0.5, 0.25, 2.0, 7.0].map(|x| one(clip, x));
        assert_eq!(clipped.map(f32::to_bits), [-0.5_f32, -0.5, 0.25, 2.0, 2.0].map(f32::to_bits));
        assert_eq!(one(Activation::LeakyRelu { slope: 0.5 }, -3.0).to_bits(), (-1.5_f32).to_bits());
        assert_eq!(one(Activation::Relu, -3.0).to_bits(), 0.0_f32.to_bits());
    }

    #[test]
    fn nan_is_never_hidden() {
        let all = [
            Activation::Identity,
            Activation::Relu,
            Activation::LeakyRelu { slope: 0.1 },
            Activation::Tanh,
            Activation::Sigmoid,
            Activation::Silu,
            Activation::Softplus,
            Activation::Clip { min: -1.0, max: 1.0 },
        ];
        for activation in all {
            assert!(one(activation, f32::NAN).is_nan(), "{activation:?} hides NaN");
        }
    }
}
