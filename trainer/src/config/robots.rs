//! What the robots of each stage take from a configuration.

use nav_env::high::HighRobotConfig;
use nav_env::low::LowRobotConfig;

use super::{HighConfig, LowConfig};

impl LowConfig {
    /// What its robots drive at, and what they are paid for.
    pub fn robot(&self) -> LowRobotConfig {
        LowRobotConfig {
            goal_share: self.goal_share,
            subgoal_m: self.subgoal_m,
            subgoal_steps: self.subgoal_steps,
            reward: self.reward,
            decomposed: self.decomposed,
            paper: self.paper,
        }
    }
}

impl HighConfig {
    /// What its robots are paid for.
    pub fn robot(&self) -> HighRobotConfig {
        HighRobotConfig {
            discount: self.discount,
            n_step: self.n_step,
            reward: self.reward,
            decomposed: self.decomposed,
            paper: self.paper,
        }
    }
}
