//! Durations counted in a fixed table, exact to 1.6 %.

/// Buckets in each power of two.
const SUB_BITS: u32 = 6;
const SUB: usize = 1 << SUB_BITS;
/// Durations from 2^40 ns (18 minutes) on share the last bucket.
const OCTAVES: usize = 40 - SUB_BITS as usize + 1;

/// Counts durations in nanoseconds. Recording touches no heap.
#[derive(Clone, Debug)]
pub struct Histogram {
    counts: Box<[u32; OCTAVES * SUB]>,
    count: u64,
    sum_ns: u128,
    max_ns: u64,
}

/// What a histogram comes to, ns.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
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

impl Default for Histogram {
    fn default() -> Self {
        Self { counts: Box::new([0; OCTAVES * SUB]), count: 0, sum_ns: 0, max_ns: 0 }
    }
}

impl Histogram {
    /// Counts a duration.
    pub fn record(&mut self, duration_ns: u64) {
        let bucket = &mut self.counts[bucket_of(duration_ns)];
        *bucket = bucket.saturating_add(1);
        self.count += 1;
        self.sum_ns += u128::from(duration_ns);
        self.max_ns = self.max_ns.max(duration_ns);
    }

    /// The usual percentiles.
    pub fn percentiles(&self) -> Percentiles {
        Percentiles {
            count: self.count,
            mean_ns: if self.count == 0 { 0.0 } else { self.sum_ns as f64 / self.count as f64 },
            p50_ns: self.quantile(0.5),
            p99_ns: self.quantile(0.99),
            p999_ns: self.quantile(0.999),
            max_ns: self.max_ns,
        }
    }

    /// The upper end of the bucket in which the quantile lies, at most the maximum; 0 without any durations.
    pub fn quantile(&self, share: f64) -> u64 {
        let wanted = ((share * self.count as f64).ceil() as u64).max(1);
        let mut seen = 0;
        for (bucket, count) in self.counts.iter().enumerate() {
            seen += u64::from(*count);
            if seen >= wanted {
                return upper_end_ns(bucket).min(self.max_ns);
            }
        }
        self.max_ns
    }
}

/// The first octave is linear; each further one has `SUB` buckets of twice the width.
fn bucket_of(duration_ns: u64) -> usize {
    if duration_ns < SUB as u64 {
        return duration_ns as usize;
    }
    let shift = duration_ns.ilog2() - SUB_BITS;
    let bucket = (shift as usize + 1) * SUB + (duration_ns >> shift) as usize - SUB;
    bucket.min(OCTAVES * SUB - 1)
}

fn upper_end_ns(bucket: usize) -> u64 {
    let (octave, sub) = (bucket / SUB, (bucket % SUB) as u64);
    match octave {
        0 => sub,
        _ => ((sub + SUB as u64 + 1) << (octave - 1)) - 1,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_duration_lies_in_its_bucket() {
        let mut last_end_ns = None;
        for bucket in 0..OCTAVES * SUB {
            let end_ns = upper_end_ns(bucket);
            assert_eq!(bucket_of(end_ns), bucket);
            if let Some(last_ns) = last_end_ns {
                assert_eq!(bucket_of(last_ns + 1), bucket, "no gap and no overlap");
                let width = (end_ns - last_ns) as f64;
                assert!(width <= 1.0 || width / end_ns as f64 <= 1.0 / 64.0, "exact to 1.6 %");
            }
            last_end_ns = Some(end_ns);
        }
        assert_eq!(bucket_of(u64::MAX), OCTAVES * SUB - 1);
    }

    #[test]
    fn percentiles_of_a_known_set() {
        let mut histogram = Histogram::default();
        for microsecond in 1..=1000 {
            histogram.record(microsecond * 1000);
        }
        let p = histogram.percentiles();
        let near = |found_ns: u64, expected_ns: f64| (found_ns as f64 / expected_ns - 1.0).abs() < 0.02;
        assert!(near(p.p50_ns, 5e5) && near(p.p99_ns, 9.9e5) && near(p.p999_ns, 9.99e5), "{p:?}");
        assert_eq!((p.count, p.max_ns), (1000, 1_000_000));
        assert!((p.mean_ns - 500_500.0).abs() < 1.0);
        assert_eq!(Histogram::default().percentiles(), Percentiles::default());
    }
}
