//! What a robot of stage A drives at, and what it is paid for.

use nav_core::reward::LowReward;
use serde::{Deserialize, Serialize};

/// How progress towards the world's goal is measured where it is paid. Towards a subgoal the way is straight.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Progress {
    /// By the straight distance: into dead ends, too.
    #[default]
    Straight,
    /// By the shortest way round what stands, which only training knows.
    Geodesic,
}

/// What a robot of stage A drives at, and what it is paid for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LowRobotConfig {
    /// Share of targets that are the world's goal; the rest are random subgoals.
    pub goal_share: f32,
    /// Distance of random subgoals, `[least, most]`, m.
    pub subgoal_m: [f32; 2],
    /// Time after which a subgoal is given up (truncated), s.
    pub subgoal_s: f32,
    /// Discount of a step.
    pub discount: f32,
    /// Ticks of a return before it bootstraps.
    pub n_step: usize,
    /// What it is paid for.
    pub reward: LowReward,
    /// What counts as progress towards the goal.
    pub progress: Progress,
}
