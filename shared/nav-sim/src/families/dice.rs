//! The random numbers of a generator.

use crate::normal::standard_normal;
use nav_core::geometry::Point;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::f32::consts::PI;
use std::ops::RangeInclusive;

/// A stream of random numbers that belongs to one world.
pub(super) struct Dice(Xoshiro256PlusPlus);

impl Dice {
    /// Different labels give different generator states: each word is mixed by a bijection.
    pub(super) fn new(label: [u64; 4]) -> Self {
        let mut state = [0; 32];
        for ((bytes, word), salt) in state.chunks_exact_mut(8).zip(label).zip(1_u64..) {
            bytes.copy_from_slice(&mixed(word, salt).to_le_bytes());
        }
        let mut rng = Xoshiro256PlusPlus::from_seed(state);
        // Labels that share words start in similar states: let them part.
        for _ in 0..16 {
            let _: u64 = rng.random();
        }
        Self(rng)
    }

    /// A seed for another generator.
    pub(super) fn seed(&mut self) -> u64 {
        self.0.random()
    }

    /// A number in an interval.
    pub(super) fn within(&mut self, range: RangeInclusive<f32>) -> f32 {
        self.0.random_range(range)
    }

    /// A normally distributed number, cut to an interval.
    pub(super) fn normal(&mut self, mean: f32, deviation: f32, range: RangeInclusive<f32>) -> f32 {
        (mean + deviation * standard_normal(&mut self.0)).clamp(*range.start(), *range.end())
    }

    /// A whole number in an interval.
    pub(super) fn count(&mut self, range: RangeInclusive<usize>) -> usize {
        self.0.random_range(range)
    }

    /// True with a probability.
    pub(super) fn chance(&mut self, probability: f64) -> bool {
        self.0.random_bool(probability)
    }

    /// A direction, rad.
    pub(super) fn angle(&mut self) -> f32 {
        self.within(-PI..=PI)
    }

    /// A point of the rectangle from `min` to `max` that keeps `margin_m` off its edge.
    pub(super) fn point(&mut self, min: Point, max: Point, margin_m: f32) -> Point {
        Point::new(
            self.within(min.x + margin_m..=max.x - margin_m),
            self.within(min.y + margin_m..=max.y - margin_m),
        )
    }

    /// Any order.
    pub(super) fn shuffle<T>(&mut self, items: &mut [T]) {
        for last in (1..items.len()).rev() {
            items.swap(last, self.count(0..=last));
        }
    }
}

/// The finaliser of SplitMix64 (Steele, Lea and Flood 2014): a bijection for each salt.
fn mixed(word: u64, salt: u64) -> u64 {
    let mut word = word.wrapping_add(salt.wrapping_mul(0x9e37_79b9_7f4a_7c15));
    word = (word ^ (word >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    word = (word ^ (word >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    word ^ (word >> 31)
}
