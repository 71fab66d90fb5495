//! A scan as it was measured, at the lidar's own resolution, whatever its geometry.
//!
//! [`super::ScanReader`] makes the trained lidar's beams of it, which is what policies see; who looks for things that are
//! smaller than a trained beam looks here.

use super::ranges::meaning_m;
use crate::messages::{LaserScan, MAX_BEAMS};
use core::f32::consts::TAU;
use core::ops::Range;
use heapless::Vec;

/// Steps from beam to beam that make sense, rad.
pub(super) const INCREMENT_RAD: Range<f32> = 1e-4..7.0;
/// Headers begin within this, rad.
pub(super) const ANGLE_MIN_RAD: f32 = 100.0;

/// A measured beam, in the lidar's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beam {
    /// Direction.
    pub cos: f32,
    /// Direction.
    pub sin: f32,
    /// Where something is, m: 0 for too near to be measured, `INFINITY` for nothing within the lidar's range, NaN for
    /// nothing known.
    pub range_m: f32,
}

impl Beam {
    /// Whether it hit something whose place is known.
    pub fn is_hit(&self) -> bool {
        self.range_m > 0.0 && self.range_m < f32::INFINITY
    }
}

/// The beams of the newest scan, counter-clockwise. A scan that goes round more than once is cut where it repeats itself.
#[derive(Clone, Debug)]
pub struct Beams {
    beams: Vec<Beam, MAX_BEAMS>,
    /// Header of the scan that the directions were worked out for: first direction, increment, beams.
    layout: (u32, u32, u32),
    is_clockwise: bool,
    step_rad: f32,
    reach_m: f32,
    is_circle: bool,
}

impl Default for Beams {
    fn default() -> Self {
        Self::new()
    }
}

impl Beams {
    /// Before the first scan: no beams.
    pub fn new() -> Self {
        Self {
            beams: Vec::new(),
            layout: (0, 0, 0),
            is_clockwise: false,
            step_rad: 0.0,
            reach_m: 0.0,
            is_circle: false,
        }
    }

    /// Takes in a scan. From `no_return_m` on a range means that nothing was hit, m. A header that makes no sense leaves no
    /// beams.
    pub fn read(&mut self, scan: &LaserScan, no_return_m: f32) {
        self.lay_out(scan);
        self.reach_m = scan.range_max_m;
        let last = self.beams.len().saturating_sub(1);
        for (place, beam) in self.beams.iter_mut().enumerate() {
            let index = if self.is_clockwise { last - place } else { place };
            beam.range_m = meaning_m(scan, scan.ranges_m[index], no_return_m);
        }
    }

    /// Works out the directions, unless the last scan had the same layout.
    fn lay_out(&mut self, scan: &LaserScan) {
        let layout = (scan.angle_min_rad.to_bits(), scan.angle_increment_rad.to_bits(), scan.beam_count);
        if layout == self.layout {
            return;
        }
        self.layout = layout;
        self.beams.clear();
        self.is_clockwise = scan.angle_increment_rad < 0.0;
        self.step_rad = scan.angle_increment_rad.abs();
        self.is_circle = false;
        let measured = scan.ranges_m().len();
        let is_fine = scan.angle_min_rad.abs() < ANGLE_MIN_RAD && INCREMENT_RAD.contains(&self.step_rad);
        if !is_fine {
            return;
        }
        let around = (libm::roundf(TAU / self.step_rad) as usize).max(1);
        self.is_circle = measured >= around;
        let count = measured.min(around);
        for place in 0..count {
            let index = if self.is_clockwise { count - 1 - place } else { place };
            let angle_rad = scan.angle_min_rad + index as f32 * scan.angle_increment_rad;
            let (sin, cos) = libm::sincosf(angle_rad);
            // Capacity is MAX_BEAMS and so is the longest scan: pushing cannot fail.
            let _ = self.beams.push(Beam { cos, sin, range_m: f32::NAN });
        }
    }

    /// All of them, counter-clockwise.
    pub fn as_slice(&self) -> &[Beam] {
        &self.beams
    }

    /// Between neighbouring beams, rad.
    pub fn step_rad(&self) -> f32 {
        self.step_rad
    }

    /// How far the lidar sees, m: where nothing was hit it is free so far, and no farther.
    pub fn reach_m(&self) -> f32 {
        self.reach_m
    }

    /// Whether the last beam neighbours the first.
    pub fn is_circle(&self) -> bool {
        self.is_circle
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::task::Lidar;

    fn read(scan: &LaserScan) -> Beams {
        let mut beams = Beams::new();
        beams.read(scan, f32::INFINITY);
        beams
    }

    #[test]
    fn ranges_mean_what_the_table_says() {
        let lidar = Lidar { range_min_m: 0.2, ..Lidar::default() };
        let mut scan = LaserScan::of(&lidar, |_| 4.0);
        let written = [f32::INFINITY, 3.0, 0.1, 0.0, -1.0, f32::NEG_INFINITY, f32::NAN, 5.1, 4.5];
        scan.ranges_m[..written.len()].copy_from_slice(&written);
        let mut beams = Beams::new();
        beams.read(&scan, 4.5);
        let found = |beam: usize| beams.as_slice()[beam].range_m;
        let expected = [f32::INFINITY, 3.0, 0.1, 0.0, 0.0, 0.0, f32::NAN, f32::INFINITY, f32::INFINITY];
        for (beam, means_m) in expected.into_iter().enumerate() {
            let is_same = found(beam).to_bits() == means_m.to_bits() || (found(beam) - means_m).abs() < 1e-6;
            assert!(is_same, "beam {beam}: {} for {}", found(beam), written[beam]);
        }
        assert!(
            read(&scan).as_slice()[7].range_m.is_nan(),
            "a number above range_max without a code for nothing"
        );
    }

    #[test]
    fn they_lie_counter_clockwise_however_the_lidar_turns() {
        let mut scan =
            LaserScan::of(&Lidar { beam_count: 90, ..Lidar::default() }, |angle| 3.0 + angle / 4.0);
        let ahead = read(&scan);
        scan.ranges_m[..90].reverse();
        scan.angle_min_rad += 89.0 * scan.angle_increment_rad;
        scan.angle_increment_rad = -scan.angle_increment_rad;
        let upside_down = read(&scan);
        assert!(ahead.is_circle() && upside_down.is_circle());
        for (a, b) in ahead.as_slice().iter().zip(upside_down.as_slice()) {
            assert!((a.cos - b.cos).abs() < 1e-5 && (a.sin - b.sin).abs() < 1e-5);
            assert!((a.range_m - b.range_m).abs() < 1e-6);
        }
    }

    #[test]
    fn a_circle_is_told_from_an_arc_and_cut_where_it_repeats_itself() {
        let layout = |beams: u32, step_rad: f32| {
            let mut scan =
                LaserScan { angle_increment_rad: step_rad, beam_count: beams, ..LaserScan::default() };
            scan.ranges_m.fill(1.0);
            let beams = read(&scan);
            (beams.as_slice().len(), beams.is_circle())
        };
        assert_eq!(layout(360, TAU / 360.0), (360, true));
        assert_eq!(layout(360, TAU / 359.0), (359, true), "the last beam looks where the first did");
        assert_eq!(layout(720, TAU / 360.0), (360, true));
        assert_eq!(layout(270, TAU / 360.0), (270, false));
        for nonsense in [0.0, 1e-9, 8.0, f32::NAN, f32::INFINITY] {
            assert_eq!(layout(360, nonsense), (0, false));
        }
        assert_eq!(layout(5000, 1e-3).0, MAX_BEAMS);
    }

    #[test]
    fn the_directions_follow_a_new_layout() {
        let mut beams = Beams::new();
        for beam_count in [72, 360, 72] {
            let lidar = Lidar { beam_count, ..Lidar::default() };
            beams.read(&LaserScan::of(&lidar, |_| 1.0), f32::INFINITY);
            assert_eq!(beams.as_slice().len(), beam_count as usize);
            assert!((beams.step_rad() - TAU / beam_count as f32).abs() < 1e-6);
            for (beam, seen) in beams.as_slice().iter().enumerate() {
                let angle_rad = lidar.beam_angle_rad(beam);
                assert!((seen.cos - libm::cosf(angle_rad)).abs() < 1e-6);
                assert!((seen.sin - libm::sinf(angle_rad)).abs() < 1e-6);
            }
        }
    }
}
