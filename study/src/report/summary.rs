//! The primaries in sentences: what a reader takes away.

use crate::analysis::Analysis;
use crate::analysis::contrast::Answer;
use crate::plan::Study;
use crate::stats::Interval;

/// Below this, a corrected p-value counts.
const ALPHA: f64 = 0.01;

/// A sentence for each pair of methods, metric and gate, in the order of the primaries.
pub(super) fn sentences(study: &Study, analysis: &Analysis) -> Vec<String> {
    let mut groups: Vec<(String, Vec<&Answer>)> = Vec::new();
    for answer in &analysis.primaries {
        let contrast = &answer.contrast;
        let head = format!(
            "{} against {}, {}, gate {}",
            study.methods[contrast.method].label,
            study.methods[contrast.against].label,
            contrast.metric.words(),
            contrast.gate.word()
        );
        match groups.iter_mut().find(|(name, _)| *name == head) {
            Some((_, answers)) => answers.push(answer),
            None => groups.push((head, vec![answer])),
        }
    }
    groups.iter().map(|(head, answers)| format!("{head}: {}.", said(answers))).collect()
}

fn said(answers: &[&Answer]) -> String {
    let of = |word: Word| {
        let families = answers.iter().filter(|answer| Word::of(answer) == word);
        families.map(|answer| answer.contrast.family.as_str()).collect::<Vec<_>>().join(", ")
    };
    let parts = Word::ALL.map(|word| (word, of(word)));
    let parts = parts.iter().filter(|(_, families)| !families.is_empty());
    parts.map(|(word, families)| format!("{} {families}", word.words())).collect::<Vec<_>>().join("; ")
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Word {
    Better,
    BetterUnconfirmed,
    Worse,
    WorseUnconfirmed,
    Open,
    Incomplete,
    Nothing,
}

impl Word {
    const ALL: [Self; 7] = [
        Self::Better,
        Self::BetterUnconfirmed,
        Self::Worse,
        Self::WorseUnconfirmed,
        Self::Open,
        Self::Incomplete,
        Self::Nothing,
    ];

    fn of(answer: &Answer) -> Self {
        let Some(found) = &answer.found else { return Self::Nothing };
        if !answer.is_whole {
            return Self::Incomplete;
        }
        let Interval { low, high } = found.difference.interval;
        let sign = if answer.contrast.metric.more_is_better() { 1.0 } else { -1.0 };
        let is_confirmed = answer.holm.is_some_and(|p| p < ALPHA);
        match ((low * sign).min(high * sign) > 0.0, (low * sign).max(high * sign) < 0.0) {
            (true, _) if is_confirmed => Self::Better,
            (true, _) => Self::BetterUnconfirmed,
            (_, true) if is_confirmed => Self::Worse,
            (_, true) => Self::WorseUnconfirmed,
            _ => Self::Open,
        }
    }

    const fn words(self) -> &'static str {
        match self {
            Self::Better => "better (corrected p below 0.01) on",
            Self::BetterUnconfirmed => "by its interval better, but not confirmed over seeds, on",
            Self::Worse => "worse (corrected p below 0.01) on",
            Self::WorseUnconfirmed => "by its interval worse, but not confirmed over seeds, on",
            Self::Open => "no difference shown on",
            Self::Incomplete => "rows are incomplete, which is no result, on",
            Self::Nothing => "no rows on",
        }
    }
}
