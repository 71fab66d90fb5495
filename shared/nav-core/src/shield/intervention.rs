//! What the gate did, and because of what.

use core::fmt;

/// Why another command left than was wished.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Intervention {
    /// Because of what.
    pub hazard: Hazard,
    /// In which direction it will be when it is met, robot frame of now, rad.
    pub bearing_rad: f32,
    /// In how long, s.
    pub in_s: f32,
    /// Whether none of the commands that were tried is safe.
    pub is_forced: bool,
}

/// What can be met.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Hazard {
    /// Something that was hit, moving or not, before which the robot could no longer stop.
    Standing,
    /// Somebody who moves.
    Person,
}

impl fmt::Display for Intervention {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let what = match self.hazard {
            Hazard::Standing => "obstacle",
            Hazard::Person => "person",
        };
        let eighth = libm::roundf(self.bearing_rad / core::f32::consts::FRAC_PI_4) as i32;
        let side = match eighth {
            0 => "ahead",
            1..=2 => "from the left",
            -2..=-1 => "from the right",
            _ => "from behind",
        };
        let forced = if self.is_forced { ", no safe way" } else { "" };
        write!(f, "shield: {what} {side}, {:.1} s{forced}", self.in_s)
    }
}
