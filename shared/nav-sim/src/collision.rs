//! Distances and times to collision between discs, segments and polygons.

use crate::world::Segment;
use nav_core::geometry::{Point, Vector};

/// How far ahead [`time_to_disc_s`] and [`time_to_segment_s`] look, s.
pub const HORIZON_S: f32 = 10.0;

/// The point of a segment that is nearest to `point`, m.
pub fn closest_on_segment(point: Point, segment: &Segment) -> Point {
    let along = segment.b - segment.a;
    let length2 = along.norm_squared();
    let share = if length2 > 0.0 { ((point - segment.a).dot(&along) / length2).clamp(0.0, 1.0) } else { 0.0 };
    segment.a + along * share
}

/// Whether a point lies inside a simple polygon, by the parity of crossings; either winding.
pub fn is_inside(point: Point, vertices: &[Point]) -> bool {
    let mut inside = false;
    for (index, a) in vertices.iter().enumerate() {
        let b = vertices[(index + 1) % vertices.len()];
        if (a.y > point.y) != (b.y > point.y) {
            let crossing_x = a.x + (point.y - a.y) / (b.y - a.y) * (b.x - a.x);
            inside ^= point.x < crossing_x;
        }
    }
    inside
}

/// Time until a point at the origin that moves with `velocity` comes within `radius_m` of `center`, s.
/// 0 when it is there already, `INFINITY` when that does not happen within [`HORIZON_S`].
pub fn time_to_disc_s(center: Vector, radius_m: f32, velocity: Vector) -> f32 {
    let gap_m2 = center.norm_squared() - radius_m * radius_m;
    if gap_m2 <= 0.0 {
        return 0.0;
    }
    let closing = center.dot(&velocity);
    let speed2 = velocity.norm_squared();
    let discriminant = closing * closing - speed2 * gap_m2;
    if closing <= 0.0 || discriminant < 0.0 {
        return f32::INFINITY;
    }
    // The smaller root, in the form that does not cancel.
    within_horizon(gap_m2 / (closing + discriminant.sqrt()))
}

/// Time until a point at the origin that moves with `velocity` comes within `radius_m` of the segment from
/// `a` to `b`, s. 0 when it is there already, `INFINITY` when that does not happen within [`HORIZON_S`].
pub fn time_to_segment_s(a: Vector, b: Vector, radius_m: f32, velocity: Vector) -> f32 {
    let ends_s = time_to_disc_s(a, radius_m, velocity).min(time_to_disc_s(b, radius_m, velocity));
    let along = b - a;
    let length2 = along.norm_squared();
    if length2 <= 0.0 {
        return ends_s;
    }
    // Signed distance to the line, positive on the origin's side.
    let normal = Vector::new(-along.y, along.x) / length2.sqrt();
    let offset_m = -a.dot(&normal);
    let (distance_m, leaving_mps) =
        if offset_m < 0.0 { (-offset_m, -velocity.dot(&normal)) } else { (offset_m, velocity.dot(&normal)) };
    let side_s = if distance_m <= radius_m {
        0.0
    } else if leaving_mps < 0.0 {
        (distance_m - radius_m) / -leaving_mps
    } else {
        return ends_s;
    };
    let share = (velocity * side_s - a).dot(&along);
    if (0.0..=length2).contains(&share) { within_horizon(side_s).min(ends_s) } else { ends_s }
}

fn within_horizon(time_s: f32) -> f32 {
    if time_s <= HORIZON_S { time_s } else { f32::INFINITY }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn coordinate() -> impl Strategy<Value = f32> {
        -5.0..5.0_f32
    }

    /// Steps along the path in small steps until it is within the radius.
    fn stepped(distance_m: impl Fn(Vector) -> f32, radius_m: f32, velocity: Vector) -> Option<f32> {
        (0..4000_u16).map(|k| f32::from(k) * 2.5e-3).find(|&t| distance_m(velocity * t) <= radius_m)
    }

    proptest! {
        #[test]
        fn time_to_a_segment_agrees_with_stepping(
            (ax, ay, bx, by) in (coordinate(), coordinate(), coordinate(), coordinate()),
            (vx, vy) in (-2.0..2.0_f32, -2.0..2.0_f32),
            radius_m in 0.1..0.6_f32,
        ) {
            let (a, b, velocity) = (Vector::new(ax, ay), Vector::new(bx, by), Vector::new(vx, vy));
            let segment = Segment { a: a.into(), b: b.into() };
            let distance_m = |p: Vector| (Point::from(p) - closest_on_segment(p.into(), &segment)).norm();
            let fast_s = time_to_segment_s(a, b, radius_m, velocity);
            match stepped(distance_m, radius_m, velocity) {
                Some(slow_s) => prop_assert!((fast_s - slow_s).abs() < 5e-3, "{fast_s} {slow_s}"),
                // Stepping can miss a graze; the path then must come very close.
                None if fast_s.is_finite() => {
                    prop_assert!(distance_m(velocity * fast_s) < radius_m + 1e-3, "{fast_s}");
                }
                None => {}
            }
        }

        #[test]
        fn time_to_a_disc_ends_at_its_edge(
            (x, y) in (coordinate(), coordinate()),
            (vx, vy) in (-2.0..2.0_f32, -2.0..2.0_f32),
            radius_m in 0.1..0.6_f32,
        ) {
            let (center, velocity) = (Vector::new(x, y), Vector::new(vx, vy));
            let fast_s = time_to_disc_s(center, radius_m, velocity);
            if fast_s.is_finite() && fast_s > 0.0 {
                prop_assert!(((center - velocity * fast_s).norm() - radius_m).abs() < 2e-3);
            }
            if let Some(slow_s) = stepped(|p| (center - p).norm(), radius_m, velocity) {
                prop_assert!((fast_s - slow_s).abs() < 5e-3, "{fast_s} {slow_s}");
            }
        }
    }

    #[test]
    fn inside_holds_for_either_winding_and_concave_shapes() {
        let mut vertices: Vec<Point> = [(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (2.0, 1.0), (0.0, 4.0)]
            .map(|(x, y)| Point::new(x, y))
            .to_vec();
        for _ in 0..2 {
            assert!(is_inside(Point::new(0.5, 1.0), &vertices));
            assert!(is_inside(Point::new(3.8, 3.0), &vertices));
            assert!(!is_inside(Point::new(2.0, 3.0), &vertices), "in the notch");
            assert!(!is_inside(Point::new(5.0, 1.0), &vertices));
            vertices.reverse();
        }
    }
}
