//! Which beams can hit an obstacle.

use nav_core::geometry::Vector;
use std::f32::consts::{FRAC_PI_2, PI, TAU};
use std::ops::Range;

/// Added on both sides of an obstacle, rad: ten times the error of [`fast_atan2`], and more than the rounding
/// of angles.
const MARGIN_RAD: f32 = 1e-4;

/// The beams of a lidar as multiples of an angle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spans {
    angle_min_rad: f32,
    increment_rad: f32,
    per_rad: f32,
    count: usize,
}

impl Spans {
    pub(super) fn new(angle_min_rad: f32, increment_rad: f32, count: usize) -> Self {
        Self { angle_min_rad, increment_rad, per_rad: 1.0 / increment_rad, count }
    }

    /// The beams that can hit a disc that does not hold the origin.
    pub(super) fn of_disc(&self, center: Vector, radius_m: f32) -> [Range<usize>; 2] {
        let tangent_m = (center.norm_squared() - radius_m * radius_m).max(0.0).sqrt();
        let half_rad = fast_atan2(radius_m, tangent_m) + MARGIN_RAD;
        let middle_rad = fast_atan2(center.y, center.x);
        self.between(middle_rad - half_rad, 2.0 * half_rad)
    }

    /// The beams that can hit a segment.
    pub(super) fn of_segment(&self, a: Vector, b: Vector) -> [Range<usize>; 2] {
        // Counter-clockwise from the first to the second end, seen from the origin.
        let (first, second) = if a.x * b.y - a.y * b.x >= 0.0 { (a, b) } else { (b, a) };
        let from_rad = fast_atan2(first.y, first.x);
        let mut width_rad = fast_atan2(second.y, second.x) - from_rad;
        if width_rad < -MARGIN_RAD {
            width_rad += TAU;
        }
        self.between(from_rad - MARGIN_RAD, width_rad + 2.0 * MARGIN_RAD)
    }

    /// The beams from an angle in [-2π, 2π] on for less than a turn: a range, and another where that passes
    /// beam 0.
    fn between(&self, from_rad: f32, width_rad: f32) -> [Range<usize>; 2] {
        let mut from_rad = from_rad - self.angle_min_rad;
        if from_rad < 0.0 {
            from_rad += TAU;
        }
        if from_rad >= TAU {
            from_rad -= TAU;
        }
        let to_rad = from_rad + width_rad;
        [self.clipped(from_rad, to_rad), self.clipped(from_rad - TAU, to_rad - TAU)]
    }

    fn clipped(&self, from_rad: f32, to_rad: f32) -> Range<usize> {
        if to_rad < 0.0 {
            return 0..0;
        }
        // Truncation rounds down here: both are at least 0.
        let low = (from_rad.max(0.0) * self.per_rad) as usize;
        let low = low + usize::from((low as f32) * self.increment_rad < from_rad);
        let end = ((to_rad * self.per_rad) as usize + 1).min(self.count);
        low.min(end)..end
    }
}

/// `atan2` in (-π, π] with an error below 1.2e-5 rad (polynomial 4.4.49 of Abramowitz and Stegun); 0 at the
/// origin.
fn fast_atan2(y: f32, x: f32) -> f32 {
    let (ax, ay) = (x.abs(), y.abs());
    let (low, high) = (ax.min(ay), ax.max(ay));
    let z = if high > 0.0 { low / high } else { 0.0 };
    let z2 = z * z;
    let polynomial =
        0.999_866 + z2 * (-0.330_299_5 + z2 * (0.180_141 + z2 * (-0.085_133 + z2 * 0.020_835_1)));
    let octant = z * polynomial;
    let quadrant = if ay > ax { FRAC_PI_2 - octant } else { octant };
    let half = if x < 0.0 { PI - quadrant } else { quadrant };
    if y < 0.0 { -half } else { half }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fast_angle_is_as_close_as_its_margin_needs() {
        for k in 0..20_000_u16 {
            let angle_rad = (f32::from(k) / 10_000.0 - 1.0) * PI;
            let (sin, cos) = (libm::sinf(angle_rad), libm::cosf(angle_rad));
            let exact_rad = libm::atan2f(3.0 * sin, 3.0 * cos);
            assert!((fast_atan2(3.0 * sin, 3.0 * cos) - exact_rad).abs() < 0.2 * MARGIN_RAD, "{angle_rad}");
        }
        assert!(fast_atan2(0.0, 0.0).abs() < MARGIN_RAD);
    }

    #[test]
    fn a_span_across_beam_zero_has_two_parts() {
        let spans = Spans::new(-PI, TAU / 72.0, 72);
        // Behind the robot: beam 0 looks straight back.
        let [first, second] = spans.of_disc(Vector::new(-2.0, 0.0), 0.4);
        assert_eq!((first, second), (70..72, 0..3));
    }
}
