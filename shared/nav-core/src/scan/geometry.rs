//! What a lidar on a robot looks at: beams, sectors, and what of them is in the way. Worked out once.

use super::{SECTOR_COUNT, VEIL_RADII, is_ahead, is_behind, mounted, sector_angle_rad, sector_of};
use crate::footprint::Footprint;
use crate::geometry::Pose;
use crate::messages::MAX_BEAMS;
use crate::task::Task;
use core::f32::consts::{PI, TAU};

/// Width of a sector, rad.
const SECTOR_RAD: f32 = TAU / SECTOR_COUNT as f32;

/// The geometry of the beams, worked out once.
#[derive(Clone, Debug)]
pub struct ScanGeometry {
    pub(super) beam_count: usize,
    pub(super) range_max_m: f32,
    pub(super) footprint: Footprint,
    /// From the robot's centre to its outline in the middle of each sector, m.
    pub(super) reach_m: [f32; SECTOR_COUNT],
    /// Sectors in which what touches the robot is in the way forward, and backwards.
    pub(super) in_the_way: [(bool, bool); SECTOR_COUNT],
    /// Where the lidar sits.
    pub(super) mount: Pose,
    /// Whether its last beam neighbours the first.
    pub(super) is_circle: bool,
    /// Unit vectors of the beams.
    pub(super) directions: [(f32, f32); MAX_BEAMS],
    pub(super) sector_of_beam: [u8; MAX_BEAMS],
    /// Sectors that no beam looks into (field of view below a full circle, or fewer beams than sectors): they
    /// count as free in training as on the robot.
    pub(super) unseen: [bool; SECTOR_COUNT],
    /// A sector behind the robot lies outside of the field of view, so that nothing is ever known there.
    pub(super) is_blind_behind: bool,
    /// Unit vectors of the sectors' middles.
    pub(super) sector_directions: [(f32, f32); SECTOR_COUNT],
}

impl ScanGeometry {
    /// The geometry that `task` was trained on.
    pub fn new(task: &Task) -> Self {
        let lidar = &task.lidar;
        let mut geometry = Self {
            beam_count: (lidar.beam_count as usize).min(MAX_BEAMS),
            range_max_m: lidar.range_max_m,
            footprint: task.robot.footprint,
            reach_m: [0.0; SECTOR_COUNT],
            in_the_way: [(false, false); SECTOR_COUNT],
            mount: lidar.mount,
            is_circle: lidar.is_full_circle(),
            directions: [(0.0, 0.0); MAX_BEAMS],
            sector_of_beam: [0; MAX_BEAMS],
            unseen: [true; SECTOR_COUNT],
            is_blind_behind: false,
            sector_directions: [(0.0, 0.0); SECTOR_COUNT],
        };
        for (sector, direction) in geometry.sector_directions.iter_mut().enumerate() {
            let (sin, cos) = libm::sincosf(sector_angle_rad(sector));
            *direction = (cos, sin);
            geometry.reach_m[sector] = task.robot.footprint.reach_m(cos, sin);
            geometry.in_the_way[sector] = in_the_way(&task.robot.footprint, sector);
            let near_m = VEIL_RADII * task.robot.footprint.circumradius_m();
            let off_rad = mounted::off_axis_rad(&lidar.mount, sector, near_m);
            geometry.is_blind_behind |= off_rad > 0.5 * lidar.field_of_view_rad && is_behind(sector);
        }
        for beam in 0..geometry.beam_count {
            let angle = lidar.beam_angle_rad(beam) + lidar.mount.yaw_rad;
            geometry.directions[beam] = (libm::cosf(angle), libm::sinf(angle));
            let sector = sector_of(angle);
            geometry.sector_of_beam[beam] = sector as u8;
            geometry.unseen[sector] = false;
        }
        if !geometry.is_centred() {
            geometry.unseen = mounted::unseen(&geometry);
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

    /// From the robot's centre to its outline in the middle of each sector, m.
    pub fn reach_m(&self) -> &[f32; SECTOR_COUNT] {
        &self.reach_m
    }

    /// The largest clearance that can be seen, m.
    pub fn clearance_max_m(&self) -> f32 {
        self.range_max_m - self.reach_m.iter().fold(f32::INFINITY, |least: f32, &reach_m| least.min(reach_m))
    }

    /// Whether the lidar sits in the middle of the robot and looks ahead.
    pub(super) fn is_centred(&self) -> bool {
        self.mount == Pose::default()
    }
}

/// Whether what touches a footprint in a sector is in its way forward, and backwards. The sides of a rectangle slide along.
fn in_the_way(footprint: &Footprint, sector: usize) -> (bool, bool) {
    let Footprint::Rectangle { front_m, rear_m, half_width_m } = *footprint else {
        return (is_ahead(sector), is_behind(sector));
    };
    // Also where it is only a part of the sector.
    let off_rad = (sector_angle_rad(sector).abs() - 0.5 * SECTOR_RAD).max(0.0);
    let from_rear_rad = (PI - sector_angle_rad(sector).abs() - 0.5 * SECTOR_RAD).max(0.0);
    let corner_rad = |end_m: f32| libm::atan2f(half_width_m, end_m);
    (off_rad < corner_rad(front_m), from_rear_rad < corner_rad(rear_m))
}
