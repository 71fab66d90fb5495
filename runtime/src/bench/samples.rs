//! Runs that are timed one by one.

use crate::latency::{Latencies, Percentiles};
use std::time::Instant;

/// Runs `prepare` and `work` in turn and times `work` alone.
pub(super) fn time<E>(
    runs: usize,
    mut prepare: impl FnMut() -> Result<(), E>,
    mut work: impl FnMut() -> Result<(), E>,
) -> Result<Percentiles, E> {
    let mut latencies = Latencies::default();
    for _ in 0..runs {
        prepare()?;
        let start = Instant::now();
        work()?;
        latencies.record(u64::try_from(start.elapsed().as_nanos()).unwrap_or(u64::MAX));
    }
    Ok(latencies.percentiles())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn only_the_work_is_timed() {
        let slow = || {
            std::thread::sleep(Duration::from_millis(20));
            Ok::<_, ()>(())
        };
        let figures = time(3, slow, || Ok(())).unwrap();
        assert!(figures.p50_ns < 20_000_000, "{figures:?}");
    }
}
