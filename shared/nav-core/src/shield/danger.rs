//! What a command leads to: what the robot could no longer stop before, and whom it meets.

use super::grid::Grid;
use super::motion::{Clock, Courses, LATE_MAX, MOMENTS, Place, UnderWay};
use super::people::People;
use super::standing::{Bump, Standing};
use super::ways::{HELD, Manoeuvre, ways_back, ways_on};
use super::{CLOSE_COST, Hazard, Intervention, STANDING_COST, TOUCH_COST};
use crate::scale::Scale;
use crate::task::Robot;
use crate::twist::Twist;

/// A slow base makes up half of the difference to its target in this share of its latency: a lag of 0.15 s where that is
/// 0.2 s.
const HALF_SHARE: f32 = 0.5;
/// A base that obeys at once, one that is as late as it may be, and one between them.
const LATENCIES: usize = 3;
/// A robot that has not come to a stand after so many fine steps is taken to stand.
const STOPPING_STEPS: usize = 200;

/// What a command meets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Met {
    hazard: Hazard,
    /// Where it is then, robot frame of now, m.
    at_m: (f32, f32),
    /// How the robot is turned then: cosine and sine.
    heading: (f32, f32),
    in_s: f32,
    /// How hard, m/s.
    speed_mps: f32,
    /// How far inside of what should be kept free of things, m.
    depth_m: f32,
    /// Somebody comes closer than with room to spare, and is not touched.
    pub(super) is_close: bool,
}

impl Met {
    /// As it is told.
    pub(super) fn intervention(&self, is_forced: bool) -> Intervention {
        let bearing_rad = libm::atan2f(self.at_m.1, self.at_m.0);
        Intervention { hazard: self.hazard, bearing_rad, in_s: self.in_s, is_forced }
    }
}

/// What stands.
#[derive(Clone, Copy)]
pub(super) struct Obstacles<'a> {
    pub(super) points: &'a Standing,
    /// A map of them, where many questions follow.
    pub(super) grid: Option<&'a Grid>,
}

impl Obstacles<'_> {
    fn are_touched(&self, place: &Place) -> bool {
        self.grid.is_none_or(|grid| grid.may_touch(place.at_m)) && self.points.is_touched(place)
    }
}

/// All that the danger of a command depends on.
pub(super) struct Danger<'a> {
    pub(super) robot: &'a Robot,
    pub(super) scale: &'a Scale,
    pub(super) clock: &'a Clock,
    /// Fine steps by which the base usually obeys late.
    pub(super) latency: usize,
    pub(super) hits: Obstacles<'a>,
    pub(super) walls: Obstacles<'a>,
    pub(super) people: &'a People,
    pub(super) under_way: UnderWay,
}

impl Danger<'_> {
    /// What is met if this is commanded now, on the best of the ways to go on; `None` where one is free. A command that
    /// is found to cost no less than `limit` is not looked at any further.
    pub(super) fn of(&self, command: Twist, limit: f32) -> Option<Met> {
        if let Some(met) = self.stopping(command) {
            return Some(met);
        }
        if self.people.is_empty() { None } else { self.going_on(command, limit) }
    }

    /// What meeting this is worth.
    pub(super) fn cost(&self, met: &Met) -> f32 {
        let soon = 1.0 - met.in_s / self.clock.horizon_s();
        match met.hazard {
            Hazard::Standing => STANDING_COST.0 + STANDING_COST.1 * (met.depth_m / self.scale.length),
            Hazard::Person if met.is_close => CLOSE_COST * soon,
            Hazard::Person => TOUCH_COST * (1.0 + soon) + met.speed_mps / self.scale.mps(1.0),
        }
    }

    /// What is touched first on the way that lasts longest, or who comes close on it.
    fn going_on(&self, command: Twist, limit: f32) -> Option<Met> {
        let mut held = Courses::<1>::new(&self.under_way, [self.latency], [1.0]);
        let mut so_far = [Way::Free];
        for moment in 0..HELD {
            self.advance(&mut held, &mut so_far, &[command.linear_mps], &[command.angular_radps], moment);
        }
        let [so_far] = so_far;
        match so_far {
            Way::Ends(met) => return Some(self.deepened(met)),
            Way::Close(met) if self.cost(&met) >= limit => return Some(met),
            Way::Close(_) | Way::Free => {}
        }
        if self.is_free_straight_on(held.split(0), so_far, command) {
            return None;
        }
        let ways_on = self.best_of(&held, so_far, &ways_on(self.robot, self.clock, command), limit)?;
        if !self.robot.reverses() {
            return Some(ways_on);
        }
        let ways_back = self.best_of(&held, so_far, &ways_back(self.robot, self.clock), limit)?;
        Some(if rank(&ways_back) > rank(&ways_on) { ways_back } else { ways_on })
    }

    /// What is met on the best of some ways from a course on.
    fn best_of<const N: usize>(
        &self,
        held: &Courses<1>,
        so_far: Way,
        manoeuvres: &[Manoeuvre; N],
        limit: f32,
    ) -> Option<Met> {
        let mut courses: Courses<N> = held.split(0);
        let mut ways = [so_far; N];
        for moment in HELD..MOMENTS {
            let target = |lane: usize| {
                let Manoeuvre { first, until, then } = manoeuvres[lane];
                if moment < until { first } else { then }
            };
            let linear_mps = core::array::from_fn(|lane| target(lane).linear_mps);
            let angular_radps = core::array::from_fn(|lane| target(lane).angular_radps);
            self.advance(&mut courses, &mut ways, &linear_mps, &angular_radps, moment);
            if ways.iter().all(|way| self.costs_at_least(way, limit)) {
                break;
            }
        }
        let mut best = ways[0].met()?;
        for way in &ways[1..] {
            let met = way.met()?;
            best = if rank(&met) > rank(&best) { met } else { best };
        }
        Some(self.deepened(best))
    }

    /// Whether a way that may yet go on cannot cost less.
    fn costs_at_least(&self, way: &Way, limit: f32) -> bool {
        match way {
            Way::Free => false,
            Way::Close(met) => self.cost(met) >= limit,
            Way::Ends(_) => true,
        }
    }

    /// Whether nobody comes near on the plainest of the ways; mostly that is so, and the others need not be looked at.
    fn is_free_straight_on(&self, mut course: Courses<1>, so_far: Way, command: Twist) -> bool {
        let mut way = [so_far];
        let mut moment = HELD;
        while moment < MOMENTS && matches!(way, [Way::Free]) {
            self.advance(&mut course, &mut way, &[command.linear_mps], &[0.0], moment);
            moment += 1;
        }
        matches!(way, [Way::Free])
    }

    /// Lets the courses that have not ended go on to a moment.
    fn advance<const N: usize>(
        &self,
        courses: &mut Courses<N>,
        ways: &mut [Way; N],
        linear_mps: &[f32; N],
        angular_radps: &[f32; N],
        moment: usize,
    ) {
        let from = *courses;
        courses.step(self.robot, linear_mps, angular_radps, self.clock.step_s[moment]);
        let near = self.people.nearness(moment + 1, &from, courses);
        for (lane, way) in ways.iter_mut().enumerate() {
            if matches!(way, Way::Ends(_)) {
                continue;
            }
            if let Some(person) = near.touched[lane] {
                *way = Way::Ends(self.meeting(courses, lane, moment, person.into(), false));
                continue;
            }
            if let (Some(person), Way::Free) = (near.close[lane], &way) {
                *way = Way::Close(self.meeting(courses, lane, moment, person.into(), true));
            }
            let place = courses.place(lane);
            if self.walls.are_touched(&place) {
                *way = Way::Ends(Met {
                    hazard: Hazard::Standing,
                    at_m: place.at_m,
                    heading: (place.cos, place.sin),
                    in_s: self.clock.at_s[moment],
                    speed_mps: courses.linear_mps(lane).abs(),
                    depth_m: 0.0,
                    is_close: false,
                });
            }
        }
    }

    /// With how far, and into what of what stands, which is worked out for the one that counts.
    fn deepened(&self, met: Met) -> Met {
        if met.hazard != Hazard::Standing {
            return met;
        }
        let (cos, sin) = met.heading;
        let Bump { at_m, depth_m } = self.walls.points.bump(&Place { at_m: met.at_m, cos, sin });
        Met { at_m, depth_m, ..met }
    }

    fn meeting<const N: usize>(
        &self,
        courses: &Courses<N>,
        lane: usize,
        moment: usize,
        person: usize,
        is_close: bool,
    ) -> Met {
        let ((vx, vy), (px, py)) = (courses.velocity_mps(lane), self.people.velocity_mps(person));
        Met {
            hazard: Hazard::Person,
            at_m: self.people.place(moment + 1, person),
            heading: (1.0, 0.0),
            in_s: self.clock.at_s[moment],
            speed_mps: libm::sqrtf((vx - px) * (vx - px) + (vy - py) * (vy - py)),
            depth_m: 0.0,
            is_close,
        }
    }

    /// Fine steps by which the base may obey late and still stop in time.
    fn latest(&self) -> usize {
        self.clock.steps(self.robot.latency_s).min(LATE_MAX)
    }

    /// What is touched if this is commanded now and the robot then stops, however late the base obeys: the deepest touch
    /// of all.
    fn stopping(&self, command: Twist) -> Option<Met> {
        let step_s = self.clock.step_s[0];
        // A base that obeys at once may be a perfect one; one that is late may be slow, too.
        let most = self.latest();
        let late = [0, most.div_ceil(2), most];
        let halves = step_s / (HALF_SHARE * self.robot.latency_s);
        let slow = 1.0 - libm::exp2f(-halves);
        let follow = core::array::from_fn(|lane| if lane == 0 { 1.0 } else { slow });
        let mut courses = Courses::<LATENCIES>::new(&self.under_way, late, follow);
        let mut deepest: Option<Met> = None;
        let footprint = &self.robot.footprint;
        let corner_m = footprint.corners().map(|_| footprint.circumradius_m());
        for step in 0..STOPPING_STEPS {
            let target = if step < self.clock.held { command } else { Twist::ZERO };
            courses.step(self.robot, &[target.linear_mps; _], &[target.angular_radps; _], step_s);
            for lane in 0..LATENCIES {
                let place = courses.place(lane);
                if self.hits.are_touched(&place) {
                    let Bump { at_m, depth_m } = self.hits.points.bump(&place);
                    let in_s = (step + 1) as f32 * step_s;
                    let speed_mps = courses.linear_mps(lane).abs();
                    let hazard = Hazard::Standing;
                    let heading = (place.cos, place.sin);
                    let met = Met { hazard, at_m, heading, in_s, speed_mps, depth_m, is_close: false };
                    if deepest.is_none_or(|deepest| met.depth_m > deepest.depth_m) {
                        deepest = Some(met);
                    }
                }
            }
            if step >= self.clock.held
                && (0..LATENCIES).all(|lane| courses.is_at_rest(lane, self.scale, corner_m))
            {
                break;
            }
        }
        deepest
    }
}

/// What has become of a course.
#[derive(Clone, Copy, Debug)]
enum Way {
    /// Nobody is near.
    Free,
    /// Somebody came close.
    Close(Met),
    /// Something was touched.
    Ends(Met),
}

impl Way {
    fn met(self) -> Option<Met> {
        match self {
            Way::Free => None,
            Way::Close(met) | Way::Ends(met) => Some(met),
        }
    }
}

/// The later the better, and the softer; better still if nothing is touched.
fn rank(met: &Met) -> (bool, f32, f32) {
    (met.is_close, met.in_s, -met.speed_mps)
}
