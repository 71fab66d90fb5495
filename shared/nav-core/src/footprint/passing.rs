//! What a robot needs to drive straight on, and how far it can turn on the spot.

use super::Footprint;
use crate::geometry::{Point, wrap_angle};
use core::f32::consts::{FRAC_PI_4, PI, TAU};

/// What lies no farther off the heading a robot turns to on its way, not on the spot, rad.
const ON_THE_WAY_RAD: f32 = FRAC_PI_4;

/// What a robot sweeps that drives straight on, with some room beside it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lane {
    half_width_m: f32,
    /// How far a flat front reaches ahead, m; a round one as its half width says.
    front_m: Option<f32>,
}

impl Footprint {
    /// What it sweeps straight on, with `beside_m` kept free on all sides.
    pub fn lane(&self, beside_m: f32) -> Lane {
        match *self {
            Self::Circle { radius_m } => Lane { half_width_m: radius_m + beside_m, front_m: None },
            Self::Rectangle { front_m, half_width_m, .. } => {
                Lane { half_width_m: half_width_m + beside_m, front_m: Some(front_m + beside_m) }
            }
        }
    }

    /// How far it can turn on the spot until its outline meets a point; that touches it already counts for nothing.
    fn turns_before(&self, point: Point) -> Turns {
        let Self::Rectangle { front_m, rear_m, half_width_m } = *self else { return Turns::FREE };
        let range_m = libm::sqrtf(point.x * point.x + point.y * point.y);
        if range_m >= self.circumradius_m() || self.distance_m(point) <= 0.0 {
            return Turns::FREE;
        }
        let bearing_rad = libm::atan2f(point.y, point.x);
        let mut turns = Turns::FREE;
        let mut meet = |outline_rad: f32| {
            let left_rad = wrap_angle(bearing_rad - outline_rad);
            let left_rad = if left_rad < 0.0 { left_rad + TAU } else { left_rad };
            turns.left_rad = turns.left_rad.min(left_rad);
            turns.right_rad = turns.right_rad.min(TAU - left_rad);
        };
        // Where the circle through the point crosses the outline: its ends, then its sides.
        for (end_m, middle_rad) in [(front_m, 0.0), (rear_m, PI)] {
            let off_rad = libm::acosf((end_m / range_m).min(1.0));
            if end_m < range_m && range_m * libm::sinf(off_rad) <= half_width_m {
                meet(middle_rad + off_rad);
                meet(middle_rad - off_rad);
            }
        }
        if half_width_m < range_m {
            let off_rad = libm::asinf(half_width_m / range_m);
            let along_m = range_m * libm::cosf(off_rad);
            for (is_within, outline_rad) in [(along_m <= front_m, off_rad), (along_m <= rear_m, PI - off_rad)]
            {
                if is_within {
                    meet(outline_rad);
                    meet(-outline_rad);
                }
            }
        }
        turns
    }
}

impl Lane {
    /// Whether a point beside the way by `lateral_m` lies in it.
    pub(crate) fn holds(&self, lateral_m: f32) -> bool {
        lateral_m.abs() < self.half_width_m
    }

    /// How far it is free before a point ahead by `along_m` and beside the way by `lateral_m`, m, if that lies in it and is
    /// met within `limit_m`.
    pub(crate) fn free_before(&self, along_m: f32, lateral_m: f32, limit_m: f32) -> Option<f32> {
        let Self { half_width_m, front_m } = *self;
        let rest = half_width_m * half_width_m - lateral_m * lateral_m;
        let nose_m = front_m.unwrap_or(half_width_m);
        if along_m > 0.0 && rest > 0.0 && along_m - nose_m < limit_m {
            Some((along_m - front_m.unwrap_or_else(|| libm::sqrtf(rest))).max(0.0))
        } else {
            None
        }
    }
}

/// How far a robot can turn on the spot either way, rad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turns {
    left_rad: f32,
    right_rad: f32,
}

impl Turns {
    /// As far as it likes, as a disc can.
    pub(crate) const FREE: Self = Self { left_rad: TAU, right_rad: TAU };

    /// How far a footprint can turn between points of the robot frame.
    pub(crate) fn between(footprint: &Footprint, points: impl Iterator<Item = Point>) -> Self {
        points.fold(Self::FREE, |turns, point| {
            let Self { left_rad, right_rad } = footprint.turns_before(point);
            Self { left_rad: turns.left_rad.min(left_rad), right_rad: turns.right_rad.min(right_rad) }
        })
    }

    /// Whether a robot can get its front to a bearing of the robot frame, or its rear, if it `reverses`.
    pub fn lead_to(&self, bearing_rad: f32, reverses: bool) -> bool {
        let leads = |bearing_rad: f32| {
            let bearing_rad = wrap_angle(bearing_rad);
            let (left_rad, right_rad) = if bearing_rad < 0.0 {
                (bearing_rad + TAU, -bearing_rad)
            } else {
                (bearing_rad, TAU - bearing_rad)
            };
            bearing_rad.abs() <= ON_THE_WAY_RAD || left_rad <= self.left_rad || right_rad <= self.right_rad
        };
        leads(bearing_rad) || (reverses && leads(bearing_rad + PI))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LONG: Footprint = Footprint::Rectangle { front_m: 0.6, rear_m: 0.3, half_width_m: 0.2 };

    /// By turning it little by little.
    fn stepped(point: Point, sign: f32) -> f32 {
        let range_m = point.coords.norm();
        let bearing_rad = libm::atan2f(point.y, point.x);
        let touches = |turn_rad: &f32| {
            let (sin, cos) = libm::sincosf(bearing_rad - sign * turn_rad);
            LONG.distance_m(Point::new(range_m * cos, range_m * sin)) < 0.0
        };
        (0..6283_u16).map(|step| f32::from(step) * 1e-3).find(touches).unwrap_or(TAU)
    }

    #[test]
    fn a_box_turns_until_it_meets_a_point() {
        let mut met = 0;
        for step in 0..400_u16 {
            let (sin, cos) = libm::sincosf(f32::from(step) * 0.7);
            let range_m = 0.15 + 0.0013 * f32::from(step);
            let point = Point::new(range_m * cos, range_m * sin);
            if LONG.distance_m(point) < 1e-3 {
                continue;
            }
            let turns = LONG.turns_before(point);
            for (found_rad, sign) in [(turns.left_rad, 1.0), (turns.right_rad, -1.0)] {
                let expected_rad = stepped(point, sign);
                // The tip of a corner passes between two steps.
                let is_tip =
                    (range_m - LONG.circumradius_m()).abs() < 1e-3 || (range_m - 0.3606).abs() < 1e-3;
                assert!(
                    is_tip || (found_rad - expected_rad).abs() < 3e-3,
                    "{point}: {found_rad} {expected_rad}"
                );
                met += u32::from(found_rad < TAU);
            }
        }
        assert!(met > 200, "{met}");
    }

    #[test]
    fn between_walls_it_goes_on_or_back_and_not_aside() {
        let walls = (-20..=20_i16).flat_map(|k| [0.3, -0.3].map(|y| Point::new(0.05 * f32::from(k), y)));
        let turns = Turns::between(&LONG, walls);
        assert!(turns.lead_to(0.0, false) && turns.lead_to(0.4, false));
        assert!(!turns.lead_to(1.5, false) && !turns.lead_to(PI, false) && !turns.lead_to(-1.5, true));
        assert!(turns.lead_to(PI, true) && turns.lead_to(-3.0, true), "backwards");
        assert!(Turns::FREE.lead_to(PI, false));
        // A thing on the left: it turns to the right all the way.
        let one_sided = Turns::between(&LONG, [Point::new(0.3, 0.35)].into_iter());
        assert!(one_sided.lead_to(1.5, false) && one_sided.left_rad < 0.5 && one_sided.right_rad > 2.0);
    }
}
