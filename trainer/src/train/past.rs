//! What lies behind a trained policy besides its own run: what it borrowed, which seeds were tried before, how often it
//! was trained on, and what was said of it earlier. The model card tells all of it.

use serde::{Deserialize, Serialize};

use super::policy::Policy;
use super::verdict::GateReport;

/// What was spent on training.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Spent {
    /// Environment steps.
    pub env_steps: u64,
    /// Updates of the learners.
    pub updates: u64,
    /// Time, s.
    pub seconds: f64,
}

/// The run that a borrowed low level comes from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Borrowed {
    /// Its seed.
    pub seed: u64,
    /// The commit of its trainer.
    pub commit: String,
    /// What was spent on the whole of it.
    pub spent: Spent,
    /// What it missed of its own gate; empty if it passed.
    pub missed: String,
}

/// A seed that missed its gate narrowly, before the next was tried.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Attempted {
    /// The seed.
    pub seed: u64,
    /// What was spent on it.
    pub spent: Spent,
    /// What it missed.
    pub missed: String,
}

/// Which attempt of how many a run is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Attempts {
    /// How many there may be.
    pub of: u32,
    /// Those before this one.
    #[serde(default)]
    pub earlier: Vec<Attempted>,
}

impl Attempts {
    /// The first of so many.
    pub fn first(of: u32) -> Self {
        Self { of, earlier: Vec::new() }
    }

    /// Which one this is, from 1.
    pub fn number(&self) -> u32 {
        self.earlier.len() as u32 + 1
    }
}

impl Default for Attempts {
    fn default() -> Self {
        Self::first(1)
    }
}

/// What was asked for after a run had finished (`--more`), in the units of its stages.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct More {
    /// Environment steps asked for.
    pub env_steps: u64,
    /// Steps of the low level.
    pub low_steps: u64,
    /// Decisions of the high level.
    pub high_decisions: u64,
}

/// An earlier verdict.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Verdict {
    /// The policy's steps then.
    pub env_steps: u64,
    /// What was said.
    pub report: GateReport,
}

/// All that lies behind a policy.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Past {
    /// Where its low level comes from, if it did not train one.
    pub borrowed: Option<Borrowed>,
    /// Which attempt it is.
    pub attempts: Attempts,
    /// How often, and for how long, it was trained on after it had finished.
    pub more: Vec<More>,
    /// What was said of it before the present verdict, oldest first.
    pub verdicts: Vec<Verdict>,
}

impl Policy {
    /// What was spent on its own run.
    pub fn spent(&self) -> Spent {
        Spent { env_steps: self.env_steps, updates: self.updates, seconds: self.seconds }
    }

    /// What was spent in all: on its own run, on the run that its low level comes from, and on the attempts before.
    pub fn spent_in_all(&self) -> Spent {
        let borrowed = self.past.borrowed.iter().map(|borrowed| borrowed.spent);
        let earlier = self.past.attempts.earlier.iter().map(|attempted| attempted.spent);
        borrowed.chain(earlier).fold(self.spent(), |sum, spent| Spent {
            env_steps: sum.env_steps + spent.env_steps,
            updates: sum.updates + spent.updates,
            seconds: sum.seconds + spent.seconds,
        })
    }
}
