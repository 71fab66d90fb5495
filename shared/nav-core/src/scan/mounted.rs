//! The beams of a lidar that does not sit in the middle of the robot, as seen from there.
//!
//! A hit is where it is, and lies in the sector in which the robot's centre sees it. Neighbouring beams may so leave
//! sectors between them: what was seen reaches there as far as the line between their ends, and no farther is known. What
//! lies outside of the field of view is known nowhere, as ever.

use super::{Hit, SECTOR_COUNT, ScanGeometry, ScanView, sector_angle_rad, sector_of};
use crate::geometry::{Point, Pose, Vector, wrap_angle};

/// Between ends of neighbouring beams that are farther apart, seen from the robot's centre, the centre itself lies, rad.
const APART_MAX_RAD: f32 = 3.0;

/// The end of a beam, robot frame.
#[derive(Clone, Copy)]
struct End {
    at: Point,
    /// Its direction, rad.
    bearing_rad: f32,
    is_hit: bool,
}

impl End {
    fn of(geometry: &ScanGeometry, beam: usize, range_m: f32) -> Self {
        let (cos, sin) = geometry.directions[beam];
        let free_m = range_m.min(geometry.range_max_m);
        let at = geometry.mount.position() + Vector::new(free_m * cos, free_m * sin);
        Self { at, bearing_rad: libm::atan2f(at.y, at.x), is_hit: range_m < geometry.range_max_m }
    }
}

impl ScanView {
    /// Takes in the beams; the nearest range in each sector, infinite where nothing is known, m.
    pub(super) fn take_mounted(&mut self, geometry: &ScanGeometry, beams_m: &[f32]) -> [f32; SECTOR_COUNT] {
        let mut nearest = [f32::INFINITY; SECTOR_COUNT];
        let mut between = [f32::INFINITY; SECTOR_COUNT];
        let beams_m = &beams_m[..beams_m.len().min(geometry.beam_count)];
        let mut last = match beams_m.last() {
            Some(&range_m) if geometry.is_circle && !range_m.is_nan() => {
                Some(End::of(geometry, beams_m.len() - 1, range_m))
            }
            _ => None,
        };
        for (beam, &range_m) in beams_m.iter().enumerate() {
            if range_m.is_nan() {
                last = None;
                continue;
            }
            let end = End::of(geometry, beam, range_m);
            let (cos, sin) = geometry.directions[beam];
            let away_m = end.at.coords.norm();
            // Capacity is MAX_BEAMS and so is the longest scan: pushing cannot fail.
            let _ = self.rays.push((cos, sin, range_m.min(geometry.range_max_m).min(self.reach_m)));
            if end.is_hit {
                let _ = self.hits.push(Hit { point: end.at, range_m: away_m });
            }
            let sector = sector_of(end.bearing_rad);
            let known_m = if end.is_hit { away_m.min(geometry.range_max_m) } else { geometry.range_max_m };
            nearest[sector] = nearest[sector].min(known_m);
            if let Some(last) = last {
                join(geometry, &last, &end, &mut between);
            }
            last = Some(end);
        }
        for (nearest, between) in nearest.iter_mut().zip(between) {
            if nearest.is_infinite() {
                *nearest = between;
            }
        }
        nearest
    }
}

/// Notes how far was seen in the sectors between the ends of two neighbouring beams.
fn join(geometry: &ScanGeometry, a: &End, b: &End, between: &mut [f32; SECTOR_COUNT]) {
    let turn_rad = wrap_angle(b.bearing_rad - a.bearing_rad);
    if turn_rad.abs() > APART_MAX_RAD {
        return;
    }
    let along = b.at - a.at;
    let (last, step) = (sector_of(b.bearing_rad), if turn_rad < 0.0 { SECTOR_COUNT - 1 } else { 1 });
    let mut sector = sector_of(a.bearing_rad);
    while sector != last {
        sector = (sector + step) % SECTOR_COUNT;
        let (cos, sin) = geometry.sector_directions[sector];
        let seen_m = if a.is_hit || b.is_hit {
            a.at.coords.perp(&along) / Vector::new(cos, sin).perp(&along)
        } else {
            geometry.range_max_m
        };
        if seen_m > 0.0 {
            between[sector] = between[sector].min(seen_m.min(geometry.range_max_m));
        }
    }
}

/// The sectors that no beam looks into, however free the way.
pub(super) fn unseen(geometry: &ScanGeometry) -> [bool; SECTOR_COUNT] {
    let mut unseen = [true; SECTOR_COUNT];
    let mut between = [f32::INFINITY; SECTOR_COUNT];
    let end = |beam: usize| End::of(geometry, beam, f32::INFINITY);
    let mut last = (geometry.is_circle && geometry.beam_count > 0).then(|| end(geometry.beam_count - 1));
    for beam in 0..geometry.beam_count {
        let end = end(beam);
        unseen[sector_of(end.bearing_rad)] = false;
        if let Some(last) = last {
            join(geometry, &last, &end, &mut between);
        }
        last = Some(end);
    }
    for (unseen, between) in unseen.iter_mut().zip(between) {
        *unseen &= between.is_infinite();
    }
    unseen
}

/// How far off the lidar's axis the middle of a sector lies, seen by the lidar, `near_m` from the robot's centre, rad.
pub(super) fn off_axis_rad(mount: &Pose, sector: usize, near_m: f32) -> f32 {
    if *mount == Pose::default() {
        return sector_angle_rad(sector).abs();
    }
    let (sin, cos) = libm::sincosf(sector_angle_rad(sector));
    let seen = mount.local_from_parent(Point::new(near_m * cos, near_m * sin));
    libm::atan2f(seen.y, seen.x).abs()
}
