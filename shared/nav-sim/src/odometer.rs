//! Wheel odometry with drift.

use crate::disturbance::DrawnDisturbance;
use nav_core::geometry::Pose;
use nav_core::twist::Twist;

/// What wheel odometry believes. At reset the `odom` frame coincides with the world frame.
#[derive(Clone, Copy, Debug)]
pub struct Odometer {
    pose: Pose,
    velocity: Twist,
    scale: f32,
    turn_radpm: f32,
}

impl Odometer {
    /// Odometry that starts at the true pose.
    pub fn new(disturbance: &DrawnDisturbance, pose: Pose) -> Self {
        Self {
            pose,
            velocity: Twist::ZERO,
            scale: 1.0 + disturbance.odometry_scale,
            turn_radpm: disturbance.odometry_turn_radpm,
        }
    }

    /// Follows a true velocity for `dt_s`.
    pub fn advance(&mut self, velocity: Twist, dt_s: f32) {
        self.velocity = Twist {
            linear_mps: self.scale * velocity.linear_mps,
            angular_radps: velocity.angular_radps + self.turn_radpm * velocity.linear_mps.abs(),
        };
        self.pose = self.pose.advanced(self.velocity, dt_s);
    }

    /// Believed `odom_from_robot`.
    pub fn pose(&self) -> Pose {
        self.pose
    }

    /// Believed velocity.
    pub fn velocity(&self) -> Twist {
        self.velocity
    }
}
