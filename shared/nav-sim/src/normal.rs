//! Normally distributed numbers with the same bits on every machine.
//!
//! The registry's generators ask the system's `exp` and `ln`, whose last bits differ between C libraries. This
//! one inverts the distribution function with sums, products, a square root and `libm`: Wichura, *The percentage
//! points of the normal distribution*, algorithm AS 241 (PPND7), 1988, whose relative error is about 1e-7.

use rand::{Rng, RngExt};

/// The middle of the distribution, where a rational function of the probability does: |p - 1/2| up to this.
const MIDDLE: f64 = 0.425;

/// A number with mean 0 and standard deviation 1. Each takes one draw; none lies beyond 6.4.
pub fn standard_normal(rng: &mut (impl Rng + ?Sized)) -> f32 {
    quantile((f64::from(rng.random::<u32>()) + 0.5) / 4_294_967_296.0) as f32
}

/// The number below which a share `probability` of the distribution lies; `probability` in [1e-10, 1 - 1e-10].
fn quantile(probability: f64) -> f64 {
    let from_half = probability - 0.5;
    if from_half.abs() <= MIDDLE {
        let r = MIDDLE * MIDDLE - from_half * from_half;
        let above = ((59.109_374_720 * r + 159.291_132_02) * r + 50.434_271_938) * r + 3.387_132_717_9;
        let below = ((67.187_563_600 * r + 78.757_757_664) * r + 17.895_169_469) * r + 1.0;
        return from_half * above / below;
    }
    let r = (-libm::log(probability.min(1.0 - probability))).sqrt() - 1.6;
    let above = ((0.170_238_211_03 * r + 1.306_728_481_6) * r + 2.756_815_390_0) * r + 1.423_437_277_7;
    let below = (0.120_211_329_75 * r + 0.737_001_642_50) * r + 1.0;
    (above / below).copysign(from_half)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_xoshiro::Xoshiro256PlusPlus;

    /// Quantiles as Python's `statistics.NormalDist().inv_cdf` gives them.
    #[test]
    fn quantiles_are_those_of_the_tables() {
        let known = [
            (0.4, -0.253_347_103),
            (0.25, -0.674_489_750),
            (0.075, -1.439_531_471),
            (0.074, -1.446_632_067),
            (0.01, -2.326_347_874),
            (0.001, -3.090_232_306),
            (1e-6, -4.753_424_309),
            (2e-10, -6.254_027_707),
        ];
        for (probability, expected) in known {
            let found = quantile(probability);
            assert!((found - expected).abs() <= 2e-7 * expected.abs(), "{probability}: {found} {expected}");
            assert!((quantile(1.0 - probability) + found).abs() < 1e-6, "the other side of {probability}");
        }
    }

    #[test]
    fn samples_have_the_moments_of_the_distribution() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
        let count = 400_000;
        let mut moments = [0.0_f64; 4];
        for _ in 0..count {
            let value = f64::from(standard_normal(&mut rng));
            let mut power = 1.0;
            for moment in &mut moments {
                power *= value;
                *moment += power / f64::from(count);
            }
        }
        for (found, expected) in moments.into_iter().zip([0.0, 1.0, 0.0, 3.0]) {
            assert!((found - expected).abs() < 0.05, "{moments:?}");
        }
    }
}
