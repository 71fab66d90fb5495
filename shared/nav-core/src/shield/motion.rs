//! Where the robot will be: commands under way, latency, acceleration limits.

use crate::scale::Scale;
use crate::sent::Sent;
use crate::task::{Robot, Task};
use crate::twist::Twist;

/// Moments at which a course is looked at, the present not among them.
pub(super) const MOMENTS: usize = 20;
/// So many of them follow each other at the fine step, the rest at three times that: 4 s in all at a period of 0.1 s.
const FINE_MOMENTS: usize = 10;
/// Slower is standing, m/s of the reference robot ([`Scale`]).
const REST_MPS: f32 = 0.02;
/// The fine step is the control period, or a part or a multiple of it, within these bounds, s of the reference robot...
const FINE_STEP_S: [f32; 2] = [0.08, 0.12];
/// ...and these, s, because people do not slow down with the robot...
const PEOPLE_STEP_S: [f32; 2] = [0.2, 0.3];
/// ...unless the base is so late that more of them would pass until it obeys.
pub(super) const LATE_MAX: usize = 4;

/// The moments at which courses are looked at.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clock {
    /// From the moment before, s.
    pub(super) step_s: [f32; MOMENTS],
    /// From now, s.
    pub(super) at_s: [f32; MOMENTS],
    /// Fine steps for which a command is held before another can follow.
    pub(super) held: usize,
    /// Control periods in a fine step; 1 where it is a part of one.
    ticks: usize,
}

impl Clock {
    /// Moments for the robot and the control period of a task.
    pub(super) fn new(task: &Task) -> Self {
        let (period_s, scale) = (task.control_period_s, task.scale());
        let late_s = task.robot.latency_s / LATE_MAX as f32;
        let bound_s = |at: usize| scale.s(FINE_STEP_S[at]).min(PEOPLE_STEP_S[at]);
        let (least_s, most_s) = (bound_s(0).max(late_s), bound_s(1).max(1.5 * late_s));
        let parts = libm::ceilf(period_s / most_s).max(1.0);
        let part_s = period_s / parts;
        let fine_s = part_s * libm::ceilf(least_s / part_s).max(1.0);
        let (mut step_s, mut at_s, mut now_s) = ([0.0; MOMENTS], [0.0; MOMENTS], 0.0);
        for moment in 0..MOMENTS {
            step_s[moment] = if moment < FINE_MOMENTS { fine_s } else { 3.0 * fine_s };
            now_s += step_s[moment];
            at_s[moment] = now_s;
        }
        let held = (libm::roundf(period_s / fine_s) as usize).max(1);
        let ticks = (libm::roundf(fine_s / period_s) as usize).max(1);
        Self { step_s, at_s, held, ticks }
    }

    /// The last moment, s.
    pub(super) fn horizon_s(&self) -> f32 {
        self.at_s[MOMENTS - 1]
    }

    /// A time in fine steps, rounded up.
    pub(super) fn steps(&self, time_s: f32) -> usize {
        libm::ceilf(time_s / self.step_s[0] - 1e-3) as usize
    }

    /// The commands of the last fine steps, newest first.
    pub(super) fn commands(&self, sent: &Sent) -> [Twist; LATE_MAX] {
        core::array::from_fn(|step| sent.mean(step / self.held * self.ticks, self.ticks))
    }

    /// How many moments lie within a time from now, s.
    pub(super) fn moments_within(&self, time_s: f32) -> usize {
        self.at_s.iter().filter(|at_s| **at_s <= time_s).count()
    }
}

/// What the base is about to do, whatever is decided now.
#[derive(Clone, Copy, Debug)]
pub(super) struct UnderWay {
    /// What it does now.
    pub(super) measured: Twist,
    /// The commands of the last fine steps, newest first.
    pub(super) sent: [Twist; LATE_MAX],
}

/// Where a robot is on a course, in the robot frame of now.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    /// Where its centre is, m.
    pub(super) at_m: (f32, f32),
    /// Which way it looks.
    pub(super) cos: f32,
    /// Which way it looks.
    pub(super) sin: f32,
}

impl Place {
    /// A point of the robot frame of now, seen from there, m.
    pub(super) fn seen(&self, (x_m, y_m): (f32, f32)) -> (f32, f32) {
        let (dx, dy) = (x_m - self.at_m.0, y_m - self.at_m.1);
        (self.cos * dx + self.sin * dy, self.cos * dy - self.sin * dx)
    }
}

/// Robots on `N` courses side by side, in the robot frame of now.
#[derive(Clone, Copy, Debug)]
pub(super) struct Courses<const N: usize> {
    pub(super) x_m: [f32; N],
    pub(super) y_m: [f32; N],
    cos: [f32; N],
    sin: [f32; N],
    linear: Axis<N>,
    angular: Axis<N>,
    /// Steps by which each base obeys late...
    late: [usize; N],
    /// ...and the share of the difference to its target that it makes up in a step.
    follow: [f32; N],
}

impl<const N: usize> Courses<N> {
    /// Where the robot is now.
    pub(super) fn new(under_way: &UnderWay, late: [usize; N], follow: [f32; N]) -> Self {
        let sent = |part: fn(&Twist) -> f32| {
            let mut commands = [[part(&under_way.sent[LATE_MAX - 1]); N]; LATE_MAX + 1];
            for (command, sent) in commands.iter_mut().zip(&under_way.sent) {
                *command = [part(sent); N];
            }
            commands
        };
        let UnderWay { measured, .. } = under_way;
        Self {
            x_m: [0.0; N],
            y_m: [0.0; N],
            cos: [1.0; N],
            sin: [0.0; N],
            linear: Axis { now: [measured.linear_mps; N], commands: sent(|twist| twist.linear_mps) },
            angular: Axis { now: [measured.angular_radps; N], commands: sent(|twist| twist.angular_radps) },
            late,
            follow,
        }
    }

    /// `M` of them that go on from one of these.
    pub(super) fn split<const M: usize>(&self, lane: usize) -> Courses<M> {
        Courses {
            x_m: [self.x_m[lane]; M],
            y_m: [self.y_m[lane]; M],
            cos: [self.cos[lane]; M],
            sin: [self.sin[lane]; M],
            linear: self.linear.split(lane),
            angular: self.angular.split(lane),
            late: [self.late[lane]; M],
            follow: [self.follow[lane]; M],
        }
    }

    /// Goes on for `step_s` with commands towards these targets, m/s and rad/s, within the robot's acceleration limits.
    pub(super) fn step(
        &mut self,
        robot: &Robot,
        linear_mps: &[f32; N],
        angular_radps: &[f32; N],
        step_s: f32,
    ) {
        let (late, follow) = (&self.late, &self.follow);
        let linear_mps = self.linear.step(linear_mps, late, follow, robot.linear_acceleration_mps2 * step_s);
        let angular_radps =
            self.angular.step(angular_radps, late, follow, robot.angular_acceleration_radps2 * step_s);
        for lane in 0..N {
            let way_m = linear_mps[lane] * step_s;
            let (half_sin, half_cos) = small_sincos(0.5 * angular_radps[lane] * step_s);
            // The chord of the arc points half of the turn away from the heading.
            let (cos, sin) = turned(self.cos[lane], self.sin[lane], half_cos, half_sin);
            self.x_m[lane] += way_m * cos;
            self.y_m[lane] += way_m * sin;
            (self.cos[lane], self.sin[lane]) = turned(cos, sin, half_cos, half_sin);
        }
    }

    /// Where one of them is, and how it is turned.
    pub(super) fn place(&self, lane: usize) -> Place {
        Place { at_m: (self.x_m[lane], self.y_m[lane]), cos: self.cos[lane], sin: self.sin[lane] }
    }

    /// Its speed along the heading, m/s.
    pub(super) fn linear_mps(&self, lane: usize) -> f32 {
        self.linear.now[lane]
    }

    /// Its velocity, m/s.
    pub(super) fn velocity_mps(&self, lane: usize) -> (f32, f32) {
        (self.linear.now[lane] * self.cos[lane], self.linear.now[lane] * self.sin[lane])
    }

    /// Whether it stands, and no command will change that. A disc may turn where it stands; the corners of a rectangle, which
    /// reach `corner_m` from where it turns, move.
    pub(super) fn is_at_rest(&self, lane: usize, scale: &Scale, corner_m: Option<f32>) -> bool {
        let latest = self.late.iter().fold(0, |most, late| most.max(*late));
        let rests = |axis: &Axis<N>, reach_m: f32| {
            let rests = |speed: f32| (reach_m * speed).abs() < scale.mps(REST_MPS);
            rests(axis.now[lane]) && axis.commands[..=latest].iter().all(|command| rests(command[lane]))
        };
        rests(&self.linear, 1.0) && corner_m.is_none_or(|corner_m| rests(&self.angular, corner_m))
    }
}

/// Speeds or turning rates of the bases, and the commands that they have yet to obey, newest first.
#[derive(Clone, Copy, Debug)]
struct Axis<const N: usize> {
    now: [f32; N],
    commands: [[f32; N]; LATE_MAX + 1],
}

impl<const N: usize> Axis<N> {
    fn split<const M: usize>(&self, lane: usize) -> Axis<M> {
        Axis { now: [self.now[lane]; M], commands: self.commands.map(|command| [command[lane]; M]) }
    }

    /// The means over a step in which commands and bases change by no more than `change`.
    fn step(&mut self, targets: &[f32; N], late: &[usize; N], follow: &[f32; N], change: f32) -> [f32; N] {
        let mut means = [0.0; N];
        self.commands.rotate_right(1);
        let [newest, last, ..] = &mut self.commands;
        for ((command, last), target) in newest.iter_mut().zip(last).zip(targets) {
            *command = within(*target, *last, change);
        }
        let obeyed = if late.iter().all(|steps| *steps == late[0]) {
            self.commands[late[0]]
        } else {
            core::array::from_fn(|lane| self.commands[late[lane]][lane])
        };
        for lane in 0..N {
            let now = self.now[lane];
            let next = within(now + follow[lane] * (obeyed[lane] - now), now, change);
            means[lane] = 0.5 * (now + next);
            self.now[lane] = next;
        }
        means
    }
}

/// As near to a target as a change from the last value allows; as [`Robot::ramped`], without its branches.
fn within(target: f32, last: f32, change: f32) -> f32 {
    target.max(last - change).min(last + change)
}

fn turned(cos: f32, sin: f32, by_cos: f32, by_sin: f32) -> (f32, f32) {
    (cos * by_cos - sin * by_sin, sin * by_cos + cos * by_sin)
}

/// Sine and cosine of the half turn of a step: to 1e-6 up to 0.5 rad, to 1e-3 up to 1.3 rad.
fn small_sincos(angle_rad: f32) -> (f32, f32) {
    let square = angle_rad * angle_rad;
    let sin = angle_rad * (1.0 - square / 6.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0)));
    let cos = 1.0 - square / 2.0 * (1.0 - square / 12.0 * (1.0 - square / 30.0));
    (sin, cos)
}
