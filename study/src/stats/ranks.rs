//! Mid-ranks: equal values share the mean of the ranks that they take up.

use std::cmp::Ordering;

/// Twice the mid-rank of each value, so that it is whole even where values are equal; the least distinct value has 2.
///
/// Values must be numbers: a NaN has no rank.
pub fn twice_mid_ranks(values: &[f64]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
    let mut ranks = vec![0; values.len()];
    let mut first = 0;
    while first < order.len() {
        let is_same =
            |&&other: &&usize| values[other].partial_cmp(&values[order[first]]) == Some(Ordering::Equal);
        let count = order[first..].iter().take_while(is_same).count().max(1);
        for &index in &order[first..first + count] {
            // Ranks first + 1 to first + count.
            ranks[index] = 2 * first + count + 1;
        }
        first += count;
    }
    ranks
}

/// Spearman's rank correlation of pairs, -1 to 1; none where either side is constant or there are fewer than three.
pub fn rank_correlation(a: &[f64], b: &[f64]) -> Option<f64> {
    if a.len() != b.len() || a.len() < 3 {
        return None;
    }
    let deviations = |values: &[f64]| -> Vec<f64> {
        let ranks = twice_mid_ranks(values);
        let middle = (values.len() + 1) as f64;
        ranks.iter().map(|&rank| rank as f64 - middle).collect()
    };
    let (a, b) = (deviations(a), deviations(b));
    let product = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| x * y).sum::<f64>();
    let scale = (product(&a, &a) * product(&b, &b)).sqrt();
    (scale > 0.0).then(|| product(&a, &b) / scale)
}
