//! Scans of the last second: where it was free then. What stands now where it was free a moment ago has moved there,
//! which no wall does, however the robot's own motion slides its visible part along.

use crate::geometry::{Point, Pose};
use crate::messages::MAX_BEAMS;
use crate::scan::beams::Beams;
use core::f32::consts::TAU;

/// Scans, the newest among them.
const SCANS: usize = 7;
/// Time between kept scans at least, ns.
const APART_NS: u64 = 150_000_000;
/// Kept scans are used at most so old, ns: in a longer time odometry drifts.
const OLDEST_NS: u64 = 1_200_000_000;
/// Beams farther apart than this at a point may both have passed a thing that stands there, m.
const GAP_MAX_M: f32 = 0.3;

/// A scan with the place it was taken from.
#[derive(Clone, Debug)]
pub(super) struct Seen {
    stamp_ns: u64,
    pose: Pose,
    /// Of the pose.
    cos: f32,
    sin: f32,
    first_rad: f32,
    step_rad: f32,
    is_circle: bool,
    count: usize,
    ranges_m: [f32; MAX_BEAMS],
}

impl Seen {
    fn new() -> Self {
        Self {
            stamp_ns: 0,
            pose: Pose::default(),
            cos: 1.0,
            sin: 0.0,
            first_rad: 0.0,
            step_rad: 0.0,
            is_circle: false,
            count: 0,
            ranges_m: [f32::NAN; MAX_BEAMS],
        }
    }

    fn take(&mut self, beams: &Beams, pose: Pose, stamp_ns: u64) {
        let (sin, cos) = libm::sincosf(pose.yaw_rad);
        let first_rad = beams.as_slice().first().map_or(0.0, |beam| libm::atan2f(beam.sin, beam.cos));
        (self.stamp_ns, self.pose, self.cos, self.sin) = (stamp_ns, pose, cos, sin);
        (self.first_rad, self.step_rad, self.is_circle) = (first_rad, beams.step_rad(), beams.is_circle());
        self.count = beams.as_slice().len();
        for (range_m, beam) in self.ranges_m.iter_mut().zip(beams.as_slice()) {
            *range_m = beam.range_m;
        }
    }

    /// How far beyond a point of the `odom` frame it was free, m: the lesser of both beams that pass beside it. `None` where
    /// that is not known.
    pub(super) fn beyond_m(&self, point: Point) -> Option<f32> {
        let off = point - self.pose.position();
        let (x, y) = (self.cos * off.x + self.sin * off.y, self.cos * off.y - self.sin * off.x);
        let range_m = off.norm();
        if self.count < 2 || range_m * self.step_rad > GAP_MAX_M {
            return None;
        }
        let mut turn_rad = libm::atan2f(y, x) - self.first_rad;
        if turn_rad < 0.0 {
            turn_rad += TAU;
        }
        let low = (turn_rad / self.step_rad) as usize;
        let high = if self.is_circle && low + 1 >= self.count { 0 } else { low + 1 };
        if low >= self.count || high >= self.count {
            return None;
        }
        let (low_m, high_m) = (self.ranges_m[low], self.ranges_m[high]);
        // NaN is unknown.
        if low_m.is_nan() || high_m.is_nan() { None } else { Some(low_m.min(high_m) - range_m) }
    }
}

/// The last scans.
#[derive(Clone, Debug)]
pub(super) struct Memory {
    scans: [Seen; SCANS],
    /// Which is the newest.
    now: usize,
    /// When the last of the older ones was taken, ns.
    kept_ns: Option<u64>,
}

impl Memory {
    pub(super) fn new() -> Self {
        Self { scans: core::array::from_fn(|_| Seen::new()), now: 0, kept_ns: None }
    }

    pub(super) fn forget(&mut self) {
        self.scans.iter_mut().for_each(|seen| seen.count = 0);
        self.kept_ns = None;
    }

    /// The newest scan becomes the present; the one before it is kept if the last one kept is old enough.
    pub(super) fn take(&mut self, beams: &Beams, pose: Pose, stamp_ns: u64) {
        let before_ns = self.now().stamp_ns;
        let is_due = self.kept_ns.is_none_or(|kept_ns| before_ns.saturating_sub(kept_ns) >= APART_NS);
        if self.now().count > 0 && is_due {
            self.kept_ns = Some(before_ns);
            self.now = (self.now + 1) % SCANS;
        }
        self.scans[self.now].take(beams, pose, stamp_ns);
    }

    /// The newest scan.
    pub(super) fn now(&self) -> &Seen {
        &self.scans[self.now]
    }

    /// In how many of the older scans it was free at a point, and `margin_m` beyond it.
    pub(super) fn times_free(&self, point: Point, margin_m: f32) -> u32 {
        let now_ns = self.now().stamp_ns;
        let older = self.scans.iter().enumerate().filter(|(index, seen)| {
            *index != self.now && seen.count > 0 && now_ns.saturating_sub(seen.stamp_ns) <= OLDEST_NS
        });
        let free = older.filter(|(_, seen)| seen.beyond_m(point).is_some_and(|beyond_m| beyond_m > margin_m));
        free.count() as u32
    }
}
