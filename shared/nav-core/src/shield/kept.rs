//! Thin things that stood near the robot a while ago: the ends of walls, posts. Beams of a coarse lidar pass them on both
//! sides, and the end of a wall that is looked at along the wall is thinner than any. So that no beam hits them any more says
//! nothing, and they count until they are far away or old; or until a beam goes on where the side of the thing was.

use super::sectors::{Beside, Nearest};
use super::standing::margin_m;
use crate::geometry::{Point, Pose};
use crate::scale::Scale;
use crate::scan::beams::Beams;
use core::f32::consts::TAU;
use heapless::Vec;

/// The most points.
pub(super) const KEPT_MAX: usize = 96;
/// What was not seen again counts for so long, s of the reference robot ([`Scale`]).
const KEPT_S: f32 = 8.0;
/// A beam that goes on by so many margins farther found nothing there.
const BEYOND: f32 = 3.0;
/// Sine of the angle at which a side must be looked at to see that it is gone: along a wall, centimetres decide what is passed.
const SLANT_SIN: f32 = 0.5;
/// Directions that differ by this share of a beam's width are the same.
const HAIR: f32 = 0.02;

/// Points of thin things.
#[derive(Clone, Debug)]
pub(super) struct Kept {
    points: Vec<Nearest, KEPT_MAX>,
    kept_ns: u64,
    /// Points nearer to each other than this are one, m.
    margin_m: f32,
}

impl Kept {
    /// Nothing yet.
    pub(super) fn new(scale: &Scale) -> Self {
        Self { points: Vec::new(), kept_ns: scale.ns(KEPT_S), margin_m: margin_m(scale) }
    }

    /// Keeps a point of something thin, in place of the one farthest from `here` where there is no room.
    pub(super) fn keep(&mut self, point: Nearest, here: Point) {
        let same2_m2 = self.margin_m * self.margin_m;
        let is_same = |kept: &Nearest| (kept.point - point.point).norm_squared() < same2_m2;
        if matches!(point.beside, Beside::Wide) || self.points.iter().any(is_same) {
            return;
        }
        let Err(point) = self.points.push(point) else { return };
        let away_m2 = |kept: &Nearest| (kept.point - here).norm_squared();
        let farthest = self.points.iter_mut().max_by(|a, b| away_m2(a).total_cmp(&away_m2(b)));
        if let Some(farthest) = farthest.filter(|farthest| away_m2(farthest) > away_m2(&point)) {
            *farthest = point;
        }
    }

    /// Forgets what is old, farther than `far_m` from the robot, or gone by a scan from `pose`.
    pub(super) fn look_again(&mut self, beams: &Beams, pose: Pose, stamp_ns: u64, far_m: f32) {
        let first_rad = beams.as_slice().first().map_or(0.0, |beam| libm::atan2f(beam.sin, beam.cos));
        self.points.retain(|kept| {
            let is_gone = match kept.beside {
                Beside::End(beside) => {
                    is_passed(kept.point, beside, beams, pose, first_rad, BEYOND * self.margin_m)
                }
                Beside::Alone | Beside::Wide => false,
            };
            stamp_ns.saturating_sub(kept.stamp_ns) <= self.kept_ns
                && (kept.point - pose.position()).norm_squared() <= far_m * far_m
                && !is_gone
        });
    }

    /// All of them.
    pub(super) fn iter(&self) -> impl Iterator<Item = &Nearest> {
        self.points.iter()
    }

    /// Forgets all.
    pub(super) fn forget(&mut self) {
        self.points.clear();
    }
}

/// Whether a beam goes on by `beyond_m` between two places of the `odom` frame, where something was. `first_rad` is the direction of beam 0.
fn is_passed(a: Point, b: Point, beams: &Beams, pose: Pose, first_rad: f32, beyond_m: f32) -> bool {
    let (a, b) = (a - pose.position(), b - pose.position());
    let across = a.perp(&b);
    if across.abs() < SLANT_SIN * a.norm() * (b - a).norm() {
        return false;
    }
    let (right, left) = if across > 0.0 { (a, b) } else { (b, a) };
    let turn_rad = libm::atan2f(right.y, right.x) - pose.yaw_rad - first_rad;
    let turn_rad = turn_rad - TAU * libm::floorf(turn_rad / TAU);
    let next = libm::ceilf(turn_rad / beams.step_rad() - HAIR);
    // Where the first beam from there goes: past both, or between them.
    let (sin, cos) = libm::sincosf(pose.yaw_rad + first_rad + next * beams.step_rad());
    if left.y * cos - left.x * sin < -HAIR * beams.step_rad() * left.norm() {
        return false;
    }
    let index = if beams.is_circle() {
        (next as usize).checked_rem(beams.as_slice().len())
    } else {
        Some(next as usize)
    };
    let beam = index.and_then(|index| beams.as_slice().get(index));
    beam.is_some_and(|beam| beam.range_m > a.norm().max(b.norm()) + beyond_m)
}
