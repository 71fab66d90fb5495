//! What stands around the robot: the nearest hit in each of a fixed number of sectors, over the scans of the last moment.

use super::grid::Grid;
use super::kept::{KEPT_MAX, Kept};
use super::motion::Place;
use super::nose::Nose;
use super::sectors::{Beside, Nearest, SECTORS_MAX, View, same_beside};
use crate::footprint::Footprint;
use crate::geometry::{Point, Pose};
use crate::scale::Scale;
use crate::scan::beams::{Beam, Beams};
use core::f32::consts::TAU;

/// Kept free around everything that stands, m: for the lidar's noise, which a smaller robot has, too, and a footprint that is
/// larger than it is said to be, which counts for more with a larger one.
pub const MARGIN_M: f32 = 0.04;
/// Coming nearer by less than this share of its half width is none to a rectangle.
const HAIR: f32 = 5e-4;
/// So many scans are looked at together: what lies between two beams of one is hit by the next, and what failed to be
/// measured a moment ago is not gone.
const SCANS: usize = 6;
/// What was seen counts for so long, s of the reference robot ([`Scale`]).
const KEPT_S: f32 = 0.6;
/// Scans that follow each other faster share a place, s of the reference robot.
const APART_S: f32 = 0.06;
/// The most points.
const POINTS: usize = SCANS * SECTORS_MAX + KEPT_MAX;
/// Neighbouring beams whose ranges differ by more did not hit the same side of a thing, m; more for a larger robot.
const GAP_M: f32 = 0.15;
/// Points are looked at in groups of this size.
const LANES: usize = 8;

/// What is kept free around everything that stands by a robot, m.
pub fn margin_m(scale: &Scale) -> f32 {
    MARGIN_M.max(scale.m(MARGIN_M))
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
    seen: [[Option<Nearest>; SECTORS_MAX]; SCANS],
    /// Points of the robot frame, m.
    x_m: [f32; POINTS],
    y_m: [f32; POINTS],
    /// Squared distance of the robot's centre below which each counts as touched, m²; for a rectangle, may be touched...
    reach2_m2: [f32; POINTS],
    /// ...which it is within this distance of the outline, m.
    near_m: [f32; POINTS],
    /// How near each may come to the point that a rectangle turns about when it is ahead, m.
    ahead_m: [f32; POINTS],
    nose: Nose,
    footprint: Footprint,
    count: usize,
    /// How far away the last of them may be touched, m.
    reach_m: f32,
}

/// What is kept free around a hit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Room {
    /// This share of the margin.
    pub(super) share: f32,
    /// And what spans such an angle where it is: so far something may reach unseen, rad.
    pub(super) edge_rad: f32,
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
    pub(super) fn new(scale: &Scale, footprint: &Footprint) -> Self {
        Self {
            scale: *scale,
            margin_m: margin_m(scale),
            begun_ns: 0,
            seen: [[None; SECTORS_MAX]; SCANS],
            x_m: [0.0; POINTS],
            y_m: [0.0; POINTS],
            reach2_m2: [0.0; POINTS],
            near_m: [0.0; POINTS],
            ahead_m: [0.0; POINTS],
            nose: Nose::of(footprint),
            footprint: *footprint,
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
        let View { beams, sectors, pose, stamp_ns, footprint, mount } = *view;
        let mut nearest = [(f32::INFINITY, 0); SECTORS_MAX];
        for (index, beam) in beams.as_slice().iter().enumerate() {
            let is_measured = beam.range_m > 0.0 || beam.range_m.is_nan();
            let range_m =
                if is_measured { beam.range_m } else { footprint.edge_m(mount, beam.cos, beam.sin) };
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

    /// Lays the points within `far_m` out for courses of the footprint from `pose`, with the `room` that each is given, seen
    /// by the `lidar`, wherever that is now. What is nearer already than it should be may not
    /// come nearer still. What is `kept` counts like what was seen.
    pub(super) fn lay_out(&mut self, kept: &Kept, pose: Pose, lidar: Point, room: Room, far_m: f32) {
        let (margin_m, edge_rad) = (room.share * self.margin_m, room.edge_rad);
        let radius_m = self.footprint.circumradius_m();
        let is_rectangle = self.footprint.corners().is_some();
        let (sin, cos) = libm::sincosf(pose.yaw_rad);
        let here = pose.position();
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
            let seen_m = if lidar == here { libm::sqrtf(range2_m2) } else { (seen.point - lidar).norm() };
            let beside_m = margin_m + edge_rad * seen_m;
            let reach_m = radius_m + beside_m;
            if is_rectangle {
                let now = Point::new(self.x_m[at], self.y_m[at]);
                let hair_m = HAIR * self.footprint.half_width_m();
                self.near_m[at] = beside_m.min(self.footprint.distance_m(now) - hair_m);
                self.ahead_m[at] = self.nose.nearest_m(now, beside_m, hair_m);
                self.reach2_m2[at] = reach_m * reach_m;
            } else {
                self.reach2_m2[at] = (reach_m * reach_m).min(range2_m2 * 0.9998);
            }
            self.count += 1;
        }
        // Whole groups for the loops below; what fills up touches nothing.
        while !self.count.is_multiple_of(LANES) {
            (self.x_m[self.count], self.y_m[self.count]) = (0.0, 0.0);
            self.reach2_m2[self.count] = 0.0;
            self.near_m[self.count] = f32::NEG_INFINITY;
            self.ahead_m[self.count] = 0.0;
            self.count += 1;
        }
    }

    /// How far from a hit the next one may lie, seen by the lidar, rad: a sector keeps but one, which counts for corners.
    pub(super) fn spacing_rad(&self, beams: &Beams) -> f32 {
        let least_rad = if self.footprint.corners().is_some() { TAU / SECTORS_MAX as f32 } else { 0.0 };
        beams.step_rad().max(least_rad)
    }

    /// A map of them, for who asks often.
    pub(super) fn grid(&self) -> Grid {
        let mut grid = Grid::new(self.reach_m);
        for at in 0..self.count {
            grid.draw((self.x_m[at], self.y_m[at]), libm::sqrtf(self.reach2_m2[at]));
        }
        grid
    }

    /// Whether the robot is too near to something at a place.
    pub(super) fn is_touched(&self, place: &Place) -> bool {
        match self.footprint {
            Footprint::Circle { .. } => self.touches_disc(place.at_m),
            Footprint::Rectangle { front_m, rear_m, half_width_m } => {
                self.touches_rectangle(place, (front_m, rear_m, half_width_m))
            }
        }
    }

    fn touches_disc(&self, (x_m, y_m): (f32, f32)) -> bool {
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

    fn touches_rectangle(&self, place: &Place, (front_m, rear_m, half_width_m): (f32, f32, f32)) -> bool {
        let Place { at_m: (x_m, y_m), cos, sin } = *place;
        for first in (0..self.count).step_by(LANES) {
            let (mut dx, mut dy) = ([0.0; LANES], [0.0; LANES]);
            let mut may_touch = false;
            for lane in 0..LANES {
                (dx[lane], dy[lane]) = (self.x_m[first + lane] - x_m, self.y_m[first + lane] - y_m);
                may_touch |= dx[lane] * dx[lane] + dy[lane] * dy[lane] < self.reach2_m2[first + lane];
            }
            if !may_touch {
                continue;
            }
            let mut touched = false;
            for lane in 0..LANES {
                // As the footprint's own distance, for all lanes at once.
                let (ahead, aside) = (cos * dx[lane] + sin * dy[lane], cos * dy[lane] - sin * dx[lane]);
                let (along, across) = ((ahead - front_m).max(-rear_m - ahead), aside.abs() - half_width_m);
                let (out, beside) = (along.max(0.0), across.max(0.0));
                let away_m = (out * out + beside * beside).max(0.0);
                let near_m = self.near_m[first + lane];
                let inside_m = along.max(across).min(0.0);
                touched |= inside_m < near_m.min(0.0) || (near_m > 0.0 && away_m < near_m * near_m);
                let nearest_m = self.ahead_m[first + lane];
                touched |= self.nose.is_before(ahead, aside)
                    && ahead * ahead + aside * aside < nearest_m * nearest_m;
            }
            if touched {
                return true;
            }
        }
        false
    }

    /// What the robot is too near to at a place, most of all.
    pub(super) fn bump(&self, place: &Place) -> Bump {
        let mut worst = Bump { at_m: (0.0, 0.0), depth_m: 0.0 };
        let (x_m, y_m) = place.at_m;
        if self.footprint.corners().is_some() {
            for at in 0..self.count {
                let seen = place.seen((self.x_m[at], self.y_m[at]));
                let mut depth_m = self.near_m[at] - self.footprint.distance_m(Point::new(seen.0, seen.1));
                if self.nose.is_before(seen.0, seen.1) {
                    depth_m = depth_m.max(self.ahead_m[at] - libm::hypotf(seen.0, seen.1));
                }
                if depth_m > worst.depth_m {
                    worst = Bump { at_m: (self.x_m[at], self.y_m[at]), depth_m };
                }
            }
            return worst;
        }
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
        self.seen = [[None; SECTORS_MAX]; SCANS];
        self.begun_ns = 0;
        self.count = 0;
    }
}
