//! A planar velocity: what the base does, is told to do, or is wished to do.

use crate::task::Robot;

/// Velocity of a differential-drive base.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Twist {
    /// Forward speed, m/s.
    pub linear_mps: f32,
    /// Turning rate, counter-clockwise, rad/s.
    pub angular_radps: f32,
}

impl Twist {
    /// At a standstill.
    pub const ZERO: Self = Self::new(0.0, 0.0);

    /// From a forward speed (m/s) and a turning rate (rad/s).
    pub const fn new(linear_mps: f32, angular_radps: f32) -> Self {
        Self { linear_mps, angular_radps }
    }

    /// Whether both numbers are finite.
    pub fn is_finite(self) -> bool {
        self.linear_mps.is_finite() && self.angular_radps.is_finite()
    }

    /// Cut to what a robot can do: forward in [0, max], turning either way. What is not finite becomes 0, as
    /// a motor driver would do.
    pub fn limited(self, robot: &Robot) -> Self {
        let finite = |value: f32| if value.is_finite() { value } else { 0.0 };
        Self {
            linear_mps: finite(self.linear_mps).clamp(0.0, robot.linear_max_mps),
            angular_radps: finite(self.angular_radps)
                .clamp(-robot.angular_max_radps, robot.angular_max_radps),
        }
    }
}
