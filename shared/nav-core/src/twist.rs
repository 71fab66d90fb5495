//! A planar velocity: what the base does, is told to do, or is wished to do.

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
}
