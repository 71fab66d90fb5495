//! One reward a level. The low level is paid for reaching its target, the high level for reaching the goal;
//! neither can earn by standing still, and neither is better off crashing than being stuck.
//!
//! Weights count metres and steps; those that a robot has by default count the lengths of its own footprint and its own time
//! ([`crate::scale`]), so that what is best does not change with size, speed and control period.

use super::{HighStep, LowStep};
use crate::task::Task;
use serde::{Deserialize, Serialize};

/// Weights of the low level's reward.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LowWeights {
    /// Of a metre nearer to the target.
    pub progress: f32,
    /// Of a step (a control period).
    pub time: f32,
    /// Of the squared turning rate (share of its limit).
    pub turning: f32,
    /// Of the squared change of action.
    pub change: f32,
    /// Of closeness: 1 at contact, 0 from `proximity_m` on.
    pub proximity: f32,
    /// Clearance of the footprint from which closeness costs, m.
    pub proximity_m: f32,
    /// For reaching the target.
    pub reached: f32,
    /// For a collision.
    pub collided: f32,
}

impl Default for LowWeights {
    fn default() -> Self {
        Self::of(&Task::default())
    }
}

impl LowWeights {
    /// What suits a task.
    pub fn of(task: &Task) -> Self {
        let (scale, share) = (task.scale(), task.step_share());
        Self {
            progress: 2.5 / scale.length,
            time: 0.02 * share,
            turning: 0.02 * share,
            change: 0.02 * share,
            proximity: 0.08 * share,
            proximity_m: scale.m(0.25),
            reached: 3.0,
            collided: 12.0,
        }
    }

    /// What a crash must cost at least, twice what standing stuck against an obstacle costs for ever; with less,
    /// the low level learns to crash.
    pub fn least_collided(&self, discount: f32) -> f32 {
        2.0 * (self.time + self.proximity) / (1.0 - discount)
    }
}

/// The low level's reward of a step.
pub fn low(weights: &LowWeights, step: &LowStep) -> f32 {
    let change = [step.action[0] - step.last_action[0], step.action[1] - step.last_action[1]];
    let closeness = (1.0 - step.clearance_m.max(0.0) / weights.proximity_m).max(0.0);
    let mut reward = weights.progress * step.progress_m
        - weights.time
        - weights.turning * step.action[1] * step.action[1]
        - weights.change * (change[0] * change[0] + change[1] * change[1])
        - weights.proximity * closeness;
    if step.reached {
        reward += weights.reached;
    }
    if step.collided {
        reward -= weights.collided;
    }
    reward
}

/// Weights of the high level's reward.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct HighWeights {
    /// For reaching the goal.
    pub reached: f32,
    /// For a collision.
    pub collided: f32,
    /// Of a step.
    pub time: f32,
    /// Of a metre nearer to the goal along the shortest way (known in training only).
    pub progress: f32,
}

impl Default for HighWeights {
    fn default() -> Self {
        Self::of(&Task::default())
    }
}

impl HighWeights {
    /// What suits a task.
    pub fn of(task: &Task) -> Self {
        Self {
            reached: 10.0,
            collided: 10.0,
            time: 0.02 * task.step_share(),
            progress: 0.5 / task.scale().length,
        }
    }

    /// As [`LowWeights::least_collided`], with the discount of a step.
    pub fn least_collided(&self, discount: f32) -> f32 {
        2.0 * self.time / (1.0 - discount)
    }

    /// What standing for `steps` steps costs, discounted: the price of a robot that believes it has arrived and has not.
    pub fn standing(&self, discount: f32, steps: u32) -> f32 {
        self.time * (1.0 - libm::powf(discount, steps as f32)) / (1.0 - discount)
    }
}

/// The high level's reward of a step, with the discount of a step; a decision's reward is the discounted sum.
pub fn high(weights: &HighWeights, step: &HighStep, discount: f32) -> f32 {
    let mut reward = weights.progress * step.progress_m - weights.time;
    if step.reached {
        reward += weights.reached;
    }
    if step.collided {
        reward -= weights.collided;
    }
    reward - weights.standing(discount, step.stands_for_steps)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn standing_still_never_pays() {
        let stand =
            LowStep { action: [-1.0, 0.0], last_action: [-1.0, 0.0], clearance_m: 1.0, ..LowStep::default() };
        assert!(low(&LowWeights::default(), &stand) < 0.0);
        assert!(high(&HighWeights::default(), &HighStep::default(), 0.995) < 0.0);
        assert!(LowWeights::default().collided > LowWeights::default().least_collided(0.98));
        assert!(HighWeights::default().collided > HighWeights::default().least_collided(0.995));
    }

    #[test]
    fn standing_costs_its_time() {
        let weights = HighWeights::default();
        assert!(weights.standing(0.995, 0).abs() < 1e-6);
        assert!((weights.standing(0.995, 2) - 0.02 * 1.995).abs() < 1e-5);
        assert!((weights.standing(0.995, 100_000) - 4.0).abs() < 1e-2);
    }

    #[test]
    fn goal_and_crash_differ_by_their_weights() {
        let weights = HighWeights::default();
        let reached = high(&weights, &HighStep { reached: true, ..HighStep::default() }, 0.995);
        let collided = high(&weights, &HighStep { collided: true, ..HighStep::default() }, 0.995);
        assert!((reached - collided - 20.0).abs() < 1e-5);
    }
}
