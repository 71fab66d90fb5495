//! One beam against one obstacle, exactly. The beam starts at the origin.

use nav_core::geometry::Vector;

/// Distance along the beam with unit direction `(x, y)` to a disc, m; `INFINITY` for a miss. A beam that
/// starts inside reports 0.
#[inline]
pub fn ray_disc_m(x: f32, y: f32, center: Vector, radius_m: f32) -> f32 {
    let along_m = x * center.x + y * center.y;
    let aside_m = x * center.y - y * center.x;
    let half_chord_m2 = radius_m * radius_m - aside_m * aside_m;
    let half_chord_m = half_chord_m2.max(0.0).sqrt();
    if half_chord_m2 >= 0.0 && along_m + half_chord_m >= 0.0 {
        (along_m - half_chord_m).max(0.0)
    } else {
        f32::INFINITY
    }
}

/// Distance along the beam with unit direction `(x, y)` to the segment from `a` to `b`, m; `INFINITY` for a
/// miss. Both ends count as part of the segment, so that no beam passes between two that share an end.
#[inline]
pub fn ray_segment_m(x: f32, y: f32, a: Vector, b: Vector) -> f32 {
    let (aside_a, aside_b) = (x * a.y - y * a.x, x * b.y - y * b.x);
    let (along_a, along_b) = (x * a.x + y * a.y, x * b.x + y * b.y);
    let spread = aside_a - aside_b;
    // A mean of the ends' distances along the beam stays between them, however thin the angle.
    let hit_m =
        if spread == 0.0 { along_a.min(along_b) } else { along_a + aside_a / spread * (along_b - along_a) };
    if aside_a * aside_b <= 0.0 && hit_m >= 0.0 { hit_m } else { f32::INFINITY }
}

/// Whether the whole segment lies farther than `range_m` from the origin.
#[inline]
pub(super) fn is_segment_beyond(a: Vector, b: Vector, range_m: f32) -> bool {
    let along = b - a;
    let (from_a, length2) = (-a.dot(&along), along.norm_squared());
    let range2 = range_m * range_m;
    if from_a <= 0.0 {
        a.norm_squared() > range2
    } else if from_a >= length2 {
        b.norm_squared() > range2
    } else {
        let cross = a.x * b.y - a.y * b.x;
        cross * cross > range2 * length2
    }
}
