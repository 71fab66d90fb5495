//! The robot's footprint at a pose, against what stands and walks: exact for discs and rectangles.

use crate::collision::{closest_on_segment, time_to_disc_s, time_to_segment_s};
use crate::world::{Disc, Segment};
use nav_core::footprint::Footprint;
use nav_core::geometry::{Point, Pose, Vector};
use std::f32::consts::TAU;

/// Points of a drawn outline.
const OUTLINE_POINTS: u8 = 48;

/// A footprint where it is.
#[derive(Clone, Copy, Debug)]
pub struct Body {
    footprint: Footprint,
    position: Point,
    cos: f32,
    sin: f32,
}

impl Body {
    /// A footprint at a pose of the world.
    pub fn new(footprint: Footprint, pose: Pose) -> Self {
        let (sin, cos) = libm::sincosf(pose.yaw_rad);
        Self { footprint, position: pose.position(), cos, sin }
    }

    /// Where its origin is, m.
    pub fn position(&self) -> Point {
        self.position
    }

    /// Its shape.
    pub fn footprint(&self) -> &Footprint {
        &self.footprint
    }

    /// A vector of the world in the robot frame.
    fn turned(&self, world: Vector) -> Vector {
        let Self { cos, sin, .. } = *self;
        Vector::new(cos * world.x + sin * world.y, cos * world.y - sin * world.x)
    }

    fn local(&self, point: Point) -> Point {
        Point::from(self.turned(point - self.position))
    }

    /// Points of the outline, all the way round, for pictures.
    pub fn outline(&self) -> impl Iterator<Item = Point> {
        let Self { footprint, position, cos, sin } = *self;
        (0..OUTLINE_POINTS).map(move |part| {
            let (y, x) = libm::sincosf(f32::from(part) * TAU / f32::from(OUTLINE_POINTS));
            let reach_m = footprint.reach_m(x, y);
            position + Vector::new(cos * x - sin * y, sin * x + cos * y) * reach_m
        })
    }

    /// The sides of a rectangle, in the robot frame; a disc has none.
    fn sides(&self) -> impl Iterator<Item = Segment> {
        let corners = self.footprint.corners();
        corners.into_iter().flat_map(|corners| {
            (0..4).map(move |side| Segment { a: corners[side], b: corners[(side + 1) % 4] })
        })
    }

    /// Whether it comes within `gap_m` of a disc.
    pub fn touches_disc(&self, disc: &Disc, gap_m: f32) -> bool {
        if let Footprint::Circle { radius_m } = self.footprint {
            let reach_m = radius_m + disc.radius_m + gap_m;
            return (disc.center - self.position).norm_squared() < reach_m * reach_m;
        }
        self.footprint.distance_m(self.local(disc.center)) < disc.radius_m + gap_m
    }

    /// Whether it touches an edge.
    pub fn touches_edge(&self, edge: &Segment) -> bool {
        if let Footprint::Circle { radius_m } = self.footprint {
            let away = self.position - closest_on_segment(self.position, edge);
            return away.norm_squared() < radius_m * radius_m;
        }
        self.part_inside(self.local(edge.a), self.local(edge.b)).is_some()
    }

    /// From the outline to a disc, m; negative where they overlap.
    pub fn distance_to_disc_m(&self, disc: &Disc) -> f32 {
        if let Footprint::Circle { radius_m } = self.footprint {
            return (disc.center - self.position).norm() - disc.radius_m - radius_m;
        }
        self.footprint.distance_m(self.local(disc.center)) - disc.radius_m
    }

    /// From the outline to an edge, m; where they overlap, minus how deep the middle of the part inside lies.
    pub fn distance_to_edge_m(&self, edge: &Segment) -> f32 {
        let (a, b) = (self.local(edge.a), self.local(edge.b));
        if let Footprint::Circle { radius_m } = self.footprint {
            return closest_on_segment(Point::origin(), &Segment { a, b }).coords.norm() - radius_m;
        }
        if let Some((first, last)) = self.part_inside(a, b) {
            return self.footprint.distance_m(a + (b - a) * (0.5 * (first + last)));
        }
        let ends_m = self.footprint.distance_m(a).min(self.footprint.distance_m(b));
        let corners = self.footprint.corners().into_iter().flatten();
        corners.fold(ends_m, |nearest_m, corner| {
            nearest_m.min((corner - closest_on_segment(corner, &Segment { a, b })).norm())
        })
    }

    /// The part of a segment of the robot frame inside a rectangle, as shares of its length.
    fn part_inside(&self, a: Point, b: Point) -> Option<(f32, f32)> {
        let Footprint::Rectangle { front_m, rear_m, half_width_m } = self.footprint else { return None };
        let along = b - a;
        let (mut first, mut last) = (0.0_f32, 1.0_f32);
        for (from, way, low, high) in
            [(a.x, along.x, -rear_m, front_m), (a.y, along.y, -half_width_m, half_width_m)]
        {
            if way == 0.0 {
                if from <= low || from >= high {
                    return None;
                }
                continue;
            }
            let (one, other) = ((low - from) / way, (high - from) / way);
            first = first.max(one.min(other));
            last = last.min(one.max(other));
        }
        (first < last).then_some((first, last))
    }

    /// Time until it touches a disc, moving with `velocity` (world frame) relative to it and without turning, s: as
    /// [`time_to_disc_s`].
    pub fn time_to_disc_s(&self, disc: &Disc, velocity: Vector) -> f32 {
        if let Footprint::Circle { radius_m } = self.footprint {
            return time_to_disc_s(disc.center - self.position, radius_m + disc.radius_m, velocity);
        }
        if self.touches_disc(disc, 0.0) {
            return 0.0;
        }
        let (center, coming) = (self.local(disc.center), -self.turned(velocity));
        self.sides().fold(f32::INFINITY, |soonest_s, side| {
            soonest_s.min(time_to_segment_s(side.a - center, side.b - center, disc.radius_m, coming))
        })
    }

    /// The same for an edge.
    pub fn time_to_edge_s(&self, edge: &Segment, velocity: Vector) -> f32 {
        if let Footprint::Circle { radius_m } = self.footprint {
            return time_to_segment_s(edge.a - self.position, edge.b - self.position, radius_m, velocity);
        }
        if self.touches_edge(edge) {
            return 0.0;
        }
        let (a, b, going) = (self.local(edge.a), self.local(edge.b), self.turned(velocity));
        // They meet with an end of one or the other.
        self.sides().fold(f32::INFINITY, |soonest_s, side| {
            let corner_s = time_to_segment_s(a - side.a, b - side.a, 0.0, going);
            let ends_s = [a, b].map(|end| time_to_segment_s(side.a - end, side.b - end, 0.0, -going));
            soonest_s.min(corner_s).min(ends_s[0]).min(ends_s[1])
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::collision::is_inside;
    use proptest::prelude::*;

    fn bodies() -> impl Strategy<Value = Body> {
        let place = (-1.0..1.0_f32, -1.0..1.0_f32, -3.1..3.1_f32);
        (0.02..1.0_f32, 0.02..1.0_f32, 0.05..0.6_f32, place).prop_map(
            |(front_m, rear_m, half_width_m, (x_m, y_m, yaw_rad))| {
                let footprint = Footprint::Rectangle { front_m, rear_m, half_width_m };
                Body::new(footprint, Pose::new(x_m, y_m, yaw_rad))
            },
        )
    }

    fn point() -> impl Strategy<Value = Point> {
        (-2.5..2.5_f32, -2.5..2.5_f32).prop_map(|(x, y)| Point::new(x, y))
    }

    /// As a polygon of the world, which knows nothing of frames.
    fn polygon(body: &Body, moved: Vector) -> Vec<Point> {
        let Body { cos, sin, .. } = *body;
        let corners = body.footprint.corners().expect("a rectangle");
        let world = |p: Point| Vector::new(cos * p.x - sin * p.y, sin * p.x + cos * p.y);
        corners.map(|corner| body.position + world(corner) + moved).to_vec()
    }

    /// From a point to a polygon, m; 0 inside.
    fn away_m(at: Point, polygon: &[Point]) -> f32 {
        if is_inside(at, polygon) {
            return 0.0;
        }
        let ends = polygon.iter().cycle().skip(1);
        let sides = polygon.iter().zip(ends).map(|(&a, &b)| Segment { a, b });
        sides.map(|side| (at - closest_on_segment(at, &side)).norm()).fold(f32::INFINITY, f32::min)
    }

    /// From an edge to a polygon, m, by many points of the edge.
    fn edge_away_m(edge: &Segment, polygon: &[Point]) -> f32 {
        let at = |share: u16| edge.a + (edge.b - edge.a) * (f32::from(share) / 400.0);
        (0..=400).map(|share| away_m(at(share), polygon)).fold(f32::INFINITY, f32::min)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(512))]

        #[test]
        fn a_rectangle_touches_what_its_polygon_touches(
            body in bodies(), a in point(), b in point(), radius_m in 0.05..0.5_f32,
        ) {
            let polygon = polygon(&body, Vector::zeros());
            let (edge, disc) = (Segment { a, b }, Disc { center: a, radius_m });
            let (edge_m, disc_m) = (edge_away_m(&edge, &polygon), away_m(a, &polygon) - radius_m);
            // Points of an edge are 18 mm apart at most.
            if edge_m > 0.0 && body.touches_edge(&edge) {
                prop_assert!(edge_m < 0.01, "{edge_m}");
            }
            prop_assert!(edge_m > 0.0 || body.touches_edge(&edge));
            if disc_m.abs() > 1e-4 {
                prop_assert_eq!(body.touches_disc(&disc, 0.0), disc_m < 0.0, "{}", disc_m);
            }
            if edge_m > 0.01 {
                prop_assert!((body.distance_to_edge_m(&edge) - edge_m).abs() < 0.01);
            } else if body.touches_edge(&edge) {
                prop_assert!(body.distance_to_edge_m(&edge) < 0.0);
            }
            if away_m(a, &polygon) > 0.0 {
                prop_assert!((body.distance_to_disc_m(&disc) - disc_m).abs() < 1e-4);
            }
        }

        #[test]
        fn it_is_met_when_stepping_meets_it(
            body in bodies(), a in point(), b in point(), radius_m in 0.05..0.5_f32,
            (vx, vy) in (-1.0..1.0_f32, -1.0..1.0_f32),
        ) {
            let velocity = Vector::new(vx, vy);
            let (edge, disc) = (Segment { a, b }, Disc { center: a, radius_m });
            let moved = |s: f32| Body { position: body.position + velocity * s, ..body };
            for (time_s, touches) in [
                (body.time_to_edge_s(&edge, velocity), &(|s| moved(s).touches_edge(&edge)) as &dyn Fn(f32) -> bool),
                (body.time_to_disc_s(&disc, velocity), &|s| moved(s).touches_disc(&disc, 0.0)),
            ] {
                let stepped_s = (0..1600_u16).map(|k| f32::from(k) * 5e-3).find(|&s| touches(s));
                match stepped_s {
                    Some(stepped_s) => prop_assert!((time_s - stepped_s).abs() < 0.011, "{time_s} {stepped_s}"),
                    // Stepping can miss a graze.
                    None if time_s < 7.9 => prop_assert!(
                        (-20..=20_i16).any(|k| touches(time_s + 5e-4 * f32::from(k)))
                            || moved(time_s).distance_to_edge_m(&edge).min(moved(time_s).distance_to_disc_m(&disc)) < 1e-3,
                        "{time_s}"
                    ),
                    None => {}
                }
            }
        }
    }

    #[test]
    fn what_lies_wholly_inside_is_touched() {
        let footprint = Footprint::Rectangle { front_m: 0.6, rear_m: 0.4, half_width_m: 0.3 };
        let body = Body::new(footprint, Pose::new(1.0, 1.0, 0.7));
        let edge = Segment { a: Point::new(1.0, 1.0), b: Point::new(1.05, 1.0) };
        let disc = Disc { center: Point::new(1.1, 1.0), radius_m: 0.02 };
        assert!(body.touches_edge(&edge) && body.touches_disc(&disc, 0.0));
        assert!(body.distance_to_edge_m(&edge) < -0.2 && body.distance_to_disc_m(&disc) < -0.2);
        let velocity = Vector::new(1.0, 0.0);
        assert!(body.time_to_edge_s(&edge, velocity) <= 0.0 && body.time_to_disc_s(&disc, velocity) <= 0.0);
    }
}
