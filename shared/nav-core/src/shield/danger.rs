//! What a command leads to: what the robot could no longer stop before, and whom it meets.

use super::motion::{Clock, Course, MOMENTS, Manoeuvre, UnderWay};
use super::people::People;
use super::standing::Standing;
use super::{CLOSE_COST, Hazard, Intervention, STANDING_COST, TOUCH_COST};
use crate::observation::SENT_COMMANDS;
use crate::task::Robot;
use crate::twist::Twist;
use core::f32::consts::FRAC_PI_2;

/// Moments for which the command of now is held before another follows: so early is something done about people.
const HELD: usize = 8;
/// Share of the difference to its target that a slow base makes up in a fine step: a lag of 0.15 s.
const SLOW_FOLLOW: f32 = 0.5;
/// A robot that has not come to a stand after so many fine steps is taken to stand.
const STOPPING_STEPS: usize = 200;

/// What a command meets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Met {
    hazard: Hazard,
    bearing_rad: f32,
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
        Intervention { hazard: self.hazard, bearing_rad: self.bearing_rad, in_s: self.in_s, is_forced }
    }
}

/// All that the danger of a command depends on.
pub(super) struct Danger<'a> {
    pub(super) robot: &'a Robot,
    pub(super) clock: &'a Clock,
    /// Fine steps by which the base usually obeys late.
    pub(super) latency: usize,
    pub(super) hits: &'a Standing,
    pub(super) walls: &'a Standing,
    pub(super) people: &'a People,
    pub(super) under_way: UnderWay,
}

impl Danger<'_> {
    /// Steps by which the base may obey late and still stop in time.
    pub(super) const LATENCY_MAX: usize = SENT_COMMANDS;

    /// What is met if this is commanded now, on the best of the ways to go on; `None` where one is free.
    pub(super) fn of(&self, command: Twist) -> Option<Met> {
        if let Some(met) = self.stopping(command) {
            return Some(met);
        }
        if self.people.is_empty() {
            return None;
        }
        let mut best: Option<Met> = None;
        for manoeuvre in self.ways_on(command) {
            let met = self.on(&manoeuvre)?;
            let rank = |met: &Met| (met.is_close, met.in_s, -met.speed_mps);
            if best.is_none_or(|best| rank(&met) > rank(&best)) {
                best = Some(met);
            }
        }
        best
    }

    /// What meeting this is worth.
    pub(super) fn cost(&self, met: &Met) -> f32 {
        let soon = 1.0 - met.in_s / self.clock.horizon_s();
        match met.hazard {
            Hazard::Standing => STANDING_COST.0 + STANDING_COST.1 * met.depth_m,
            Hazard::Person if met.is_close => CLOSE_COST * soon,
            Hazard::Person => TOUCH_COST * (1.0 + soon) + met.speed_mps,
        }
    }

    /// The ways to go on after a command that is held for a while.
    fn ways_on(&self, command: Twist) -> [Manoeuvre; 12] {
        let (v, w) = (self.robot.linear_max_mps, self.robot.angular_max_radps);
        let then = |a: Twist, until: usize, b: Twist| Manoeuvre {
            phases: [(command, HELD), (a, until), (b, MOMENTS)],
        };
        // At the fastest turning rate.
        let quarter = self.clock.moments_within(FRAC_PI_2 / w);
        let eighth = self.clock.moments_within(0.5 * FRAC_PI_2 / w);
        let long = (HELD + 4).max(quarter);
        let straight_on = Twist::new(command.linear_mps, 0.0);
        let fast = Twist::new(v, 0.0);
        [
            then(straight_on, MOMENTS, straight_on),
            then(Twist::ZERO, MOMENTS, Twist::ZERO),
            then(Twist::new(v, w), eighth, fast),
            then(Twist::new(v, -w), eighth, fast),
            then(fast, MOMENTS, fast),
            then(Twist::new(0.0, w), quarter, fast),
            then(Twist::new(0.0, -w), quarter, fast),
            then(Twist::new(0.5 * command.linear_mps, command.angular_radps), quarter, straight_on),
            then(Twist::new(0.5 * v, w), quarter, fast),
            then(Twist::new(0.5 * v, -w), quarter, fast),
            then(Twist::new(0.0, w), long, fast),
            then(Twist::new(0.0, -w), long, fast),
        ]
    }

    /// What is touched first on a manoeuvre, or who comes close if nothing is.
    fn on(&self, manoeuvre: &Manoeuvre) -> Option<Met> {
        let mut course = Course::new(&self.under_way);
        let (mut phase, mut close) = (0, None);
        for moment in 0..MOMENTS {
            while phase < 2 && moment >= manoeuvre.phases[phase].1 {
                phase += 1;
            }
            let from = course.place();
            course.step(self.robot, manoeuvre.phases[phase].0, self.latency, 1.0, self.clock.step_s[moment]);
            let (to, in_s) = (course.place(), self.clock.at_s[moment]);
            let nearness = self.people.nearness(moment + 1, from, to);
            if let Some(person) = nearness.touched {
                return Some(self.meeting(&course, moment, person, false));
            }
            if let (Some(person), None) = (nearness.close, close) {
                close = Some(self.meeting(&course, moment, person, true));
            }
            if self.walls.is_touched(to) {
                return Some(bump(self.walls, &course, in_s));
            }
        }
        close
    }

    fn meeting(&self, course: &Course, moment: usize, person: usize, is_close: bool) -> Met {
        let ((vx, vy), (px, py)) = (course.velocity_mps(), self.people.velocity_mps(person));
        let (x, y) = self.people.place(moment + 1, person);
        Met {
            hazard: Hazard::Person,
            bearing_rad: libm::atan2f(y, x),
            in_s: self.clock.at_s[moment],
            speed_mps: libm::hypotf(vx - px, vy - py),
            depth_m: 0.0,
            is_close,
        }
    }

    /// What is touched if this is commanded now and the robot then stops, however late the base obeys: the deepest touch
    /// of all.
    fn stopping(&self, command: Twist) -> Option<Met> {
        let step_s = self.clock.step_s[0];
        let mut deepest: Option<Met> = None;
        for latency in 0..=Self::LATENCY_MAX {
            // A base that obeys at once may be a perfect one; one that is late may be slow, too.
            let follow = if latency == 0 { 1.0 } else { SLOW_FOLLOW };
            let mut course = Course::new(&self.under_way);
            for step in 0..STOPPING_STEPS {
                let target = if step == 0 { command } else { Twist::ZERO };
                course.step(self.robot, target, latency, follow, step_s);
                if self.hits.is_touched(course.place()) {
                    let met = bump(self.hits, &course, (step + 1) as f32 * step_s);
                    if deepest.is_none_or(|deepest| met.depth_m > deepest.depth_m) {
                        deepest = Some(met);
                    }
                }
                if step > 0 && course.is_at_rest() {
                    break;
                }
            }
        }
        deepest
    }
}

fn bump(standing: &Standing, course: &Course, in_s: f32) -> Met {
    let bump = standing.bump(course.place());
    Met {
        hazard: Hazard::Standing,
        bearing_rad: libm::atan2f(bump.y_m, bump.x_m),
        in_s,
        speed_mps: course.linear_mps().abs(),
        depth_m: bump.depth_m,
        is_close: false,
    }
}
