//! The source paper's rewards (arXiv 2510.26646), exactly as written, with their flaws: R_high has no goal
//! term, R_dist does not see direction, and r(d_min) taxes every narrow passage.
//!
//! What the paper leaves open, and how the trainer reads it:
//!
//! 1. The target of R_high is the subgoal that was chosen, d_actual the straight distance over the decision; the
//!    target of R_low is the present target, d_actual the distance of the step.
//! 2. delta_theta lies between the courses driven in two decisions in a row (the heading where nothing moved).
//! 3. An obstacle lies ahead when the footprint and 5 cm on each side cannot go 1 m straight on.
//! 4. d_min is measured by the lidar from the robot's centre, after the step.

use super::{HighDecision, LowStep};
use serde::{Deserialize, Serialize};

/// Weights of R_high.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct HighWeights {
    /// w1, of R_dir.
    pub direction: f32,
    /// w2, of R_dist.
    pub distance: f32,
    /// w3, of R_avoid.
    pub avoidance: f32,
    /// w4, of R_smooth.
    pub smoothness: f32,
    /// r_avoidance.
    pub no_obstacle: f32,
    /// p_collision.
    pub collision: f32,
    /// p_time.
    pub time: f32,
}

impl Default for HighWeights {
    fn default() -> Self {
        Self {
            direction: 0.4,
            distance: 0.4,
            avoidance: 0.1,
            smoothness: 0.1,
            no_obstacle: 0.2,
            collision: 1.0,
            time: 0.01,
        }
    }
}

/// R_dir = 1 - |theta_diff| / 180.
pub fn direction_term(direction_error_deg: f32) -> f32 {
    1.0 - direction_error_deg.abs() / 180.0
}

/// R_dist = 1 - min(|d_actual - d_target| / d_target, 1).
pub fn distance_term(moved_m: f32, target_m: f32) -> f32 {
    1.0 - ((moved_m - target_m).abs() / target_m.max(1e-6)).min(1.0)
}

/// R_high = w1 R_dir + w2 R_dist + w3 R_avoid + w4 R_smooth - P_collision - P_time.
pub fn high(weights: &HighWeights, step: &HighDecision) -> f32 {
    let avoid = if step.obstacle_ahead { 0.0 } else { weights.no_obstacle };
    let smooth = 0.1 * (1.0 - (step.direction_change_deg.abs() / 90.0).min(1.0));
    let collision = if step.collided { weights.collision } else { 0.0 };
    weights.direction * direction_term(step.direction_error_deg)
        + weights.distance * distance_term(step.moved_m, step.target_m)
        + weights.avoidance * avoid
        + weights.smoothness * smooth
        - collision
        - weights.time
}

/// Weights of R_low.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LowWeights {
    /// Reward for the target.
    pub reached: f32,
    /// Penalty for a collision, within R_env.
    pub collided: f32,
    /// w7, of R_dir + R_dist; not given in the paper.
    pub guidance: f32,
    /// w8, of P_collision; not given in the paper.
    pub collision: f32,
    /// p_collision, shared with R_high.
    pub collision_penalty: f32,
}

impl Default for LowWeights {
    fn default() -> Self {
        Self { reached: 100.0, collided: 100.0, guidance: 1.0, collision: 1.0, collision_penalty: 1.0 }
    }
}

/// R_low = R_env + w7 (R_dir + R_dist) - w8 P_collision.
pub fn low(weights: &LowWeights, step: &LowStep) -> f32 {
    let environment = if step.reached {
        weights.reached
    } else if step.collided {
        -weights.collided
    } else {
        let near = if step.nearest_m < 1.0 { 1.0 - step.nearest_m } else { 0.0 };
        step.command.linear_mps / 2.0 - step.command.angular_radps.abs() / 2.0 - near / 2.0
    };
    let collision = if step.collided { weights.collision_penalty } else { 0.0 };
    environment
        + weights.guidance
            * (direction_term(step.direction_error_deg) + distance_term(step.moved_m, step.target_m))
        - weights.collision * collision
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::twist::Twist;

    /// The paper's flaw in figures: facing the target and standing still pays 0.40 + 0.02 (no obstacle) + 0.01 (no turn)
    /// - 0.01 a decision.
    #[test]
    fn standing_still_and_facing_the_target_pays() {
        let step = HighDecision { target_m: 2.0, ..HighDecision::default() };
        assert!((high(&HighWeights::default(), &step) - 0.42).abs() < 1e-6);
        let crash = HighDecision { collided: true, ..step };
        assert!((high(&HighWeights::default(), &crash) + 0.58).abs() < 1e-6);
    }

    #[test]
    fn moving_away_by_the_right_distance_pays_the_same_distance_term() {
        assert!((distance_term(2.0, 2.0) - 1.0).abs() < 1e-6);
        assert!(distance_term(5.0, 2.0) == 0.0);
        assert!((distance_term(1.0, 2.0) - 0.5).abs() < 1e-6);
    }

    #[test]
    fn low_reward_follows_the_three_cases() {
        let weights = LowWeights::default();
        let drive =
            LowStep { command: Twist::new(1.0, 0.0), nearest_m: 0.5, target_m: 1.0, ..LowStep::default() };
        assert!((low(&weights, &drive) - (0.5 - 0.25 + 1.0)).abs() < 1e-6);
        let reached = LowStep { reached: true, ..drive };
        assert!((low(&weights, &reached) - 101.0).abs() < 1e-4);
        let collided = LowStep { collided: true, direction_error_deg: 180.0, ..drive };
        assert!((low(&weights, &collided) + 101.0).abs() < 1e-4);
    }
}
