//! The robot: its size, and what it can do.

use crate::footprint::Footprint;
use crate::twist::Twist;
use serde::{Deserialize, Serialize};

/// A differential-drive base.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Robot {
    /// What of the floor it covers.
    pub footprint: Footprint,
    /// Fastest forward speed, m/s.
    pub linear_max_mps: f32,
    /// Fastest speed backwards, as a negative number, m/s: at most as fast as forward, 0 for a robot that never reverses.
    pub linear_min_mps: f32,
    /// Fastest turn either way, rad/s.
    pub angular_max_radps: f32,
    /// Strongest change of forward speed, m/s².
    pub linear_acceleration_mps2: f32,
    /// Strongest change of turning rate, rad/s².
    pub angular_acceleration_radps2: f32,
    /// A command takes effect so late at most, s; and of what is missing then to the speed that was commanded, the base
    /// makes up half or more in each half of that time. What the safety gate counts with.
    pub latency_s: f32,
}

impl Default for Robot {
    fn default() -> Self {
        Self {
            footprint: Footprint::circle(0.2),
            linear_max_mps: 1.0,
            linear_min_mps: 0.0,
            angular_max_radps: 1.0,
            linear_acceleration_mps2: 2.0,
            angular_acceleration_radps2: 4.0,
            latency_s: 0.2,
        }
    }
}

impl Robot {
    /// Whether it ever drives backwards.
    pub fn reverses(&self) -> bool {
        self.linear_min_mps < 0.0
    }

    /// The way from the fastest speed to a stand, m.
    pub fn braking_m(&self) -> f32 {
        self.linear_max_mps * self.linear_max_mps / (2.0 * self.linear_acceleration_mps2)
    }

    /// Forward speed that the first number of a low-level action stands for, m/s: from the slowest at -1 to the fastest
    /// at 1.
    pub fn linear_of(&self, action: f32) -> f32 {
        self.linear_min_mps + 0.5 * (action + 1.0) * (self.linear_max_mps - self.linear_min_mps)
    }

    /// The first number of a low-level action that stands still.
    pub fn action_at_rest(&self) -> f32 {
        -1.0 - 2.0 * self.linear_min_mps / (self.linear_max_mps - self.linear_min_mps)
    }

    /// A wish cut to what the robot can do: speed in [min, max], turning either way. What is not finite becomes
    /// 0, as a motor driver would do.
    pub fn limited(&self, wish: Twist) -> Twist {
        let finite = |value: f32| if value.is_finite() { value } else { 0.0 };
        Twist {
            linear_mps: finite(wish.linear_mps).clamp(self.linear_min_mps, self.linear_max_mps),
            angular_radps: finite(wish.angular_radps).clamp(-self.angular_max_radps, self.angular_max_radps),
        }
    }

    /// As near to `wish` as the acceleration limits allow `dt_s` after `last`.
    pub fn ramped(&self, last: Twist, wish: Twist, dt_s: f32) -> Twist {
        let towards = |last: f32, wish: f32, acceleration: f32| {
            let change = acceleration * dt_s;
            wish.clamp(last - change, last + change)
        };
        Twist {
            linear_mps: towards(last.linear_mps, wish.linear_mps, self.linear_acceleration_mps2),
            angular_radps: towards(last.angular_radps, wish.angular_radps, self.angular_acceleration_radps2),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::task::Task;

    #[test]
    fn actions_span_the_speeds_that_the_robot_has() {
        let robot = |linear_min_mps| Robot { linear_max_mps: 1.5, linear_min_mps, ..Robot::default() };
        let (forward, both) = (robot(0.0), robot(-0.5));
        for action in [-1.0_f32, -0.3, 0.1, 0.77, 1.0] {
            // To the bit as it was before robots could reverse.
            assert_eq!(forward.linear_of(action).to_bits(), (0.5 * (action + 1.0) * 1.5).to_bits());
        }
        for (action, linear_mps) in [(-1.0, -0.5), (0.0, 0.5), (1.0, 1.5)] {
            assert!((both.linear_of(action) - linear_mps).abs() < 1e-6, "{action}");
        }
        assert_eq!(forward.action_at_rest().to_bits(), (-1.0_f32).to_bits());
        assert!(both.linear_of(both.action_at_rest()).abs() < 1e-6);
        assert_eq!(both.limited(Twist::new(-2.0, 0.0)), Twist::new(-0.5, 0.0));
        assert_eq!(forward.limited(Twist::new(-2.0, 0.0)), Twist::ZERO);
    }

    #[test]
    fn a_robot_is_never_faster_backwards_than_forward() {
        let problem = |linear_min_mps| {
            let robot = Robot { linear_min_mps, ..Robot::default() };
            Task { robot, ..Task::default() }.validate()
        };
        assert_eq!([0.0, -1.0].map(problem), [Ok(()); 2]);
        for linear_min_mps in [0.1, -1.1, f32::NAN] {
            let sentence = problem(linear_min_mps).expect_err("makes no sense");
            assert!(sentence.contains("linear_min_mps"), "{sentence}");
        }
    }
}
