//! Rewards, in two profiles: [`paper`], exactly the equations of the source paper, and [`decomposed`], the
//! one that converges. Pure functions of what happened in a step or a decision.

pub mod paper;
pub mod decomposed;

use serde::{Deserialize, Serialize};

/// Which reward a policy is trained with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RewardProfile {
    /// The source paper's unified reward, as written.
    Paper,
    /// One reward a level, each with a goal term.
    #[default]
    Decomposed,
}
