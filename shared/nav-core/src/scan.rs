//! What the controller keeps of a scan: cleaned ranges, beam directions, sectors and corridors.
//!
//! Everything is in the robot frame, wherever the lidar sits (`mounted.rs`), and of the trained lidar's beams, which
//! [`ScanReader`] makes of any lidar's scan;
//! [`beams`] keeps a scan as it was measured.
//! A miss counts as `range_max_m`. A sector in which nothing is known shows the policy its nearer neighbour's value, but
//! nothing is free there: no corridor leads that way, and the controller does not drive that way.

mod ranges;
mod geometry;
pub mod beams;
mod misfit;
mod reader;
mod recall;
mod mounted;

pub use self::geometry::ScanGeometry;
pub use self::misfit::Misfit;
pub use self::reader::ScanReader;

use crate::footprint::{Footprint, Lane, Turns};
use crate::geometry::{Point, wrap_angle};
use crate::messages::MAX_BEAMS;
use core::f32::consts::{PI, TAU};
use heapless::Vec;

/// Sectors of the low-level observation, over the full circle, counter-clockwise from straight back (-π).
pub const SECTOR_COUNT: usize = 36;
/// Sectors whose middles lie this far to either side of straight ahead must be seen, and not touched, for the robot to
/// drive forward, rad: 50 degrees. The same to either side of straight back for it to drive backwards.
const AHEAD_RAD: f32 = 0.873;
/// Where nothing is known, something stands so many radii of the circle that the robot turns in away.
const VEIL_RADII: f32 = 2.0;

/// A beam that hit something.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Where, in the robot frame, m.
    pub point: Point,
    /// From the robot's centre, m.
    pub range_m: f32,
}

/// Sector of a direction in the robot frame.
fn sector_of(angle_rad: f32) -> usize {
    let turn = (wrap_angle(angle_rad) + PI) / TAU;
    // A direction on the border, as every other one of 72 beams, belongs to the sector that begins there,
    // whatever the rounding.
    ((turn * SECTOR_COUNT as f32 + 1e-3) as usize) % SECTOR_COUNT
}

/// Direction of the middle of a sector in the robot frame, rad.
pub fn sector_angle_rad(sector: usize) -> f32 {
    (sector as f32 + 0.5) * (TAU / SECTOR_COUNT as f32) - PI
}

fn is_ahead(sector: usize) -> bool {
    sector_angle_rad(sector).abs() < AHEAD_RAD
}

fn is_behind(sector: usize) -> bool {
    sector_angle_rad(sector).abs() > PI - AHEAD_RAD
}

/// The newest scan, digested.
#[derive(Clone, Debug)]
pub struct ScanView {
    /// Nearest range in each sector, m, at most `range_max_m`.
    sectors_m: [f32; SECTOR_COUNT],
    /// Middles of the sectors in which nothing is known, [`VEIL_RADII`] from the robot's centre.
    veiled: Vec<Point, SECTOR_COUNT>,
    is_closed_ahead: bool,
    is_closed_behind: bool,
    /// How far the lidar that measured can see, m, at most `range_max_m`.
    reach_m: f32,
    hits: Vec<Hit, MAX_BEAMS>,
    /// Where the lidar sits, robot frame, m.
    origin: Point,
    /// Direction (robot frame, unit vector) and free length (m) of every valid beam, from where the lidar sits.
    rays: Vec<(f32, f32, f32), MAX_BEAMS>,
}

impl ScanView {
    /// Before the first scan: nothing seen, everything free.
    pub fn new(geometry: &ScanGeometry) -> Self {
        Self {
            sectors_m: [geometry.range_max_m; SECTOR_COUNT],
            veiled: Vec::new(),
            is_closed_ahead: false,
            is_closed_behind: geometry.is_blind_behind,
            reach_m: geometry.range_max_m,
            hits: Vec::new(),
            origin: geometry.mount.position(),
            rays: Vec::new(),
        }
    }

    /// Digests the trained lidar's beams, m: `INFINITY` for nothing within the `reach_m` of the lidar that measured,
    /// NaN where nothing is known.
    pub fn update(&mut self, geometry: &ScanGeometry, beams_m: &[f32], reach_m: f32) {
        self.reach_m = reach_m.min(geometry.range_max_m);
        self.hits.clear();
        self.rays.clear();
        let nearest = if geometry.is_centred() {
            self.take(geometry, beams_m)
        } else {
            self.take_mounted(geometry, beams_m)
        };
        self.judge(geometry, &nearest);
    }

    /// The beams of a lidar in the middle; the nearest range in each sector, infinite where nothing is known, m.
    fn take(&mut self, geometry: &ScanGeometry, beams_m: &[f32]) -> [f32; SECTOR_COUNT] {
        let mut nearest = [f32::INFINITY; SECTOR_COUNT];
        for (beam, &range_m) in beams_m.iter().take(geometry.beam_count).enumerate() {
            if range_m.is_nan() {
                continue;
            }
            let (cos, sin) = geometry.directions[beam];
            let free_m = range_m.min(geometry.range_max_m);
            let sector = usize::from(geometry.sector_of_beam[beam]);
            nearest[sector] = nearest[sector].min(free_m);
            // Capacity is MAX_BEAMS and so is the longest scan: pushing cannot fail.
            let _ = self.rays.push((cos, sin, free_m.min(self.reach_m)));
            if range_m < geometry.range_max_m {
                let _ =
                    self.hits.push(Hit { point: Point::new(free_m * cos, free_m * sin), range_m: free_m });
            }
        }
        nearest
    }

    /// What is known in each sector, and where that leaves the robot.
    fn judge(&mut self, geometry: &ScanGeometry, nearest: &[f32; SECTOR_COUNT]) {
        self.veiled.clear();
        self.is_closed_ahead = false;
        self.is_closed_behind = geometry.is_blind_behind;
        for sector in 0..SECTOR_COUNT {
            let is_known = nearest[sector].is_finite();
            self.sectors_m[sector] = if is_known {
                nearest[sector]
            } else if geometry.unseen[sector] {
                geometry.range_max_m
            } else {
                let (cos, sin) = geometry.sector_directions[sector];
                let veil_m = VEIL_RADII * geometry.footprint.circumradius_m();
                let _ = self.veiled.push(Point::new(veil_m * cos, veil_m * sin));
                let left = nearest[(sector + 1) % SECTOR_COUNT];
                let right = nearest[(sector + SECTOR_COUNT - 1) % SECTOR_COUNT];
                let nearer = left.min(right);
                if nearer.is_finite() { nearer } else { 0.0 }
            };
            let touches = self.sectors_m[sector] <= geometry.reach_m[sector];
            let is_veiled = !is_known && !geometry.unseen[sector];
            let (ahead, behind) = geometry.in_the_way[sector];
            self.is_closed_ahead |= touches && ahead || is_veiled && (ahead || is_ahead(sector));
            self.is_closed_behind |= touches && behind || is_veiled && (behind || is_behind(sector));
        }
    }

    /// How far the lidar that measured can see, m, at most the trained one's range.
    pub fn reach_m(&self) -> f32 {
        self.reach_m
    }

    /// Whether driving forward could touch what is too near, or leads to where nothing is known.
    pub fn is_closed_ahead(&self) -> bool {
        self.is_closed_ahead
    }

    /// As [`Self::is_closed_ahead`], of driving backwards; also where the lidar does not look behind the robot.
    pub fn is_closed_behind(&self) -> bool {
        self.is_closed_behind
    }

    /// Nearest range in each sector, m.
    pub fn sectors_m(&self) -> &[f32; SECTOR_COUNT] {
        &self.sectors_m
    }

    /// What was hit.
    pub fn hits(&self) -> &[Hit] {
        &self.hits
    }

    /// Where the lidar sits, robot frame, m: where rays begin.
    pub fn origin(&self) -> Point {
        self.origin
    }

    /// Every valid beam: unit direction (cos, sin) and free length, m.
    pub fn rays(&self) -> &[(f32, f32, f32)] {
        &self.rays
    }

    /// Distance to the nearest hit from the robot's centre, m; infinite when nothing was hit.
    pub fn nearest_m(&self) -> f32 {
        self.hits.iter().fold(f32::INFINITY, |nearest, hit| nearest.min(hit.range_m))
    }

    /// How far what sweeps a lane can go straight in direction (`cos`, `sin`) of the robot frame, turned that way, before it
    /// touches a hit, m, at most `limit_m`. Hits that it already touches count only when ahead. Where nothing is known,
    /// nothing is free.
    pub fn corridor_m(&self, cos: f32, sin: f32, lane: &Lane, limit_m: f32) -> f32 {
        let mut free_m = limit_m;
        for point in &self.veiled {
            let along = point.x * cos + point.y * sin;
            if along > 0.0 && lane.holds(point.y * cos - point.x * sin) {
                return 0.0;
            }
        }
        for hit in &self.hits {
            let along = hit.point.x * cos + hit.point.y * sin;
            let lateral = hit.point.y * cos - hit.point.x * sin;
            if let Some(before_m) = lane.free_before(along, lateral, free_m) {
                free_m = free_m.min(before_m);
            }
        }
        free_m
    }

    /// How far a footprint can turn on the spot before it touches a hit.
    pub fn turns(&self, footprint: &Footprint) -> Turns {
        Turns::between(footprint, self.hits.iter().map(|hit| hit.point))
    }
}

#[cfg(test)]
mod tests;
