//! Performance profiles (Dolan and Moré 2002; for runs of learned policies Agarwal et al. 2021): the share of all scores, of
//! every seed on every family, that lie above a threshold. A curve above another at every threshold is better throughout.

/// Share of scores, by family and seed, above each threshold; 0 without scores.
pub fn profile(scores: &[Vec<f64>], thresholds: &[f64]) -> Vec<f64> {
    let count = scores.iter().map(Vec::len).sum::<usize>().max(1) as f64;
    let above =
        |&threshold: &f64| scores.iter().flatten().filter(|&&score| score > threshold).count() as f64 / count;
    thresholds.iter().map(above).collect()
}
