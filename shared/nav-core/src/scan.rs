//! What the controller keeps of a scan: cleaned ranges, beam directions, sectors and corridors.
//!
//! Everything is in the robot frame and of the trained lidar's beams, which [`ScanReader`] makes of any lidar's scan;
//! [`beams`] keeps a scan as it was measured.
//! A miss counts as `range_max_m`. A sector in which nothing is known shows the policy its nearer neighbour's value, but
//! nothing is free there: no corridor leads that way, and the controller does not drive that way.

mod ranges;
pub mod beams;
mod misfit;
mod reader;
mod recall;

pub use self::misfit::Misfit;
pub use self::reader::ScanReader;

use crate::geometry::{Point, wrap_angle};
use crate::messages::MAX_BEAMS;
use crate::task::Task;
use core::f32::consts::{PI, TAU};
use heapless::Vec;

/// Sectors of the low-level observation, over the full circle, counter-clockwise from straight back (-π).
pub const SECTOR_COUNT: usize = 36;
/// Sectors whose middles lie this far to either side of straight ahead must be seen, and not touched, for the robot to
/// drive forward, rad: 50 degrees. The same to either side of straight back for it to drive backwards.
const AHEAD_RAD: f32 = 0.873;

/// A beam that hit something.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Where, in the robot frame, m.
    pub point: Point,
    /// From the robot's centre, m.
    pub range_m: f32,
}

/// The geometry of the beams, worked out once.
#[derive(Clone, Debug)]
pub struct ScanGeometry {
    beam_count: usize,
    range_max_m: f32,
    robot_radius_m: f32,
    /// Unit vectors of the beams.
    directions: [(f32, f32); MAX_BEAMS],
    sector_of_beam: [u8; MAX_BEAMS],
    /// Sectors that no beam looks into (field of view below a full circle, or fewer beams than sectors): they
    /// count as free in training as on the robot.
    unseen: [bool; SECTOR_COUNT],
    /// A sector behind the robot lies outside of the field of view, so that nothing is ever known there.
    is_blind_behind: bool,
    /// Unit vectors of the sectors' middles.
    sector_directions: [(f32, f32); SECTOR_COUNT],
}

impl ScanGeometry {
    /// The geometry that `task` was trained on.
    pub fn new(task: &Task) -> Self {
        let lidar = &task.lidar;
        let mut geometry = Self {
            beam_count: (lidar.beam_count as usize).min(MAX_BEAMS),
            range_max_m: lidar.range_max_m,
            robot_radius_m: task.robot.radius_m,
            directions: [(0.0, 0.0); MAX_BEAMS],
            sector_of_beam: [0; MAX_BEAMS],
            unseen: [true; SECTOR_COUNT],
            is_blind_behind: false,
            sector_directions: [(0.0, 0.0); SECTOR_COUNT],
        };
        for (sector, direction) in geometry.sector_directions.iter_mut().enumerate() {
            let (sin, cos) = libm::sincosf(sector_angle_rad(sector));
            *direction = (cos, sin);
            let is_outside = sector_angle_rad(sector).abs() > 0.5 * lidar.field_of_view_rad;
            geometry.is_blind_behind |= is_outside && is_behind(sector);
        }
        for beam in 0..geometry.beam_count {
            let angle = lidar.beam_angle_rad(beam);
            geometry.directions[beam] = (libm::cosf(angle), libm::sinf(angle));
            let sector = sector_of(angle);
            geometry.sector_of_beam[beam] = sector as u8;
            geometry.unseen[sector] = false;
        }
        geometry
    }

    /// Unit vectors (cos, sin) of the sectors' middles in the robot frame.
    pub fn sector_directions(&self) -> &[(f32, f32); SECTOR_COUNT] {
        &self.sector_directions
    }

    /// The longest range that counts, m.
    pub fn range_max_m(&self) -> f32 {
        self.range_max_m
    }
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
    /// Middles of the sectors in which nothing is known, two radii from the robot's centre.
    veiled: Vec<Point, SECTOR_COUNT>,
    is_closed_ahead: bool,
    is_closed_behind: bool,
    /// How far the lidar that measured can see, m, at most `range_max_m`.
    reach_m: f32,
    hits: Vec<Hit, MAX_BEAMS>,
    /// Direction (robot frame, unit vector) and free length (m) of every valid beam.
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
            rays: Vec::new(),
        }
    }

    /// Digests the trained lidar's beams, m: `INFINITY` for nothing within the `reach_m` of the lidar that measured,
    /// NaN where nothing is known.
    pub fn update(&mut self, geometry: &ScanGeometry, beams_m: &[f32], reach_m: f32) {
        let mut nearest = [f32::INFINITY; SECTOR_COUNT];
        self.reach_m = reach_m.min(geometry.range_max_m);
        self.hits.clear();
        self.rays.clear();
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
                let veil_m = 2.0 * geometry.robot_radius_m;
                let _ = self.veiled.push(Point::new(veil_m * cos, veil_m * sin));
                let left = nearest[(sector + 1) % SECTOR_COUNT];
                let right = nearest[(sector + SECTOR_COUNT - 1) % SECTOR_COUNT];
                let nearer = left.min(right);
                if nearer.is_finite() { nearer } else { 0.0 }
            };
            let touches = self.sectors_m[sector] <= geometry.robot_radius_m;
            let is_veiled = !is_known && !geometry.unseen[sector];
            let is_closed = touches || is_veiled;
            self.is_closed_ahead |= is_closed && is_ahead(sector);
            self.is_closed_behind |= is_closed && is_behind(sector);
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

    /// Every valid beam: unit direction (cos, sin) and free length, m.
    pub fn rays(&self) -> &[(f32, f32, f32)] {
        &self.rays
    }

    /// Distance to the nearest hit from the robot's centre, m; infinite when nothing was hit.
    pub fn nearest_m(&self) -> f32 {
        self.hits.iter().fold(f32::INFINITY, |nearest, hit| nearest.min(hit.range_m))
    }

    /// How far a disc of `half_width_m` can go straight in direction (`cos`, `sin`) of the robot frame before
    /// it touches a hit, m, at most `limit_m`. Hits that it already touches count only when ahead. Where nothing is known,
    /// nothing is free.
    pub fn corridor_m(&self, cos: f32, sin: f32, half_width_m: f32, limit_m: f32) -> f32 {
        let width_squared = half_width_m * half_width_m;
        let mut free_m = limit_m;
        for point in &self.veiled {
            let along = point.x * cos + point.y * sin;
            if along > 0.0 && (point.y * cos - point.x * sin).abs() < half_width_m {
                return 0.0;
            }
        }
        for hit in &self.hits {
            let along = hit.point.x * cos + hit.point.y * sin;
            let lateral = hit.point.y * cos - hit.point.x * sin;
            let rest = width_squared - lateral * lateral;
            if along > 0.0 && rest > 0.0 && along - half_width_m < free_m {
                free_m = free_m.min((along - libm::sqrtf(rest)).max(0.0));
            }
        }
        free_m
    }
}

#[cfg(test)]
mod tests;
