//! What a failed beam showed a moment ago: it ages, it does not vanish.
//!
//! Kept by direction in the `odom` frame, so that a robot that turns finds it again, and carried forward by the way that
//! the robot has made since.

use crate::geometry::{Point, Pose};
use crate::messages::MAX_BEAMS;
use crate::task::Lidar;
use core::f32::consts::TAU;

/// What was seen counts for so long, ns: beams fail one scan at a time, however large the robot is...
const KEPT_NS: u64 = 300_000_000;
/// ...and at least for so many scans.
const KEPT_SCANS: u64 = 3;

/// One direction's last measurement.
#[derive(Clone, Copy, Debug)]
struct Seen {
    /// Where something was, m; `INFINITY` for nothing.
    range_m: f32,
    /// Where it was measured from, `odom` frame.
    from: Point,
    /// When; `None` when never.
    stamp_ns: Option<u64>,
}

const NEVER: Seen = Seen { range_m: f32::INFINITY, from: Point::new(0.0, 0.0), stamp_ns: None };

/// The last measurement in each direction of the `odom` frame.
#[derive(Clone, Debug)]
pub(super) struct Recall {
    angle_min_rad: f32,
    width_rad: f32,
    directions: usize,
    kept_ns: u64,
    seen: [Seen; MAX_BEAMS],
}

impl Recall {
    /// Nothing seen yet, with directions as wide as the beams of `lidar`, and a scan each `period_ns`.
    pub(super) fn new(lidar: &Lidar, period_ns: u64) -> Self {
        let width_rad = lidar.angle_increment_rad();
        let directions = libm::roundf(TAU / width_rad).clamp(1.0, MAX_BEAMS as f32) as usize;
        let kept_ns = KEPT_NS.max(KEPT_SCANS * period_ns);
        Self {
            angle_min_rad: lidar.angle_min_rad(),
            width_rad,
            directions,
            kept_ns,
            seen: [NEVER; MAX_BEAMS],
        }
    }

    /// Forgets everything.
    pub(super) fn forget(&mut self) {
        self.seen.fill(NEVER);
    }

    /// Keeps what the beams measured from `pose` at `stamp_ns`, and fills those that did not.
    pub(super) fn complete(&mut self, beams_m: &mut [f32], stamp_ns: u64, pose: Pose) {
        let here = pose.position();
        let turn = (pose.yaw_rad + self.angle_min_rad) * (self.directions as f32 / TAU);
        let first = (libm::roundf(turn) as i64).rem_euclid(self.directions as i64) as usize;
        for (beam, range_m) in beams_m.iter_mut().enumerate() {
            let seen = &mut self.seen[(first + beam) % self.directions];
            if !range_m.is_nan() {
                *seen = Seen { range_m: *range_m, from: here, stamp_ns: Some(stamp_ns) };
                continue;
            }
            let is_fresh = seen
                .stamp_ns
                .and_then(|then| stamp_ns.checked_sub(then))
                .is_some_and(|age_ns| age_ns <= self.kept_ns);
            if is_fresh {
                let angle_rad = pose.yaw_rad + self.angle_min_rad + beam as f32 * self.width_rad;
                let (sin, cos) = libm::sincosf(angle_rad);
                let moved = here - seen.from;
                *range_m = (seen.range_m - moved.x * cos - moved.y * sin).max(0.0);
            }
        }
    }
}
