//! What a lidar sees that does not move, averaged: where a rectangle stands between things, the noise of single scans would
//! make it believe that it touches them.

use crate::footprint::Footprint;
use crate::geometry::{Point, Pose, wrap_angle};
use crate::messages::MAX_BEAMS;
use crate::scan::beams::Beams;
use core::f32::consts::TAU;

/// The robot stands as long as it is no farther from where it began to than this, m and rad.
const STANDS: (f32, f32) = (0.002, 0.005);
/// A range that differs from the mean by more is of something else, m: over three standard deviations of a usual lidar's noise.
const APART_M: f32 = 0.1;
/// What seems to be too near to be measured, and mostly was not, is taken to be so much nearer than the nearest that can be, m...
const NEARER_M: f32 = 0.03;
/// ...and what is nearer by this share of it in the mean mostly was.
const MOSTLY: f32 = 0.7;
/// A mean of so many scans is better than what was seen on the way.
const SETTLED: u16 = 5;
/// The mean follows the newest ranges at least so fast.
const SCANS_MAX: u16 = 50;

/// The means of the beams since the robot stands; for a disc, which can turn away from everything, single scans.
#[derive(Clone, Debug)]
pub(super) struct Steady {
    is_used: bool,
    since: Option<Pose>,
    stamp_ns: u64,
    means: Beams,
    scans: [u16; MAX_BEAMS],
}

impl Steady {
    /// Before the first scan.
    pub(super) fn new(footprint: &Footprint) -> Self {
        let is_used = footprint.corners().is_some();
        Self { is_used, since: None, stamp_ns: 0, means: Beams::new(), scans: [0; MAX_BEAMS] }
    }

    /// Takes in the beams of a scan that was taken with the robot at `pose`. What is nearer than `range_min_m` cannot be
    /// measured: something that is just so far away now and then seems to be nearer. The same stamp again changes nothing:
    /// a scan that is looked at twice is not two.
    pub(super) fn see(&mut self, beams: &Beams, pose: Pose, stamp_ns: u64, range_min_m: f32) {
        let is_same = self.since.is_some() && stamp_ns == self.stamp_ns;
        if !self.is_used || is_same {
            return;
        }
        self.stamp_ns = stamp_ns;
        let stands = self.since.is_some_and(|since| {
            (pose.position() - since.position()).norm() <= STANDS.0
                && wrap_angle(pose.yaw_rad - since.yaw_rad).abs() <= STANDS.1
        });
        if !stands || !self.means.is_laid_out_as(beams) {
            self.since = Some(pose);
            self.means.clone_from(beams);
            self.scans.fill(1);
            return;
        }
        for ((mean, beam), scans) in
            self.means.as_mut_slice().iter_mut().zip(beams.as_slice()).zip(&mut self.scans)
        {
            if beam.range_m.is_nan() && *scans > 1 {
                // A measurement that fails says nothing, for as many scans as there were good ones.
                *scans -= 1;
                continue;
            }
            let is_hit = beam.is_hit() || beam.range_m == 0.0;
            let range_m = if beam.range_m >= range_min_m { beam.range_m } else { range_min_m - NEARER_M };
            if mean.is_hit() && is_hit && (range_m - mean.range_m).abs() <= APART_M {
                *scans = (*scans + 1).min(SCANS_MAX);
                mean.range_m += (range_m - mean.range_m) / f32::from(*scans);
                if mean.range_m < range_min_m - MOSTLY * NEARER_M {
                    (mean.range_m, *scans) = (0.0, 1);
                }
            } else {
                (*mean, *scans) = (*beam, 1);
            }
        }
    }

    /// What is seen now, `beams` being those of the newest scan.
    pub(super) fn beams<'a>(&'a self, beams: &'a Beams) -> &'a Beams {
        if self.is_used { &self.means } else { beams }
    }

    /// Whether a point of the `odom` frame was a noisy hit of what is now known better, with the lidar at `pose`.
    pub(super) fn knows_better(&self, point: Point, pose: Pose) -> bool {
        let beams = self.means.as_slice();
        let Some(first) = beams.first().filter(|_| self.is_used) else { return false };
        let local = pose.local_from_parent(point);
        let turn_rad = libm::atan2f(local.y, local.x) - libm::atan2f(first.sin, first.cos);
        let turn_rad = turn_rad - TAU * libm::floorf(turn_rad / TAU);
        let nearest = libm::roundf(turn_rad / self.means.step_rad()) as usize;
        let index = if self.means.is_circle() { nearest % beams.len() } else { nearest };
        beams.get(index).is_some_and(|mean| {
            self.scans[index] >= SETTLED
                && mean.is_hit()
                && (mean.range_m - local.coords.norm()).abs() <= APART_M
        })
    }

    /// The robot was set down elsewhere.
    pub(super) fn forget(&mut self) {
        self.since = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages::LaserScan;
    use crate::task::Lidar;

    const BOX: Footprint = Footprint::Rectangle { front_m: 0.3, rear_m: 0.3, half_width_m: 0.2 };

    /// Ranges of beam 5 that are seen, scan after scan, from a place.
    fn seen(steady: &mut Steady, ranges_m: &[f32], pose: Pose) -> f32 {
        let mut beams = Beams::new();
        for range_m in ranges_m {
            beams.read(&LaserScan::of(&Lidar::default(), |_| *range_m), f32::INFINITY);
            let stamp_ns = steady.stamp_ns + 1;
            steady.see(&beams, pose, stamp_ns, Lidar::default().range_min_m);
        }
        steady.beams(&beams).as_slice()[5].range_m
    }

    #[test]
    fn a_box_that_stands_sees_the_mean() {
        let mut steady = Steady::new(&BOX);
        let here = Pose::new(1.0, 0.0, 0.3);
        assert!((seen(&mut steady, &[0.5, 0.53, 0.47, 0.54], here) - 0.51).abs() < 1e-6);
        // Something else, nothing, nothing known: as it is.
        assert!((seen(&mut steady, &[0.8], here) - 0.8).abs() < 1e-6);
        assert!(seen(&mut steady, &[f32::INFINITY], here) == f32::INFINITY);
        assert!(seen(&mut steady, &[f32::NAN], here).is_nan());
        assert!((seen(&mut steady, &[0.5, 0.53, f32::NAN], here) - 0.515).abs() < 1e-6, "it failed once");
        assert!(seen(&mut steady, &[f32::NAN, f32::NAN], here).is_nan());
        // Just as far as can be measured, now and then nearer; and too near from the beginning.
        let least_m = Lidar::default().range_min_m;
        let near_m = seen(&mut steady, &[least_m + 0.01, 0.5 * least_m], here);
        assert!((near_m - least_m + 0.01).abs() < 1e-6, "{near_m}");
        assert!(seen(&mut steady, &[0.5 * least_m; 3], here) <= 0.0, "mostly nearer");
        assert!(seen(&mut steady, &[f32::NAN, 0.5 * least_m], here) < least_m);
        assert!((seen(&mut steady, &[0.5, 0.52], here) - 0.51).abs() < 1e-6);
        for moved in [Pose::new(1.01, 0.0, 0.3), Pose::new(1.01, 0.0, 0.31)] {
            assert!((seen(&mut steady, &[0.55], moved) - 0.55).abs() < 1e-6, "{moved:?}");
        }
        assert!((seen(&mut steady, &[0.57], Pose::new(1.01, 0.0, 0.31)) - 0.56).abs() < 1e-6);
        steady.forget();
        assert!((seen(&mut steady, &[0.6], Pose::new(1.01, 0.0, 0.31)) - 0.6).abs() < 1e-6);
    }

    #[test]
    fn what_was_seen_on_the_way_is_known_better_after_some_scans() {
        let (mut steady, here) = (Steady::new(&BOX), Pose::new(1.0, 0.0, 0.3));
        let at = |range_m: f32| here.parent_from_local(Point::new(range_m * 0.6, range_m * 0.8));
        seen(&mut steady, &[0.5; 4], here);
        assert!(!steady.knows_better(at(0.45), here));
        seen(&mut steady, &[0.5], here);
        assert!(steady.knows_better(at(0.45), here) && steady.knows_better(at(0.55), here));
        assert!(!steady.knows_better(at(0.35), here), "something in front of it");
        seen(&mut steady, &[f32::INFINITY; 9], here);
        assert!(!steady.knows_better(at(0.45), here), "nothing is there: who kept it knows why");
    }

    #[test]
    fn a_scan_that_is_looked_at_twice_is_not_two() {
        let (mut steady, here, mut beams) = (Steady::new(&BOX), Pose::default(), Beams::new());
        for (stamp_ns, range_m) in [(1, 0.5), (2, 0.56), (2, 0.56), (2, 0.56), (2, 0.56)] {
            beams.read(&LaserScan::of(&Lidar::default(), |_| range_m), f32::INFINITY);
            steady.see(&beams, here, stamp_ns, 0.05);
        }
        assert!((steady.beams(&beams).as_slice()[5].range_m - 0.53).abs() < 1e-6);
        assert!(!steady.knows_better(Point::new(0.5, 0.0), here), "two scans are few");
    }

    #[test]
    fn a_disc_sees_single_scans() {
        let mut steady = Steady::new(&Footprint::circle(0.2));
        assert!((seen(&mut steady, &[0.5, 0.53], Pose::default()) - 0.53).abs() < 1e-6);
    }
}
