//! What stands around the robot: the nearest hit in each of a fixed number of sectors, over the scans of the last moment.

use super::grid::Grid;
use super::kept::{KEPT_MAX, Kept};
use crate::geometry::{Point, Pose};
use crate::messages::MAX_BEAMS;
use crate::scale::Scale;
use crate::scan::beams::{Beam, Beams};
use core::f32::consts::{PI, TAU};

/// Kept free around everything that stands, m: for the lidar's noise, which a smaller robot has, too, and a footprint that is
/// larger than it is said to be, which counts for more with a larger one.
pub const MARGIN_M: f32 = 0.04;
/// Sectors around the robot, one point each.
const SECTORS: usize = 72;
/// So many scans are looked at together: what lies between two beams of one is hit by the next, and what failed to be
/// measured a moment ago is not gone.
const SCANS: usize = 6;
/// What was seen counts for so long, s of the reference robot ([`Scale`]).
const KEPT_S: f32 = 0.6;
/// Scans that follow each other faster share a place, s of the reference robot.
const APART_S: f32 = 0.06;
/// The most points.
const POINTS: usize = SCANS * SECTORS + KEPT_MAX;
/// Neighbouring beams whose ranges differ by more did not hit the same side of a thing, m; more for a larger robot.
const GAP_M: f32 = 0.15;
/// Points are looked at in groups of this size.
const LANES: usize = 8;

/// What is kept free around everything that stands by a robot, m.
pub fn margin_m(scale: &Scale) -> f32 {
    MARGIN_M.max(scale.m(MARGIN_M))
}

/// Which sector each beam lies in, worked out once for a lidar.
#[derive(Clone, Debug)]
pub(super) struct Sectors {
    /// Beams, and the direction of the first and of the last one.
    layout: (usize, [u32; 4]),
    of_beam: [u8; MAX_BEAMS],
}

impl Sectors {
    /// Of no lidar.
    pub(super) fn new() -> Self {
        Self { layout: (0, [0; 4]), of_beam: [0; MAX_BEAMS] }
    }

    /// Works it out, unless the last scan had the same beams.
    pub(super) fn lay_out(&mut self, beams: &Beams) {
        let beams = beams.as_slice();
        let (Some(first), Some(last)) = (beams.first(), beams.last()) else { return };
        let layout = (beams.len(), [first.cos, first.sin, last.cos, last.sin].map(f32::to_bits));
        if layout == self.layout {
            return;
        }
        self.layout = layout;
        for (sector, beam) in self.of_beam.iter_mut().zip(beams) {
            let turn = (libm::atan2f(beam.sin, beam.cos) + PI) / TAU;
            // A hair more, so that beams on borders fall on one side whatever the rounding.
            *sector = ((turn * SECTORS as f32 + 1e-3) as usize % SECTORS) as u8;
        }
    }
}

/// What the beams beside one hit.
#[derive(Clone, Copy, Debug)]
pub(super) enum Beside {
    /// Both the same thing.
    Wide,
    /// One of them the same thing, here in the `odom` frame, m.
    End(Point),
    /// Neither.
    Alone,
}

/// The nearest thing in a sector.
#[derive(Clone, Copy, Debug)]
pub(super) struct Nearest {
    /// Where, in the `odom` frame, m.
    pub(super) point: Point,
    /// When it was seen.
    pub(super) stamp_ns: u64,
    /// What was hit beside it.
    pub(super) beside: Beside,
}

/// A scan, and where it was taken.
#[derive(Clone, Copy)]
pub(super) struct View<'a> {
    pub(super) beams: &'a Beams,
    pub(super) sectors: &'a Sectors,
    pub(super) pose: Pose,
    pub(super) stamp_ns: u64,
    /// What is too near to be measured touches a footprint of this radius, m.
    pub(super) radius_m: f32,
}

/// Points that stand.
#[derive(Clone, Debug)]
pub(super) struct Standing {
    scale: Scale,
    /// Kept free around everything, m.
    margin_m: f32,
    /// When the newest place began, ns.
    begun_ns: u64,
    /// The newest scans' points, newest first.
    seen: [[Option<Nearest>; SECTORS]; SCANS],
    /// Points of the robot frame, m.
    x_m: [f32; POINTS],
    y_m: [f32; POINTS],
    /// Squared distance of the robot's centre below which each counts as touched, m².
    reach2_m2: [f32; POINTS],
    count: usize,
    /// How far away the last of them may be touched, m.
    reach_m: f32,
}

/// What a robot is too near to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bump {
    /// Where the point is, robot frame, m.
    pub(super) at_m: (f32, f32),
    /// How far the robot is inside of what should be kept free, m.
    pub(super) depth_m: f32,
}

impl Standing {
    /// Nothing seen yet.
    pub(super) fn new(scale: &Scale) -> Self {
        Self {
            scale: *scale,
            margin_m: margin_m(scale),
            begun_ns: 0,
            seen: [[None; SECTORS]; SCANS],
            x_m: [0.0; POINTS],
            y_m: [0.0; POINTS],
            reach2_m2: [0.0; POINTS],
            count: 0,
            reach_m: 0.0,
        }
    }

    /// Takes in a scan without the beams that `is_left_out`, and hands out what it no longer counts.
    pub(super) fn see(
        &mut self,
        view: &View,
        is_left_out: impl Fn(usize) -> bool,
        mut leaving: impl FnMut(Nearest),
    ) {
        let View { beams, sectors, pose, stamp_ns, radius_m } = *view;
        let mut nearest = [(f32::INFINITY, 0); SECTORS];
        for (index, beam) in beams.as_slice().iter().enumerate() {
            let range_m = if beam.range_m > 0.0 { beam.range_m } else { radius_m };
            let nearest = &mut nearest[usize::from(sectors.of_beam[index])];
            if !beam.range_m.is_nan() && range_m < nearest.0 && !is_left_out(index) {
                *nearest = (range_m, index);
            }
        }
        let (sin, cos) = libm::sincosf(pose.yaw_rad);
        let gap_m = GAP_M.max(self.scale.m(GAP_M));
        if stamp_ns.abs_diff(self.begun_ns) >= self.scale.ns(APART_S) {
            self.seen.rotate_right(1);
            self.begun_ns = stamp_ns;
        }
        self.seen[0].iter().flatten().copied().for_each(&mut leaving);
        for (seen, (range_m, index)) in self.seen[0].iter_mut().zip(nearest) {
            *seen = range_m.is_finite().then(|| {
                let at =
                    |x: f32, y: f32| Point::new(pose.x_m + cos * x - sin * y, pose.y_m + sin * x + cos * y);
                let place = |range_m: f32, beam: &Beam| at(range_m * beam.cos, range_m * beam.sin);
                let beside = match same_beside(beams.as_slice(), index, gap_m) {
                    [Some(_), Some(_)] => Beside::Wide,
                    [Some(beam), None] | [None, Some(beam)] => Beside::End(place(beam.range_m, beam)),
                    [None, None] => Beside::Alone,
                };
                Nearest { point: place(range_m, &beams.as_slice()[index]), stamp_ns, beside }
            });
        }
        let kept_ns = self.scale.ns(KEPT_S);
        for seen in self.seen[1..].iter_mut().flatten() {
            if let Some(old) = seen.take_if(|seen| stamp_ns.saturating_sub(seen.stamp_ns) > kept_ns) {
                leaving(old);
            }
        }
    }

    /// Lays the points within `far_m` out for courses of a footprint of `radius_m` from `pose`; beside a hit, something may
    /// reach so far unseen as `edge_rad` spans. What is nearer already than it should be may not come nearer still. What is
    /// `kept` counts like what was seen.
    pub(super) fn lay_out(&mut self, kept: &Kept, pose: Pose, radius_m: f32, edge_rad: f32, far_m: f32) {
        let (sin, cos) = libm::sincosf(pose.yaw_rad);
        self.count = 0;
        self.reach_m = far_m + radius_m + self.margin_m + edge_rad * far_m;
        for seen in self.seen.iter().flatten().flatten().chain(kept.iter()) {
            let (dx, dy) = (seen.point.x - pose.x_m, seen.point.y - pose.y_m);
            let range2_m2 = dx * dx + dy * dy;
            if range2_m2 > far_m * far_m {
                continue;
            }
            let at = self.count;
            self.x_m[at] = cos * dx + sin * dy;
            self.y_m[at] = cos * dy - sin * dx;
            let reach_m = radius_m + self.margin_m + edge_rad * libm::sqrtf(range2_m2);
            self.reach2_m2[at] = (reach_m * reach_m).min(range2_m2 * 0.9998);
            self.count += 1;
        }
        // Whole groups for the loops below; what fills up touches nothing.
        while !self.count.is_multiple_of(LANES) {
            (self.x_m[self.count], self.y_m[self.count]) = (0.0, 0.0);
            self.reach2_m2[self.count] = 0.0;
            self.count += 1;
        }
    }

    /// A map of them, for who asks often.
    pub(super) fn grid(&self) -> Grid {
        let mut grid = Grid::new(self.reach_m);
        for at in 0..self.count {
            grid.draw((self.x_m[at], self.y_m[at]), libm::sqrtf(self.reach2_m2[at]));
        }
        grid
    }

    /// Whether the robot's centre at a place of the robot frame is too near to something.
    pub(super) fn is_touched(&self, (x_m, y_m): (f32, f32)) -> bool {
        let (xs, ys) =
            (self.x_m[..self.count].chunks_exact(LANES), self.y_m[..self.count].chunks_exact(LANES));
        for ((xs, ys), reaches) in xs.zip(ys).zip(self.reach2_m2[..self.count].chunks_exact(LANES)) {
            let mut touched = false;
            for lane in 0..LANES {
                let (dx, dy) = (xs[lane] - x_m, ys[lane] - y_m);
                touched |= dx * dx + dy * dy < reaches[lane];
            }
            if touched {
                return true;
            }
        }
        false
    }

    /// What the robot's centre at a place of the robot frame is too near to, most of all.
    pub(super) fn bump(&self, (x_m, y_m): (f32, f32)) -> Bump {
        let mut worst = Bump { at_m: (0.0, 0.0), depth_m: 0.0 };
        for first in (0..self.count).step_by(LANES) {
            let mut distance2_m2 = [0.0; LANES];
            let mut touched = false;
            for (lane, distance2_m2) in distance2_m2.iter_mut().enumerate() {
                let (dx, dy) = (self.x_m[first + lane] - x_m, self.y_m[first + lane] - y_m);
                *distance2_m2 = dx * dx + dy * dy;
                touched |= *distance2_m2 < self.reach2_m2[first + lane];
            }
            if !touched {
                continue;
            }
            for (lane, distance2_m2) in distance2_m2.into_iter().enumerate() {
                let at = first + lane;
                let depth_m = libm::sqrtf(self.reach2_m2[at]) - libm::sqrtf(distance2_m2);
                if depth_m > worst.depth_m {
                    worst = Bump { at_m: (self.x_m[at], self.y_m[at]), depth_m };
                }
            }
        }
        worst
    }

    /// Forgets what was seen.
    pub(super) fn forget(&mut self) {
        self.seen = [[None; SECTORS]; SCANS];
        self.begun_ns = 0;
        self.count = 0;
    }
}

/// The beams beside one that hit the same thing as it.
fn same_beside(beams: &[Beam], index: usize, gap_m: f32) -> [Option<&Beam>; 2] {
    let count = beams.len();
    [index + count - 1, index + 1].map(|beside| {
        let beam = &beams[beside % count];
        ((beam.range_m - beams[index].range_m).abs() <= gap_m).then_some(beam)
    })
}
