//! Whether scans come at the rate that the policy was trained for.

use nav_core::guard::Cause;
use nav_core::messages::Header;

/// So many scans are looked at.
const SCANS: u64 = 30;
/// A rate may differ by this share.
const TOLERANCE: f64 = 0.25;

/// Measures the time from scan to scan by their own stamps and count, so that scans which were not read do not matter.
#[derive(Clone, Copy, Debug)]
pub struct ScanRate {
    period_ns: u64,
    first: Header,
    is_told: bool,
}

impl ScanRate {
    /// For a policy of this control period.
    pub fn new(period_ns: u64) -> Self {
        Self { period_ns, first: Header::default(), is_told: false }
    }

    /// Takes in a scan; says once when they come at another rate.
    pub fn note(&mut self, scan: &Header) -> Option<Cause> {
        if !self.first.is_received() || scan.seq < self.first.seq || scan.stamp_ns < self.first.stamp_ns {
            self.first = *scan;
        }
        let scans = scan.seq - self.first.seq;
        if scans < SCANS || self.is_told {
            return None;
        }
        let found_ns = (scan.stamp_ns - self.first.stamp_ns) as f64 / scans as f64;
        self.first = *scan;
        let is_odd = (found_ns / self.period_ns as f64 - 1.0).abs() > TOLERANCE;
        self.is_told = is_odd;
        is_odd
            .then(|| Cause::Rate { trained_s: self.period_ns as f32 / 1e9, found_s: (found_ns / 1e9) as f32 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is said about scans that come every `interval_ns`, of which every `read`-th is read.
    fn said(interval_ns: u64, read: u64) -> Vec<String> {
        let mut rate = ScanRate::new(100_000_000);
        let headers = (1..=200).map(|seq| Header { seq: seq * read, stamp_ns: seq * read * interval_ns });
        headers.filter_map(|header| rate.note(&header)).map(|cause| cause.to_string()).collect()
    }

    #[test]
    fn another_rate_is_said_once_with_both_numbers() {
        assert_eq!(said(100_000_000, 1), Vec::<String>::new());
        assert_eq!(said(110_000_000, 1), Vec::<String>::new());
        let slow = said(250_000_000, 1);
        assert_eq!(slow.len(), 1, "{slow:?}");
        assert!(slow[0].contains("every 250 ms") && slow[0].contains("10 Hz"), "{slow:?}");
        assert!(said(25_000_000, 4)[0].contains("every 25 ms"), "read every fourth");
    }
}
