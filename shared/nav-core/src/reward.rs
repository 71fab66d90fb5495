//! Rewards, in two profiles: [`paper`], exactly the equations of the source paper, and [`decomposed`], the
//! one that converges. Pure functions of what happened in a step or a decision.

pub mod paper;
pub mod decomposed;

use crate::twist::Twist;
use serde::{Deserialize, Serialize};

/// Which reward a policy is trained with, by name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RewardProfile {
    /// The source paper's unified reward, as written.
    Paper,
    /// One reward a level, each with a goal term.
    #[default]
    Decomposed,
}

/// The low level's reward.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LowReward {
    /// The source paper's R_low.
    Paper(paper::LowWeights),
    /// Progress to the target and its costs.
    Decomposed(decomposed::LowWeights),
}

/// The high level's reward.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum HighReward {
    /// The source paper's R_high, paid once a decision.
    Paper(paper::HighWeights),
    /// Progress to the goal and its costs, paid each step.
    Decomposed(decomposed::HighWeights),
}

/// What the low level's reward looks at after a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LowStep {
    /// How much nearer the target is than before the step, m.
    pub progress_m: f32,
    /// How far the target was before the step (the paper's d_target), m.
    pub target_m: f32,
    /// Distance driven in the step (d_actual), m.
    pub moved_m: f32,
    /// Between heading and direction to the target after the step (theta_diff), degrees.
    pub direction_error_deg: f32,
    /// The action taken, in [-1, 1].
    pub action: [f32; 2],
    /// The action before, in [-1, 1].
    pub last_action: [f32; 2],
    /// The command that the action stands for (a_lin, a_ang).
    pub command: Twist,
    /// From the footprint to the nearest obstacle, in truth, m.
    pub clearance_m: f32,
    /// From the robot's centre to the nearest obstacle, as the lidar sees it (d_min), m.
    pub nearest_m: f32,
    /// Whether the target was reached.
    pub reached: bool,
    /// Whether the robot collided.
    pub collided: bool,
}

/// What the high level's reward looks at after a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HighStep {
    /// How much shorter the way to the goal is than before the step, m.
    pub progress_m: f32,
    /// Whether the goal was reached.
    pub reached: bool,
    /// Whether the robot collided.
    pub collided: bool,
    /// Steps that the robot will stand for, because it wrongly believes that it has arrived; 0 otherwise.
    pub stands_for_steps: u32,
}

/// What the high level's reward looks at after a decision.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HighDecision {
    /// theta_diff: between the actual and the target direction, degrees.
    pub direction_error_deg: f32,
    /// d_actual: distance actually moved, m.
    pub moved_m: f32,
    /// d_target: target distance, m.
    pub target_m: f32,
    /// Whether an obstacle lay ahead.
    pub obstacle_ahead: bool,
    /// delta_theta: change of direction between consecutive actions, degrees.
    pub direction_change_deg: f32,
    /// Whether the robot collided.
    pub collided: bool,
}

impl LowReward {
    /// Of a step.
    pub fn of_step(&self, step: &LowStep) -> f32 {
        match self {
            Self::Paper(weights) => paper::low(weights, step),
            Self::Decomposed(weights) => decomposed::low(weights, step),
        }
    }

    /// What a crash must cost at least, if these weights make it cost less: crashing pays then. The paper's reward is
    /// taken as it is written.
    pub fn least_crash_if_crashing_pays(&self, discount: f32) -> Option<f32> {
        match self {
            Self::Paper(_) => None,
            Self::Decomposed(weights) => {
                Some(weights.least_collided(discount)).filter(|least| weights.collided <= *least)
            }
        }
    }
}

impl HighReward {
    /// Of a step, with the discount of a step.
    pub fn of_step(&self, step: &HighStep, discount: f32) -> f32 {
        match self {
            Self::Paper(_) => 0.0,
            Self::Decomposed(weights) => decomposed::high(weights, step, discount),
        }
    }

    /// Of a whole decision, on top of its steps and paid at its end.
    pub fn of_decision(&self, decision: &HighDecision) -> f32 {
        match self {
            Self::Paper(weights) => paper::high(weights, decision),
            Self::Decomposed(_) => 0.0,
        }
    }

    /// As [`LowReward::least_crash_if_crashing_pays`].
    pub fn least_crash_if_crashing_pays(&self, discount: f32) -> Option<f32> {
        match self {
            Self::Paper(_) => None,
            Self::Decomposed(weights) => {
                Some(weights.least_collided(discount)).filter(|least| weights.collided <= *least)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_profile_pays_by_step_or_by_decision_and_never_both() {
        let (step, decision) = (
            HighStep { progress_m: 1.0, ..HighStep::default() },
            HighDecision { target_m: 1.0, ..HighDecision::default() },
        );
        let paper = HighReward::Paper(paper::HighWeights::default());
        let decomposed = HighReward::Decomposed(decomposed::HighWeights::default());
        let paid = |reward: &HighReward| (reward.of_step(&step, 0.99), reward.of_decision(&decision));
        assert!(paid(&paper).0.abs() < 1e-9 && paid(&paper).1 > 0.0);
        assert!(paid(&decomposed).0 > 0.0 && paid(&decomposed).1.abs() < 1e-9);
    }

    #[test]
    fn crashing_pays_where_it_costs_less_than_standing_for_ever() {
        let weights = decomposed::LowWeights::default();
        assert_eq!(LowReward::Decomposed(weights).least_crash_if_crashing_pays(0.98), None);
        let cheap = decomposed::LowWeights { collided: 1.0, ..weights };
        assert!(LowReward::Decomposed(cheap).least_crash_if_crashing_pays(0.98).is_some());
        assert_eq!(LowReward::Paper(paper::LowWeights::default()).least_crash_if_crashing_pays(0.98), None);
        let cheap = decomposed::HighWeights { collided: 1.0, ..decomposed::HighWeights::default() };
        assert!(HighReward::Decomposed(cheap).least_crash_if_crashing_pays(0.995).is_some());
    }
}
