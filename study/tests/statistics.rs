//! The statistics against vectors of other code: see `vectors/make_vectors.py`.

use serde_json::Value;
use study::stats::a12::{a12, probability_of_improvement};
use study::stats::bootstrap::{Bootstrap, Scores, Table};
use study::stats::holm::holm;
use study::stats::iqm::iqm;
use study::stats::mann_whitney::mann_whitney;
use study::stats::mcnemar::mcnemar;
use study::stats::non_inferiority::Verdict;
use study::stats::profile::profile;
use study::stats::ranks::{rank_correlation, twice_mid_ranks};
use study::stats::signed_rank::signed_rank;
use study::stats::{Interval, quantile};

fn vectors(name: &str) -> Vec<Value> {
    let all: Value = serde_json::from_str(include_str!("vectors/statistics.json")).expect("JSON");
    let found = match &all[name] {
        Value::Array(cases) => cases.clone(),
        one => vec![one.clone()],
    };
    assert!(!found.is_empty() && !found[0].is_null(), "{name} has vectors");
    found
}

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().expect("numbers").iter().map(number).collect()
}

fn assert_near(ours: f64, theirs: f64, what: &Value) {
    let scale = theirs.abs().max(1e-300);
    assert!(
        (ours - theirs).abs() <= 1e-9 * scale || (ours - theirs).abs() < 1e-12,
        "{ours} is not {theirs}: {what}"
    );
}

#[test]
fn mann_whitney_is_scipys() {
    for case in vectors("mann_whitney") {
        let found = mann_whitney(&numbers(&case["a"]), &numbers(&case["b"])).expect("both have values");
        assert_near(found.u, number(&case["u"]), &case);
        assert_near(found.p, number(&case["p"]), &case);
    }
}

#[test]
fn mann_whitney_of_ten_seeds_apart_is_as_small_as_it_can_be() {
    let (low, high): (Vec<f64>, Vec<f64>) =
        (0..10).map(|seed| (f64::from(seed), f64::from(seed) + 10.0)).unzip();
    // One split of 184,756, in either direction.
    let p = mann_whitney(&high, &low).expect("both have values").p;
    assert!((p - 2.0 / 184_756.0).abs() < 1e-15, "{p}");
    assert_eq!(mann_whitney(&[], &low), None);
    assert_eq!(mann_whitney(&vec![0.0; 61], &vec![0.0; 60]), None);
}

#[test]
fn signed_rank_is_scipys() {
    for case in vectors("signed_rank") {
        let found = signed_rank(&numbers(&case["differences"])).expect("few enough");
        assert_near(found.plus, number(&case["plus"]), &case);
        assert_near(found.p, number(&case["p"]), &case);
    }
    let none = signed_rank(&[0.0, 0.0]).expect("few enough");
    assert_eq!((none.count, none.plus, none.p), (0, 0.0, 1.0));
    let many: Vec<f64> = (0..1_200).map(|world| if world % 2 == 0 { 1.0 } else { -1.0 }).collect();
    assert!(signed_rank(&many).expect("few enough").p > 0.99);
    assert_eq!(signed_rank(&vec![1.0; 1_201]), None);
}

#[test]
fn mcnemar_is_the_binomial_test_of_scipy() {
    for case in vectors("mcnemar") {
        let count = |name: &str| case[name].as_u64().expect("a count") as usize;
        assert_near(mcnemar(count("first"), count("second")), number(&case["p"]), &case);
    }
}

#[test]
fn holm_steps_down() {
    for case in vectors("holm") {
        let adjusted = holm(&numbers(&case["p"]));
        for (ours, theirs) in adjusted.iter().zip(numbers(&case["adjusted"])) {
            assert_near(*ours, theirs, &case);
        }
    }
    let by_hand = holm(&[0.01, 0.04, 0.03, 0.005]);
    for (ours, theirs) in by_hand.iter().zip([0.03, 0.06, 0.06, 0.02]) {
        assert!((ours - theirs).abs() < 1e-12, "{by_hand:?}");
    }
}

#[test]
fn effect_size_and_improvement() {
    let mut each = Vec::new();
    let (mut firsts, mut seconds) = (Vec::new(), Vec::new());
    for case in vectors("a12") {
        let (a, b) = (numbers(&case["a"]), numbers(&case["b"]));
        let found = a12(&a, &b).expect("both have values");
        assert_near(found, number(&case["a12"]), &case);
        each.push(found);
        firsts.push(a);
        seconds.push(b);
    }
    let mean = each.iter().sum::<f64>() / each.len() as f64;
    let found = probability_of_improvement(&firsts, &seconds).expect("families");
    assert!((found - mean).abs() < 1e-12);
    assert_eq!(a12(&[1.0], &[]), None);
}

#[test]
fn interquartile_mean_is_scipys_trimmed_mean() {
    for case in vectors("iqm") {
        assert_near(iqm(&numbers(&case["values"])).expect("values"), number(&case["iqm"]), &case);
    }
    assert_eq!(iqm(&[]), None);
}

#[test]
fn ranks_and_their_correlation() {
    assert_eq!(twice_mid_ranks(&[0.5, 0.1, 0.5, 0.0, -0.0]), [9, 6, 9, 3, 3]);
    for case in vectors("rank_correlation") {
        let found = rank_correlation(&numbers(&case["a"]), &numbers(&case["b"])).expect("pairs");
        assert_near(found, number(&case["rho"]), &case);
    }
    assert_eq!(rank_correlation(&[1.0, 1.0, 1.0], &[1.0, 2.0, 3.0]), None);
}

#[test]
fn quantiles_are_numpys() {
    for case in vectors("quantile") {
        let found = quantile(&numbers(&case["sorted"]), number(&case["share"])).expect("values");
        assert_near(found, number(&case["value"]), &case);
    }
    assert_eq!(quantile(&[], 0.5), None);
}

#[test]
fn profile_counts_what_is_above() {
    let case = &vectors("profile")[0];
    let scores: Vec<Vec<f64>> = case["scores"].as_array().expect("families").iter().map(numbers).collect();
    assert_eq!(profile(&scores, &numbers(&case["thresholds"])), numbers(&case["shares"]));
}

#[test]
fn verdicts_follow_the_interval() {
    let verdict = |low: f64, high: f64| Verdict::of(Interval { low, high }, 0.02);
    assert_eq!(verdict(0.001, 0.1), Verdict::Superior);
    assert_eq!(verdict(-0.019, 0.1), Verdict::NotInferior);
    assert_eq!(verdict(-0.02, 0.1), Verdict::Open);
    assert_eq!(verdict(-0.1, -0.02), Verdict::Open);
    assert_eq!(verdict(-0.1, -0.021), Verdict::Inferior);
}

fn table(value: &Value) -> Table {
    Table::new(value.as_array().expect("seeds").iter().map(numbers).collect())
}

fn iqm_difference_a12(scores: &Scores) -> Vec<f64> {
    let (a, b) = (&scores[0][0], &scores[1][0]);
    let (x, y) = (iqm(a).expect("seeds"), iqm(b).expect("seeds"));
    vec![x, x - y, a12(a, b).expect("seeds")]
}

/// Worlds differ more than seeds in these, so that worlds drawn anew for each seed would give intervals that are far narrower.
#[test]
fn bootstrap_agrees_with_numpys() {
    let case = &vectors("bootstrap")[0];
    let (a, b) = (table(&case["a"]), table(&case["b"]));
    let bootstrap = Bootstrap { resamples: 50_000, seed: 1, coverage: 0.95 };
    let found = bootstrap.intervals(&[vec![&a], vec![&b]], iqm_difference_a12);
    for (ours, theirs) in found.iter().zip(case["intervals"].as_array().expect("intervals")) {
        let (ours, theirs) = (ours.expect("an interval"), numbers(theirs));
        for (ours, theirs) in [(ours.low, theirs[0]), (ours.high, theirs[1])] {
            assert!((ours - theirs).abs() < 0.014, "{found:?} {theirs}");
        }
    }
}

#[test]
fn the_same_seed_gives_the_same_interval_and_another_one_another() {
    let case = &vectors("bootstrap")[0];
    let (a, b) = (table(&case["a"]), table(&case["b"]));
    let interval = |seed| {
        let bootstrap = Bootstrap { resamples: 300, seed, coverage: 0.95 };
        bootstrap.intervals(&[vec![&a], vec![&b]], iqm_difference_a12)
    };
    assert_eq!(interval(1), interval(1));
    assert_ne!(interval(1), interval(2));
}

/// What is the same in all worlds and seeds has no spread, and one seed has that of its worlds.
#[test]
fn intervals_hold_the_spread_of_seeds_and_of_worlds() {
    let bootstrap = Bootstrap { resamples: 1_000, seed: 1, coverage: 0.95 };
    let width = |rows: Vec<Vec<f64>>| {
        let table = Table::new(rows);
        let found = bootstrap.intervals(&[vec![&table]], |scores| vec![iqm(&scores[0][0]).expect("seeds")]);
        let interval = found[0].expect("an interval");
        interval.high - interval.low
    };
    assert!(width(vec![vec![1.0; 50]; 5]) < 1e-12);
    let worlds: Vec<f64> = (0..50).map(|world| f64::from(world % 2)).collect();
    // Standard error of a share of one half in 50 worlds: 0.0707; twice 1.96 of it.
    let expected = 2.0 * 1.96 * 0.0707;
    for seeds in [1, 5] {
        let found = width(vec![worlds.clone(); seeds]);
        assert!((found - expected).abs() < 0.05, "{seeds} seeds alike: {found}, expected {expected}");
    }
    let apart: Vec<Vec<f64>> = (0..5).map(|seed| vec![f64::from(seed); 50]).collect();
    assert!(width(apart) > 1.0);
}
