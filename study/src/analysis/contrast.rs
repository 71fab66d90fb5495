//! A method against another on one family: the difference of interquartile means with its interval, the exact test over seeds,
//! and the effect size. Holm's correction is over all primaries of the study, and one without rows counts as p = 1: what was
//! not driven makes no other result stronger.

use super::estimate::Estimate;
use crate::cells::{Cells, shared_worlds, table};
use crate::plan::{Contrast, Study};
use crate::stats::a12::a12;
use crate::stats::bootstrap::Scores;
use crate::stats::holm::holm;
use crate::stats::iqm::iqm;
use crate::stats::mann_whitney::mann_whitney;
use crate::stats::non_inferiority::Verdict;

/// What the rows say to a question.
#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    /// The question.
    pub contrast: Contrast,
    /// None where one of the two has no rows, or they share no world.
    pub found: Option<Found>,
    /// Whether all seeds and worlds that the study names are there, of both.
    pub is_whole: bool,
    /// p after Holm's correction; of a primary.
    pub holm: Option<f64>,
}

/// The numbers of an answer.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// Worlds that both drove.
    pub worlds: usize,
    /// Seeds of the method and of the other.
    pub seeds: [usize; 2],
    /// Interquartile mean of the method's seeds.
    pub method: Estimate,
    /// Of the other's.
    pub against: Estimate,
    /// The method's less the other's.
    pub difference: Estimate,
    /// Vargha-Delaney's A of the method over the other, turned so that above 0.5 is better; none where either has a single seed.
    pub a12: Option<Estimate>,
    /// Two-sided p of the exact Mann-Whitney test over seeds; none where either has a single one.
    pub p: Option<f64>,
    /// What the interval says about the margin of the question (0 of a primary).
    pub verdict: Verdict,
}

/// Answers of the primaries.
pub fn primaries(study: &Study, cells: &Cells) -> Vec<Answer> {
    let mut answers = answers(study, cells, &study.primaries);
    let p = |answer: &Answer| answer.found.as_ref().and_then(|found| found.p).unwrap_or(1.0);
    let adjusted = holm(&answers.iter().map(p).collect::<Vec<_>>());
    for (answer, adjusted) in answers.iter_mut().zip(adjusted) {
        let is_tested = answer.found.as_ref().is_some_and(|found| found.p.is_some());
        answer.holm = is_tested.then_some(adjusted);
    }
    answers
}

/// Answers of any questions, without a correction.
pub fn answers(study: &Study, cells: &Cells, contrasts: &[Contrast]) -> Vec<Answer> {
    let answer = |contrast: &Contrast| {
        let is_whole = |method| cells.is_whole(method, contrast.gate, &contrast.family);
        Answer {
            contrast: contrast.clone(),
            found: find(study, cells, contrast),
            is_whole: is_whole(contrast.method) && is_whole(contrast.against),
            holm: None,
        }
    };
    contrasts.iter().map(answer).collect()
}

/// The numbers of a question; none without rows of both.
pub fn find(study: &Study, cells: &Cells, contrast: &Contrast) -> Option<Found> {
    let runs = |method| cells.runs(method, contrast.gate, &contrast.family);
    let (first, second) = (runs(contrast.method)?, runs(contrast.against)?);
    let worlds = shared_worlds(&[first, second]);
    if worlds.is_empty() {
        return None;
    }
    let (a, b) = (table(first, &worlds, contrast.metric), table(second, &worlds, contrast.metric));
    let sign = if contrast.metric.more_is_better() { 1.0 } else { -1.0 };
    let numbers = |scores: &Scores| numbers(&scores[0][0], &scores[1][0], sign);
    let (x, y) = (a.scores(), b.scores());
    let values = self::numbers(&x, &y, sign);
    let intervals = study.bootstrap.intervals(&[vec![&a], vec![&b]], numbers);
    let estimate = |index: usize| {
        Some(Estimate { value: *values.get(index)?, interval: intervals.get(index).copied()?? })
    };
    let difference = estimate(2)?;
    // With a single seed on either side nothing is known of how seeds differ.
    let has_seeds = a.seeds() > 1 && b.seeds() > 1;
    Some(Found {
        worlds: worlds.len(),
        seeds: [a.seeds(), b.seeds()],
        method: estimate(0)?,
        against: estimate(1)?,
        difference,
        a12: estimate(3).filter(|_| has_seeds),
        p: if has_seeds { mann_whitney(&x, &y).map(|found| found.p) } else { None },
        verdict: Verdict::of(turned(difference, sign), contrast.margin),
    })
}

fn numbers(a: &[f64], b: &[f64], sign: f64) -> Vec<f64> {
    let (x, y) = (iqm(a).unwrap_or(f64::NAN), iqm(b).unwrap_or(f64::NAN));
    let larger = a12(a, b).unwrap_or(f64::NAN);
    vec![x, y, x - y, if sign > 0.0 { larger } else { 1.0 - larger }]
}

/// The interval of a difference, turned so that more is better.
fn turned(difference: Estimate, sign: f64) -> crate::stats::Interval {
    let interval = difference.interval;
    if sign > 0.0 { interval } else { crate::stats::Interval { low: -interval.high, high: -interval.low } }
}
