//! What came of a run, and how it is kept.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result};
use serde_json::{Value, json};

/// The file in a run's folder that says that it has ended, and how.
pub(super) const DONE: &str = "done.json";

/// What came of a run.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Outcome {
    /// What it missed of its gate, if it did not pass.
    pub missed: Option<String>,
    /// Time spent training, s; none for A*.
    pub seconds: Option<f64>,
    /// How its policies did in test worlds.
    pub scores: Vec<Score>,
}

/// How a policy did in a family.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Score {
    /// Which policy.
    pub policy: String,
    /// Which family.
    pub family: String,
    /// Share that reached the goal.
    pub success: f64,
    /// Share that hit something.
    pub collision: f64,
}

impl Outcome {
    /// Its score of a policy in a family.
    pub(super) fn score(&self, policy: &str, family: &str) -> Option<&Score> {
        self.scores.iter().find(|score| score.policy == policy && score.family == family)
    }

    /// As it is kept.
    pub(super) fn to_json(&self) -> String {
        let scores = self.scores.iter().map(|score| {
            json!({
                "policy": score.policy, "family": score.family,
                "success": score.success, "collision": score.collision
            })
        });
        let scores: Vec<Value> = scores.collect();
        json!({ "missed": self.missed, "seconds": self.seconds, "summaries": scores }).to_string()
    }

    /// From how it is kept.
    ///
    /// # Errors
    /// Another text.
    pub(super) fn parse(text: &str) -> Result<Self> {
        let kept: Value = serde_json::from_str(text).context("is no JSON")?;
        Ok(Self {
            missed: kept["missed"].as_str().map(str::to_owned),
            seconds: kept["seconds"].as_f64(),
            scores: summaries(&kept)?,
        })
    }
}

/// The scores in a `summary.json` of `trainer evaluate`.
///
/// # Errors
/// A file that is none.
pub(super) fn scores(path: &Path) -> Result<Vec<Score>> {
    let text = fs::read_to_string(path).with_context(|| format!("evaluate left no {}", path.display()))?;
    let report = serde_json::from_str(&text).with_context(|| format!("{} is no JSON", path.display()))?;
    summaries(&report).with_context(|| format!("{} is no summary", path.display()))
}

fn summaries(report: &Value) -> Result<Vec<Score>> {
    let rows = report["summaries"].as_array().context("has no list `summaries`")?;
    let score = |row: &Value| {
        let text = |name: &str| row[name].as_str().map(str::to_owned);
        let number = |name: &str| row[name].as_f64();
        Some(Score {
            policy: text("policy")?,
            family: text("family")?,
            success: number("success")?,
            collision: number("collision")?,
        })
    };
    rows.iter().map(|row| score(row).context("has a row without policy, family or rates")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_outcome_is_read_back() {
        let score = Score { policy: "td3".into(), family: "maze".into(), success: 0.5, collision: 0.25 };
        for outcome in [
            Outcome::default(),
            Outcome { missed: Some("reach".into()), seconds: Some(301.0), scores: vec![score] },
        ] {
            assert_eq!(Outcome::parse(&outcome.to_json()).expect("the same"), outcome);
        }
        for bad in ["", "{}", "{\"summaries\": [{\"policy\": \"a\"}]}"] {
            assert!(Outcome::parse(bad).is_err(), "{bad}");
        }
    }
}
