//! The outline of a robot on the floor, in the robot frame: x ahead, and the origin is the point that the base turns about.

mod passing;

pub use self::passing::{Lane, Turns};

use crate::geometry::{Point, Pose};
use serde::{Deserialize, Serialize};

/// A robot has at least the size of one that turns in a circle smaller by this factor.
const TURNING: f32 = 1.5;
/// One side of a rectangle is at most so many times as long as the other.
const ASPECT_MAX: f32 = 8.0;

/// What of the floor a robot covers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Footprint {
    /// A disc about the origin.
    Circle {
        /// Its radius, m.
        radius_m: f32,
    },
    /// A rectangle, with the origin between its sides.
    Rectangle {
        /// How far it reaches ahead of the origin, m.
        front_m: f32,
        /// How far it reaches behind it, m.
        rear_m: f32,
        /// How far it reaches to either side, m.
        half_width_m: f32,
    },
}

impl Footprint {
    /// A disc.
    pub const fn circle(radius_m: f32) -> Self {
        Self::Circle { radius_m }
    }

    /// Radius of the circle that it turns in, m: nothing of it is farther from the origin.
    pub fn circumradius_m(&self) -> f32 {
        match *self {
            Self::Circle { radius_m } => radius_m,
            Self::Rectangle { front_m, rear_m, half_width_m } => {
                let long_m = front_m.max(rear_m);
                libm::sqrtf(long_m * long_m + half_width_m * half_width_m)
            }
        }
    }

    /// The length that a robot's world is measured by, m: half of its width, or two thirds of the radius that it turns in,
    /// if that is more; the radius of a disc. See [`crate::scale`].
    pub fn size_m(&self) -> f32 {
        self.half_width_m().max(self.circumradius_m() / TURNING)
    }

    /// How far it reaches to either side, m: what it needs to pass straight on.
    pub const fn half_width_m(&self) -> f32 {
        match *self {
            Self::Circle { radius_m } => radius_m,
            Self::Rectangle { half_width_m, .. } => half_width_m,
        }
    }

    /// From the origin to the outline in direction (`cos`, `sin`), m.
    pub fn reach_m(&self, cos: f32, sin: f32) -> f32 {
        match *self {
            Self::Circle { radius_m } => radius_m,
            Self::Rectangle { .. } => self.exit_m(Point::origin(), cos, sin),
        }
    }

    /// From a point to the outline in direction (`cos`, `sin`), m; 0 outside.
    fn exit_m(&self, from: Point, cos: f32, sin: f32) -> f32 {
        match *self {
            Self::Circle { radius_m } => {
                let (along, beyond) =
                    (from.x * cos + from.y * sin, from.coords.norm_squared() - radius_m * radius_m);
                if beyond < 0.0 { libm::sqrtf(along * along - beyond) - along } else { 0.0 }
            }
            Self::Rectangle { front_m, rear_m, half_width_m } => {
                let end_m = if cos > 0.0 { front_m - from.x } else { rear_m + from.x };
                let side_m = if sin > 0.0 { half_width_m - from.y } else { half_width_m + from.y };
                // What is divided by zero is infinite, and never the nearer side.
                if self.distance_m(from) < 0.0 { (end_m / cos.abs()).min(side_m / sin.abs()) } else { 0.0 }
            }
        }
    }

    /// From a sensor at a pose of the robot frame to the outline in direction (`cos`, `sin`) of its own frame, m; 0 where it
    /// sits outside.
    pub fn edge_m(&self, mount: &Pose, cos: f32, sin: f32) -> f32 {
        if *mount == Pose::default() {
            return self.reach_m(cos, sin);
        }
        let (mount_sin, mount_cos) = libm::sincosf(mount.yaw_rad);
        let (cos, sin) = (mount_cos * cos - mount_sin * sin, mount_sin * cos + mount_cos * sin);
        self.exit_m(mount.position(), cos, sin)
    }

    /// From the outline to a point, m; negative inside.
    pub fn distance_m(&self, point: Point) -> f32 {
        match *self {
            Self::Circle { radius_m } => libm::sqrtf(point.x * point.x + point.y * point.y) - radius_m,
            Self::Rectangle { front_m, rear_m, half_width_m } => {
                let along = (point.x - front_m).max(-rear_m - point.x);
                let across = point.y.abs() - half_width_m;
                let (ahead, aside) = (along.max(0.0), across.max(0.0));
                libm::sqrtf(ahead * ahead + aside * aside) + along.max(across).min(0.0)
            }
        }
    }

    /// Whether it covers all that another covers.
    pub fn contains(&self, other: &Self) -> bool {
        match (*self, *other) {
            (Self::Circle { radius_m }, _) => other.circumradius_m() <= radius_m,
            (Self::Rectangle { front_m, rear_m, half_width_m }, Self::Circle { radius_m }) => {
                radius_m <= front_m.min(rear_m).min(half_width_m)
            }
            (Self::Rectangle { .. }, Self::Rectangle { .. }) => {
                other.corners().into_iter().flatten().all(|corner| self.distance_m(corner) <= 0.0)
            }
        }
    }

    /// Whether it has the size of a robot: a radius in [0.02, 5] m; front and rear in [0, 5] m, half a width in [0.02, 5] m,
    /// at least 0.04 m of length, and one side at most 8 times as long as the other.
    pub fn is_sound(&self) -> bool {
        let within = |value: f32, low: f32| value >= low && value <= 5.0;
        match *self {
            Self::Circle { radius_m } => within(radius_m, 0.02),
            Self::Rectangle { front_m, rear_m, half_width_m } => {
                let (length_m, width_m) = (front_m + rear_m, 2.0 * half_width_m);
                within(front_m, 0.0)
                    && within(rear_m, 0.0)
                    && within(half_width_m, 0.02)
                    && length_m >= 0.04
                    && length_m <= ASPECT_MAX * width_m
                    && width_m <= ASPECT_MAX * length_m
            }
        }
    }

    /// The same, so many times as large.
    #[must_use]
    pub fn scaled(&self, factor: f32) -> Self {
        match *self {
            Self::Circle { radius_m } => Self::Circle { radius_m: radius_m * factor },
            Self::Rectangle { front_m, rear_m, half_width_m } => Self::Rectangle {
                front_m: front_m * factor,
                rear_m: rear_m * factor,
                half_width_m: half_width_m * factor,
            },
        }
    }

    /// The corners of a rectangle, counter-clockwise from the left one ahead; a disc has none.
    pub const fn corners(&self) -> Option<[Point; 4]> {
        match *self {
            Self::Circle { .. } => None,
            Self::Rectangle { front_m, rear_m, half_width_m } => Some([
                Point::new(front_m, half_width_m),
                Point::new(-rear_m, half_width_m),
                Point::new(-rear_m, -half_width_m),
                Point::new(front_m, -half_width_m),
            ]),
        }
    }
}

/// As people are told: its measures in metres.
impl core::fmt::Display for Footprint {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Circle { radius_m } => write!(f, "radius {radius_m} m"),
            Self::Rectangle { front_m, rear_m, half_width_m } => {
                write!(f, "{front_m} m ahead, {rear_m} m behind and {half_width_m} m to either side")
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f32::consts::TAU;

    const LONG: Footprint = Footprint::Rectangle { front_m: 0.7, rear_m: 0.2, half_width_m: 0.15 };

    #[test]
    fn the_outline_lies_where_it_is_reached_and_nowhere_else() {
        for footprint in [LONG, Footprint::circle(0.3)] {
            let mut farthest_m = 0.0_f32;
            for step in 0..720_u16 {
                let (sin, cos) = libm::sincosf(f32::from(step) * TAU / 720.0);
                let reach_m = footprint.reach_m(cos, sin);
                let at = |m: f32| footprint.distance_m(Point::new(m * cos, m * sin));
                assert!(at(reach_m).abs() < 1e-6, "{footprint} at {cos}, {sin}: {}", at(reach_m));
                assert!(at(0.99 * reach_m) < 0.0 && at(1.01 * reach_m) > 0.0, "{footprint} at {cos}, {sin}");
                farthest_m = farthest_m.max(reach_m);
            }
            assert!((footprint.circumradius_m() - farthest_m).abs() < 2e-3, "{footprint}: {farthest_m}");
        }
    }

    #[test]
    fn a_sensor_anywhere_in_it_looks_out_through_the_same_outline() {
        for footprint in [LONG, Footprint::circle(0.3)] {
            let mount = Pose::new(0.12, -0.07, 0.8);
            for step in 0..90_u16 {
                let (sin, cos) = libm::sincosf(f32::from(step) * TAU / 90.0);
                let edge_m = footprint.edge_m(&mount, cos, sin);
                let at = mount.parent_from_local(Point::new(edge_m * cos, edge_m * sin));
                assert!(
                    edge_m > 0.0 && footprint.distance_m(at).abs() < 1e-6,
                    "{footprint}: {edge_m} to {at}"
                );
            }
            assert!(footprint.edge_m(&Pose::new(0.8, 0.0, 0.0), 1.0, 0.0) <= 0.0, "outside");
        }
    }

    #[test]
    fn distances_are_to_the_nearest_point_of_the_outline() {
        for (x, y, distance_m) in [
            (1.0, 0.0, 0.3),
            (-0.5, 0.1, 0.3),
            (0.3, -0.4, 0.25),
            (1.0, 0.55, 0.5),
            (-0.5, -0.55, 0.5),
            (0.6, 0.0, -0.1),
            (0.0, 0.1, -0.05),
        ] {
            let found_m = LONG.distance_m(Point::new(x, y));
            assert!((found_m - distance_m).abs() < 1e-6, "({x}, {y}): {found_m}");
        }
        let corners = LONG.corners().expect("a rectangle has them");
        assert!(corners.into_iter().all(|corner| LONG.distance_m(corner).abs() < 1e-6));
    }

    #[test]
    fn one_contains_another_when_no_corner_sticks_out() {
        let circle = Footprint::circle;
        let shorter = Footprint::Rectangle { front_m: 0.6, rear_m: 0.2, half_width_m: 0.15 };
        for (outer, inner) in [(LONG, LONG), (LONG, shorter), (LONG, circle(0.15)), (circle(0.72), LONG)] {
            assert!(outer.contains(&inner), "{inner} in {outer}");
        }
        for (outer, inner) in
            [(shorter, LONG), (LONG, circle(0.16)), (circle(0.71), LONG), (circle(0.1), circle(0.2))]
        {
            assert!(!outer.contains(&inner), "{inner} in {outer}");
        }
    }

    #[test]
    fn sizes_that_no_robot_has_are_told() {
        let rectangle =
            |front_m, rear_m, half_width_m| Footprint::Rectangle { front_m, rear_m, half_width_m };
        assert!(rectangle(0.5, 0.0, 0.2).is_sound() && LONG.is_sound() && Footprint::circle(0.02).is_sound());
        for footprint in [
            Footprint::circle(0.0),
            Footprint::circle(f32::NAN),
            Footprint::circle(5.1),
            rectangle(-0.1, 0.5, 0.2),
            rectangle(0.5, f32::NAN, 0.2),
            rectangle(0.01, 0.02, 0.02),
            rectangle(0.5, 0.5, 0.05),
            rectangle(0.02, 0.02, 0.3),
        ] {
            assert!(!footprint.is_sound(), "{footprint}");
        }
    }

    #[test]
    fn twice_as_large_is_twice_as_far() {
        let large = LONG.scaled(2.0);
        for (x, y) in [(0.3, 0.4), (-0.7, 0.1), (0.1, 0.05)] {
            let (own, other) =
                (LONG.distance_m(Point::new(x, y)), large.distance_m(Point::new(2.0 * x, 2.0 * y)));
            assert_eq!((2.0 * own).to_bits(), other.to_bits());
        }
        assert_eq!((2.0 * LONG.circumradius_m()).to_bits(), large.circumradius_m().to_bits());
    }
}
