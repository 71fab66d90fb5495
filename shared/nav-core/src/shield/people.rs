//! Where those who move will be.

use super::motion::{Clock, Courses, MOMENTS};
use crate::footprint::Footprint;
use crate::geometry::{Point, Pose, Vector};
use crate::task::Robot;

/// Kept free around everybody, m...
const MARGIN_M: f32 = 0.05;
/// ...more with the time looked ahead, m/s...
const GROWTH_MPS: f32 = 0.1;
/// ...up to this, m...
const GROWTH_MAX_M: f32 = 0.1;
/// ...and beside that, where it can be had, m.
const SPARE_M: f32 = 0.2;
/// A robot is no faster than this many times its limit.
const FASTER: f32 = 1.2;
/// Coming nearer by less than this share of its half width is none to a rectangle.
const HAIR: f32 = 1e-3;
/// So many of those who move are looked at, the nearest first.
pub(super) const PEOPLE_MAX: usize = 16;

/// Somebody who moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mover {
    /// Centre, `odom` frame, m.
    pub position: Point,
    /// Velocity, `odom` frame, m/s.
    pub velocity: Vector,
    /// Radius, m.
    pub radius_m: f32,
}

/// Everybody near, at every moment of the future, in the robot frame of now.
#[derive(Clone, Debug)]
pub(super) struct People {
    count: usize,
    x_m: [[f32; PEOPLE_MAX]; MOMENTS + 1],
    y_m: [[f32; PEOPLE_MAX]; MOMENTS + 1],
    /// Distance of the centres below which both touch, squared, m², at every moment.
    reach2_m2: [[f32; PEOPLE_MAX]; MOMENTS + 1],
    /// The same with room to spare.
    wide2_m2: [[f32; PEOPLE_MAX]; MOMENTS + 1],
    velocity: [(f32, f32); PEOPLE_MAX],
    /// Of a rectangle, for which the distances above are those of the circle that it turns in.
    outline: Option<Outline>,
    /// Whom the robot can come near to on the way to each moment: a bit each.
    in_reach: [u32; MOMENTS + 1],
}

/// What counts for a rectangle.
#[derive(Clone, Debug)]
struct Outline {
    footprint: Footprint,
    /// From the outline to everybody's centre now, m.
    present_m: [f32; PEOPLE_MAX],
    /// How near they may come to it at every moment, m.
    reach_m: [[f32; PEOPLE_MAX]; MOMENTS + 1],
}

impl Outline {
    fn of(footprint: &Footprint) -> Option<Self> {
        let footprint = footprint.corners().map(|_| *footprint)?;
        let reach_m = [[0.0; PEOPLE_MAX]; MOMENTS + 1];
        Some(Self { footprint, present_m: [0.0; PEOPLE_MAX], reach_m })
    }

    /// How near somebody comes to the outline between two places as the robot sees them, m: along the straight line.
    fn nearest_m(&self, from: (f32, f32), to: (f32, f32)) -> f32 {
        let (a, b) = (Point::new(from.0, from.1), Point::new(to.0, to.1));
        let along = b - a;
        let length2 = along.norm_squared().max(1e-12);
        let at = |share: f32| self.footprint.distance_m(a + along * share.clamp(0.0, 1.0));
        let ends_m = at(0.0).min(at(1.0));
        // The nearest is an end, or where the line passes a corner or crosses a middle line.
        let corners = self.footprint.corners().into_iter().flatten();
        let passing_m = corners.map(|corner| at((corner - a).dot(&along) / length2));
        let crossing = [-a.x / along.x, -a.y / along.y].into_iter().filter(|share| share.is_finite());
        passing_m.chain(crossing.map(at)).fold(ends_m, f32::min)
    }
}

/// Who is near the robots on pieces of their courses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Nearness<const N: usize> {
    /// Who is touched.
    pub(super) touched: [Option<u8>; N],
    /// Who comes nearer than with room to spare.
    pub(super) close: [Option<u8>; N],
}

impl People {
    /// Nobody.
    pub(super) fn new() -> Self {
        Self {
            count: 0,
            x_m: [[0.0; PEOPLE_MAX]; MOMENTS + 1],
            y_m: [[0.0; PEOPLE_MAX]; MOMENTS + 1],
            reach2_m2: [[0.0; PEOPLE_MAX]; MOMENTS + 1],
            wide2_m2: [[0.0; PEOPLE_MAX]; MOMENTS + 1],
            velocity: [(0.0, 0.0); PEOPLE_MAX],
            outline: None,
            in_reach: [0; MOMENTS + 1],
        }
    }

    /// Works out where everybody within `far_m` will be, seen from `pose`.
    pub(super) fn foresee(&mut self, movers: &[Mover], pose: Pose, clock: &Clock, robot: &Robot, far_m: f32) {
        let (sin, cos) = libm::sincosf(pose.yaw_rad);
        self.count = 0;
        self.in_reach = [0; MOMENTS + 1];
        self.outline = Outline::of(&robot.footprint);
        for mover in movers {
            let (dx, dy) = (mover.position.x - pose.x_m, mover.position.y - pose.y_m);
            let (x, y) = (cos * dx + sin * dy, cos * dy - sin * dx);
            let (vx, vy) = (
                cos * mover.velocity.x + sin * mover.velocity.y,
                cos * mover.velocity.y - sin * mover.velocity.x,
            );
            if x * x + y * y > far_m * far_m || self.count == PEOPLE_MAX {
                continue;
            }
            let at = self.count;
            self.velocity[at] = (vx, vy);
            let present_m2 = x * x + y * y;
            if let Some(outline) = &mut self.outline {
                outline.present_m[at] = outline.footprint.distance_m(Point::new(x, y));
            }
            for moment in 0..=MOMENTS {
                let ahead_s = if moment == 0 { 0.0 } else { clock.at_s[moment - 1] };
                self.x_m[moment][at] = x + vx * ahead_s;
                self.y_m[moment][at] = y + vy * ahead_s;
                let growth_m = (GROWTH_MPS * ahead_s).min(GROWTH_MAX_M);
                let reach_m = robot.footprint.circumradius_m() + mover.radius_m + MARGIN_M + growth_m;
                // Who is nearer already may not come nearer still.
                let most_m2 = if self.outline.is_some() { f32::INFINITY } else { present_m2 * 0.999 };
                self.reach2_m2[moment][at] = (reach_m * reach_m).min(most_m2);
                let wide_m = reach_m + SPARE_M;
                self.wide2_m2[moment][at] = (wide_m * wide_m).min(most_m2);
                if let Some(outline) = &mut self.outline {
                    outline.reach_m[moment][at] = mover.radius_m + MARGIN_M + growth_m;
                }
                let (ax, ay) = self.place(moment.saturating_sub(1), at);
                let nearest2_m2 = nearest2_to_origin(ax, ay, self.x_m[moment][at], self.y_m[moment][at]);
                let way_m = wide_m + FASTER * robot.linear_max_mps * ahead_s;
                self.in_reach[moment] |= u32::from(nearest2_m2 < way_m * way_m) << at;
            }
            self.count += 1;
        }
    }

    /// Who is near while robots go from where they were at the moment before to where they are at `moment` (1 is the first
    /// after now).
    pub(super) fn nearness<const N: usize>(
        &self,
        moment: usize,
        from: &Courses<N>,
        to: &Courses<N>,
    ) -> Nearness<N> {
        let mut nearness = Nearness { touched: [None; N], close: [None; N] };
        for at in (0..self.count).filter(|at| self.in_reach[moment] >> at & 1 == 1) {
            let (before, now) = (self.place(moment - 1, at), self.place(moment, at));
            let (wide2_m2, reach2_m2) = (self.wide2_m2[moment][at], self.reach2_m2[moment][at]);
            let mut nearest2_m2 = [0.0; N];
            let mut is_near = false;
            for (lane, nearest2_m2) in nearest2_m2.iter_mut().enumerate() {
                let (ax, ay) = (before.0 - from.x_m[lane], before.1 - from.y_m[lane]);
                let (bx, by) = (now.0 - to.x_m[lane], now.1 - to.y_m[lane]);
                *nearest2_m2 = nearest2_to_origin(ax, ay, bx, by);
                is_near |= *nearest2_m2 < wide2_m2;
            }
            if !is_near {
                continue;
            }
            if let Some(outline) = &self.outline {
                let reach_m = outline.reach_m[moment][at];
                let present_m = outline.present_m[at] - HAIR * outline.footprint.half_width_m();
                for lane in (0..N).filter(|lane| nearest2_m2[*lane] < wide2_m2) {
                    let nearest_m =
                        outline.nearest_m(from.place(lane).seen(before), to.place(lane).seen(now));
                    let is_within = |reach_m: f32| (nearest_m < reach_m.min(present_m)).then_some(at as u8);
                    nearness.close[lane] = nearness.close[lane].or(is_within(reach_m + SPARE_M));
                    nearness.touched[lane] = nearness.touched[lane].or(is_within(reach_m));
                }
                continue;
            }
            for (lane, nearest2_m2) in nearest2_m2.into_iter().enumerate() {
                let note = |who: &mut Option<u8>, is_so: bool| *who = who.or(is_so.then_some(at as u8));
                note(&mut nearness.close[lane], nearest2_m2 < wide2_m2);
                note(&mut nearness.touched[lane], nearest2_m2 < reach2_m2);
            }
        }
        nearness
    }

    /// Velocity of one of them, robot frame, m/s.
    pub(super) fn velocity_mps(&self, at: usize) -> (f32, f32) {
        self.velocity[at]
    }

    /// Where one of them is at a moment, robot frame, m.
    pub(super) fn place(&self, moment: usize, at: usize) -> (f32, f32) {
        (self.x_m[moment][at], self.y_m[moment][at])
    }

    /// Whether nobody is near.
    pub(super) fn is_empty(&self) -> bool {
        self.count == 0
    }
}

/// Squared distance of the origin from the segment a-b.
fn nearest2_to_origin(ax: f32, ay: f32, bx: f32, by: f32) -> f32 {
    let (dx, dy) = (bx - ax, by - ay);
    let length2 = (dx * dx + dy * dy).max(1e-12);
    let share = (-(ax * dx + ay * dy) / length2).clamp(0.0, 1.0);
    let (x, y) = (ax + share * dx, ay + share * dy);
    x * x + y * y
}
