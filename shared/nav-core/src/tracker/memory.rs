//! Scans of the last second: where it was free then. What stands now where it was free a moment ago has moved there,
//! which no wall does, however the robot's own motion slides its visible part along.

use crate::geometry::{Point, Pose, Vector};
use crate::messages::MAX_BEAMS;
use crate::scan::beams::Beams;
use core::f32::consts::TAU;
use nalgebra::Matrix2;

/// Scans, the newest among them.
const SCANS: usize = 10;
/// Time between kept scans at least, ns.
const APART_NS: u64 = 190_000_000;
/// Kept scans are used at most so old, ns: in a longer time odometry drifts.
const OLDEST_NS: u64 = 2_000_000_000;
/// A beam that went on so much farther behind a place was free there, m.
pub(super) const MARGIN_M: f32 = 0.12;
/// Beams of a scan looked at for a chord at most.
const PROBES: usize = 4;

/// Points farther apart than this need not belong to one side, m.
const GAP_MAX_M: f32 = 0.3;
/// Sine of the angle at which a side must be looked at: along a wall, centimetres decide what is passed.
const SLANT_SIN: f32 = 0.5;
/// Ends of a thing's side are left out, because beams that graze an edge hit it or not by chance, m.
const GRAZED_M: f32 = 0.015;

/// The visible side of a thing in the `odom` frame: its ends, the left one counter-clockwise from the right one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Chord {
    pub(super) right: Point,
    pub(super) left: Point,
    /// Between neighbouring points of it that were hit, m. In a corner the side may lie half as far behind the chord.
    pub(super) gap_m: f32,
}

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
    reach_m: f32,
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
            reach_m: 0.0,
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
        self.reach_m = beams.reach_m();
        self.count = beams.as_slice().len();
        for (range_m, beam) in self.ranges_m.iter_mut().zip(beams.as_slice()) {
            *range_m = beam.range_m;
        }
    }

    /// Where it was taken, `odom` frame.
    pub(super) fn position(&self) -> Point {
        self.pose.position()
    }

    /// A point of its robot frame in the `odom` frame.
    pub(super) fn odom_from_local(&self, local: Point) -> Point {
        self.pose.position() + self.turn() * local.coords
    }

    /// The turn from its robot frame to the `odom` frame.
    pub(super) fn turn(&self) -> Matrix2<f32> {
        Matrix2::new(self.cos, -self.sin, self.sin, self.cos)
    }

    /// A point of the `odom` frame in its robot frame.
    pub(super) fn local_from_odom(&self, point: Point) -> Point {
        let off = point - self.pose.position();
        Point::new(self.cos * off.x + self.sin * off.y, self.cos * off.y - self.sin * off.x)
    }

    /// A point of the `odom` frame as seen from there: counter-clockwise from the first beam in [0, 2 pi), rad, and range, m.
    fn polar(&self, point: Point) -> (f32, f32) {
        let off = point - self.pose.position();
        (self.turn_rad(off), off.norm())
    }

    /// The direction of a vector of the `odom` frame, counter-clockwise from the first beam in [0, 2 pi), rad.
    fn turn_rad(&self, off: Vector) -> f32 {
        let (x, y) = (self.cos * off.x + self.sin * off.y, self.cos * off.y - self.sin * off.x);
        let turn_rad = libm::atan2f(y, x) - self.first_rad;
        if turn_rad < 0.0 { turn_rad + TAU } else { turn_rad }
    }

    /// How far it was free in the direction of a beam, m; `None` where that is not known.
    fn free_m(&self, beam: usize) -> Option<f32> {
        let range_m = *self.ranges_m[..self.count].get(beam)?;
        if range_m.is_nan() { None } else { Some(range_m.min(self.reach_m)) }
    }

    /// Whether a beam went right through where the side of a thing lies now, or all beams beside it did: it cannot have stood
    /// there. What is thinner than the beams' spacing they could have passed on both sides.
    pub(super) fn passed_through(&self, chord: &Chord) -> bool {
        if self.count < 2 || chord.gap_m <= 0.0 || chord.gap_m > GAP_MAX_M {
            return false;
        }
        let (right, left) = (chord.right - self.pose.position(), chord.left - self.pose.position());
        let (along, across) = (right.dot(&left), right.perp(&left));
        // Seen from the other side, or from within.
        if across <= 1e-4 || across > along {
            return false;
        }
        if across < SLANT_SIN * right.norm() * (left - right).norm() {
            return false;
        }
        let tangent = across / along;
        let (right_rad, span_rad) = (self.turn_rad(right), tangent - 0.25 * tangent * tangent * tangent);
        let (right_m, left_m) = (right.norm(), left.norm());
        let is_free = |beam: i32| {
            let share = ((beam as f32 * self.step_rad - right_rad) / span_rad).clamp(0.0, 1.0);
            let needed_m = right_m + (left_m - right_m) * share + MARGIN_M + 0.5 * chord.gap_m;
            let index = if self.is_circle { beam.rem_euclid(self.count as i32) } else { beam };
            usize::try_from(index)
                .ok()
                .and_then(|index| self.free_m(index))
                .is_some_and(|free_m| free_m > needed_m)
        };
        let grazed_rad = GRAZED_M / right_m.min(left_m).max(GRAZED_M);
        let first = ceil((right_rad + grazed_rad) / self.step_rad);
        let last = floor((right_rad + span_rad - grazed_rad) / self.step_rad);
        if first <= last {
            let stride = (last - first) as usize / PROBES + 1;
            return (first..=last).step_by(stride).any(is_free);
        }
        // Too few beams to go through: those on both sides must have passed.
        let first = floor(right_rad / self.step_rad);
        let last = ceil((right_rad + span_rad) / self.step_rad);
        last - first <= PROBES as i32 && (first..=last).all(is_free)
    }

    /// The beams that look at a disc: the first, and how many follow it counter-clockwise; some more than needed.
    pub(super) fn window(&self, center: Point, radius_m: f32) -> (usize, usize) {
        let (turn_rad, range_m) = self.polar(center);
        let share = radius_m / range_m.max(1e-3);
        // An arc sine is at most so much more than its argument up to 0.8.
        if share > 0.8 || self.step_rad <= 0.0 {
            return (0, self.count);
        }
        let half_rad = 1.16 * share;
        let first = floor((turn_rad - half_rad) / self.step_rad);
        let count = (2.0 * half_rad / self.step_rad) as usize + 2;
        if self.is_circle {
            return (first.rem_euclid(self.count.max(1) as i32) as usize, count.min(self.count));
        }
        // The far side of the first beam's direction: what begins before it may also lie just behind the last.
        if first < 0 { (0, self.count) } else { (first as usize, count) }
    }

    /// How far behind a point of the `odom` frame it was free, m; negative for what was hidden. `None` where it is not known.
    pub(super) fn beyond_m(&self, point: Point) -> Option<f32> {
        let (turn_rad, range_m) = self.polar(point);
        if self.count == 0 || range_m > self.reach_m {
            return None;
        }
        let nearest = libm::roundf(turn_rad / self.step_rad) as usize;
        let index = if self.is_circle && nearest >= self.count { nearest - self.count } else { nearest };
        self.free_m(index).map(|free_m| free_m - range_m)
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

    /// In how many of the older scans beams went through where the side of a thing lies now; `most` is enough.
    pub(super) fn times_free(&self, chord: &Chord, most: usize) -> usize {
        let now_ns = self.now().stamp_ns;
        // The oldest first: since then most has changed.
        let older = (1..SCANS)
            .map(|step| &self.scans[(self.now + step) % SCANS])
            .filter(|seen| seen.count > 0 && now_ns.saturating_sub(seen.stamp_ns) <= OLDEST_NS);
        older.filter(|seen| seen.passed_through(chord)).take(most).count()
    }
}

/// The next whole number at or below `value`: two instructions where `libm::floorf` is a call.
fn floor(value: f32) -> i32 {
    let truncated = value as i32;
    truncated - i32::from((truncated as f32) > value)
}

/// The next whole number at or above `value`.
fn ceil(value: f32) -> i32 {
    -floor(-value)
}
