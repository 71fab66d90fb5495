//! McNemar's test, exact (McNemar 1947): two policies in the same worlds. Only worlds that one solves and the other does not
//! tell them apart; under the null hypothesis either is as likely to be the one.

/// Two-sided p; `first` worlds are solved by the first policy alone, `second` by the second alone.
pub fn mcnemar(first: usize, second: usize) -> f64 {
    let total = first + second;
    let (mut tail, mut log_choose) = (0.0, 0.0);
    let log_total = total as f64 * std::f64::consts::LN_2;
    for hits in 0..=first.min(second) {
        if hits > 0 {
            log_choose += ((total - hits + 1) as f64).ln() - (hits as f64).ln();
        }
        tail += (log_choose - log_total).exp();
    }
    (2.0 * tail).min(1.0)
}
