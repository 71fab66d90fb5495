//! Percentile intervals of the hierarchical bootstrap: seeds are drawn, then worlds.
//!
//! The intervals are for new training seeds *and* new worlds of the same families. All policies drove the same worlds,
//! therefore the worlds of a family are drawn once for all seeds and methods: drawn anew for each seed, the luck of
//! easy worlds would average out over seeds, which it does not (Owen 2007, "The pigeonhole bootstrap"). A seed is drawn once
//! for all families, as it is one policy.

use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::{Interval, quantile};

/// Values of one method on one family: a row a seed, a column a world.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    rows: Vec<Vec<f64>>,
}

impl Table {
    /// A table of these rows, which are equally long.
    pub fn new(rows: Vec<Vec<f64>>) -> Self {
        debug_assert!(rows.windows(2).all(|pair| pair[0].len() == pair[1].len()));
        Self { rows }
    }

    /// Count of seeds.
    pub fn seeds(&self) -> usize {
        self.rows.len()
    }

    /// Count of worlds.
    pub fn worlds(&self) -> usize {
        self.rows.first().map_or(0, Vec::len)
    }

    /// Each seed's mean over worlds.
    pub fn scores(&self) -> Vec<f64> {
        self.rows.iter().filter_map(|row| super::mean(row)).collect()
    }

    /// Each world's mean over seeds.
    pub fn by_world(&self) -> Vec<f64> {
        let mean = |world| self.rows.iter().map(|row| row[world]).sum::<f64>() / self.rows.len() as f64;
        (0..self.worlds()).map(mean).collect()
    }

    /// Each seed's mean over worlds that count `weights[world]` times, `total` together.
    fn weighted(&self, weights: &[f64], total: f64) -> Vec<f64> {
        let score = |row: &Vec<f64>| {
            row.iter().zip(weights).map(|(value, weight)| value * weight).sum::<f64>() / total
        };
        self.rows.iter().map(score).collect()
    }
}

/// How intervals are drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bootstrap {
    /// How often seeds and worlds are drawn.
    pub resamples: usize,
    /// Of the generator.
    pub seed: u64,
    /// Share of resamples inside an interval, as in 0.95.
    pub coverage: f64,
}

/// Seeds' scores by method and family.
pub type Scores = Vec<Vec<Vec<f64>>>;

impl Bootstrap {
    /// An interval for each number of `statistic`, which is given scores by method, family and seed; `methods` holds each
    /// method's table of each family, with as many worlds as those of the other methods on that family. A resample in which a
    /// number is not finite is left out of its interval; none where there are no values.
    pub fn intervals(
        &self,
        methods: &[Vec<&Table>],
        statistic: impl Fn(&Scores) -> Vec<f64>,
    ) -> Vec<Option<Interval>> {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(self.seed);
        let mut found: Vec<Vec<f64>> = Vec::new();
        for _ in 0..self.resamples {
            let numbers = statistic(&drawn(methods, &mut rng));
            found.resize_with(numbers.len().max(found.len()), Vec::new);
            for (found, number) in found.iter_mut().zip(numbers) {
                if number.is_finite() {
                    found.push(number);
                }
            }
        }
        found.into_iter().map(|numbers| self.interval(numbers)).collect()
    }

    fn interval(&self, mut numbers: Vec<f64>) -> Option<Interval> {
        numbers.sort_by(f64::total_cmp);
        let tail = (1.0 - self.coverage) / 2.0;
        Some(Interval { low: quantile(&numbers, tail)?, high: quantile(&numbers, 1.0 - tail)? })
    }
}

/// Scores of drawn seeds on drawn worlds.
fn drawn(methods: &[Vec<&Table>], rng: &mut Xoshiro256PlusPlus) -> Scores {
    let families = methods.iter().map(Vec::len).max().unwrap_or(0);
    let weights: Vec<Vec<f64>> = (0..families)
        .map(|family| {
            let worlds = methods.iter().filter_map(|tables| tables.get(family)).map(|table| table.worlds());
            counts(worlds.max().unwrap_or(0), rng)
        })
        .collect();
    let of_method = |tables: &Vec<&Table>| {
        let seeds = tables.iter().map(|table| table.seeds()).max().unwrap_or(0);
        let picks: Vec<usize> = (0..seeds).map(|_| rng.random_range(0..seeds)).collect();
        let of_family = |(table, weights): (&&Table, &Vec<f64>)| {
            let scores = table.weighted(weights, weights.len() as f64);
            picks.iter().filter_map(|&pick| scores.get(pick).copied()).collect()
        };
        tables.iter().zip(&weights).map(of_family).collect()
    };
    methods.iter().map(of_method).collect()
}

/// How often each of `count` is drawn in `count` draws.
fn counts(count: usize, rng: &mut Xoshiro256PlusPlus) -> Vec<f64> {
    let mut counts = vec![0.0; count];
    for _ in 0..count {
        counts[rng.random_range(0..count)] += 1.0;
    }
    counts
}
