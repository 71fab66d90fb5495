//! Durations counted in a fixed table, and their percentiles.

use hdrhistogram::Histogram;
use serde::{Deserialize, Serialize};

/// Longer durations count as this one, ns: 18 minutes.
const LONGEST_NS: u64 = 1 << 40;
/// Percentiles are exact to 1 %.
const DIGITS: u8 = 2;

/// Counts durations in nanoseconds. Recording touches no heap.
#[derive(Clone, Debug)]
pub struct Latencies {
    table: Histogram<u32>,
    max_ns: u64,
}

/// What durations come to, ns.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Percentiles {
    /// Durations counted.
    pub count: u64,
    /// Mean.
    pub mean_ns: f64,
    /// Half are at most this.
    pub p50_ns: u64,
    /// 99 of 100 are at most this.
    pub p99_ns: u64,
    /// 999 of 1000 are at most this.
    pub p999_ns: u64,
    /// The largest, exactly.
    pub max_ns: u64,
}

impl Default for Latencies {
    /// None counted yet.
    fn default() -> Self {
        let mut table = Histogram::new_with_bounds(1, LONGEST_NS, DIGITS).expect("fixed bounds that fit");
        // Writes to every page, so that the first recording in a loop does not have to wait for one.
        table.clear();
        Self { table, max_ns: 0 }
    }
}

impl Latencies {
    /// Counts a duration.
    pub fn record(&mut self, duration_ns: u64) {
        self.table.saturating_record(duration_ns);
        self.max_ns = self.max_ns.max(duration_ns);
    }

    /// The usual percentiles; all zero without any durations.
    pub fn percentiles(&self) -> Percentiles {
        // The table knows a range, whose upper end may lie above what was ever recorded.
        let quantile = |share: f64| self.table.value_at_quantile(share).min(self.max_ns);
        Percentiles {
            count: self.table.len(),
            mean_ns: self.table.mean(),
            p50_ns: quantile(0.5),
            p99_ns: quantile(0.99),
            p999_ns: quantile(0.999),
            max_ns: self.max_ns,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_of_a_known_set() {
        let mut latencies = Latencies::default();
        for microsecond in 1..=1000 {
            latencies.record(microsecond * 1000);
        }
        let p = latencies.percentiles();
        let near = |found_ns: f64, expected_ns: f64| (found_ns / expected_ns - 1.0).abs() < 0.01;
        for (found_ns, expected_ns) in [(p.p50_ns, 5e5), (p.p99_ns, 9.9e5), (p.p999_ns, 9.99e5)] {
            assert!(near(found_ns as f64, expected_ns), "{p:?}");
        }
        assert!(near(p.mean_ns, 500_500.0), "{p:?}");
        assert_eq!((p.count, p.max_ns), (1000, 1_000_000));
    }

    #[test]
    fn no_percentile_exceeds_the_largest() {
        let mut latencies = Latencies::default();
        latencies.record(1_000_001);
        let p = latencies.percentiles();
        assert_eq!((p.p50_ns, p.p999_ns, p.max_ns), (1_000_001, 1_000_001, 1_000_001));
    }

    #[test]
    fn nothing_and_what_is_too_long_are_counted_without_a_panic() {
        let mut latencies = Latencies::default();
        assert_eq!(latencies.percentiles(), Percentiles::default());
        for _ in 0..2 {
            latencies.record(u64::MAX);
        }
        latencies.record(0);
        let p = latencies.percentiles();
        assert_eq!((p.count, p.max_ns), (3, u64::MAX));
        assert!(p.p99_ns >= LONGEST_NS, "{p:?}");
    }
}
