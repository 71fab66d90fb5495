//! Times and their percentiles.

use serde::Serialize;
use std::time::{Duration, Instant};

/// Percentiles of a set of run times, nanoseconds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Percentiles {
    /// Half of the runs took at most this long.
    pub median_ns: u64,
    /// 99 % took at most this long.
    pub p99_ns: u64,
    /// 99.9 % took at most this long; with fewer than a thousand runs, the slowest.
    pub p999_ns: u64,
    /// The slowest.
    pub max_ns: u64,
}

impl Percentiles {
    /// Percentiles by nearest rank.
    ///
    /// # Panics
    /// Without times.
    pub fn of(mut times_ns: Vec<u64>) -> Self {
        assert!(!times_ns.is_empty(), "percentiles need times");
        times_ns.sort_unstable();
        let rank = |per_mille: usize| times_ns[(times_ns.len() * per_mille).div_ceil(1000).max(1) - 1];
        Self { median_ns: rank(500), p99_ns: rank(990), p999_ns: rank(999), max_ns: rank(1000) }
    }
}

/// Runs `prepare` and `work` in turn and times `work` alone.
pub(super) fn time<E>(
    runs: usize,
    mut prepare: impl FnMut() -> Result<(), E>,
    mut work: impl FnMut() -> Result<(), E>,
) -> Result<Percentiles, E> {
    let mut times_ns = Vec::with_capacity(runs);
    for _ in 0..runs {
        prepare()?;
        let start = Instant::now();
        work()?;
        times_ns.push(nanoseconds(start.elapsed()));
    }
    Ok(Percentiles::of(times_ns))
}

fn nanoseconds(duration: Duration) -> u64 {
    u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_nearest_ranks() {
        let times = (1..=1000).rev().collect();
        let expected = Percentiles { median_ns: 500, p99_ns: 990, p999_ns: 999, max_ns: 1000 };
        assert_eq!(Percentiles::of(times), expected);
        let one = Percentiles { median_ns: 7, p99_ns: 7, p999_ns: 7, max_ns: 7 };
        assert_eq!(Percentiles::of(vec![7]), one);
    }

    #[test]
    fn only_the_work_is_timed() {
        let slow = || {
            std::thread::sleep(Duration::from_millis(20));
            Ok::<_, ()>(())
        };
        let figures = time(3, slow, || Ok(())).unwrap();
        assert!(figures.median_ns < 20_000_000, "{figures:?}");
    }
}
