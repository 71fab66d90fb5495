//! What the robots of each stage take from a configuration.

use nav_core::reward::{HighReward, LowReward, RewardProfile};
use nav_env::high::HighRobotConfig;
use nav_env::low::LowRobotConfig;

use super::{HighConfig, LowConfig};

impl LowConfig {
    /// The reward that [`Self::reward`] names, with its weights.
    pub fn paid(&self) -> LowReward {
        match self.reward {
            RewardProfile::Paper => LowReward::Paper(self.paper),
            RewardProfile::Decomposed => LowReward::Decomposed(self.decomposed),
        }
    }

    /// What its robots drive at, and what they are paid for.
    pub fn robot(&self) -> LowRobotConfig {
        LowRobotConfig {
            goal_share: self.goal_share,
            subgoal_m: self.subgoal_m,
            subgoal_s: self.subgoal_s,
            discount: self.discount,
            n_step: self.n_step,
            reward: self.paid(),
            progress: self.progress,
        }
    }
}

impl HighConfig {
    /// The reward that [`Self::reward`] names, with its weights.
    pub fn paid(&self) -> HighReward {
        match self.reward {
            RewardProfile::Paper => HighReward::Paper(self.paper),
            RewardProfile::Decomposed => HighReward::Decomposed(self.decomposed),
        }
    }

    /// What its robots are paid for.
    pub fn robot(&self) -> HighRobotConfig {
        HighRobotConfig { discount: self.discount, n_step: self.n_step, reward: self.paid() }
    }
}
