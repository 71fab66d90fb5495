//! Where the robot will be: commands under way, latency, acceleration limits.

use crate::observation::{SENT_COMMANDS, Sent};
use crate::task::Robot;
use crate::twist::Twist;

/// Moments at which a course is looked at, the present not among them.
pub(super) const MOMENTS: usize = 20;
/// So many of them follow each other at the fine step, the rest at three times that: 4 s in all at a period of 0.1 s.
const FINE_MOMENTS: usize = 10;
/// Slower is standing, m/s.
const REST_MPS: f32 = 0.02;
/// The fine step is the control period, where that lies within these bounds, s.
const FINE_STEP_S: [f32; 2] = [0.08, 0.12];

/// The moments at which courses are looked at.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clock {
    /// From the moment before, s.
    pub(super) step_s: [f32; MOMENTS],
    /// From now, s.
    pub(super) at_s: [f32; MOMENTS],
}

impl Clock {
    /// Moments for a control period, s.
    pub(super) fn new(period_s: f32) -> Self {
        let parts = libm::ceilf(period_s / FINE_STEP_S[1]).max(1.0);
        let part_s = period_s / parts;
        let fine_s = part_s * libm::ceilf(FINE_STEP_S[0] / part_s).max(1.0);
        let (mut step_s, mut at_s, mut now_s) = ([0.0; MOMENTS], [0.0; MOMENTS], 0.0);
        for moment in 0..MOMENTS {
            step_s[moment] = if moment < FINE_MOMENTS { fine_s } else { 3.0 * fine_s };
            now_s += step_s[moment];
            at_s[moment] = now_s;
        }
        Self { step_s, at_s }
    }

    /// The last moment, s.
    pub(super) fn horizon_s(&self) -> f32 {
        self.at_s[MOMENTS - 1]
    }

    /// A time in fine steps, rounded up.
    pub(super) fn steps(&self, time_s: f32) -> usize {
        libm::ceilf(time_s / self.step_s[0] - 1e-3) as usize
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
    /// The last commands, newest first.
    pub(super) sent: Sent,
}

/// One after another: a target for the commands, and until which moment it stands.
#[derive(Clone, Copy, Debug)]
pub(super) struct Manoeuvre {
    /// Targets and the moments that they end with; the last one's is not looked at.
    pub(super) phases: [(Twist, usize); 3],
}

/// The robot at a moment of a course, in the robot frame of now.
#[derive(Clone, Copy, Debug)]
pub(super) struct Course {
    x_m: f32,
    y_m: f32,
    cos: f32,
    sin: f32,
    velocity: Twist,
    /// Commands, newest first: those that the base has yet to obey.
    commands: [Twist; SENT_COMMANDS + 1],
}

impl Course {
    /// Where it is now.
    pub(super) fn new(under_way: &UnderWay) -> Self {
        let mut commands = [Twist::ZERO; SENT_COMMANDS + 1];
        commands[..SENT_COMMANDS].copy_from_slice(&under_way.sent);
        commands[SENT_COMMANDS] = under_way.sent[SENT_COMMANDS - 1];
        Self { x_m: 0.0, y_m: 0.0, cos: 1.0, sin: 0.0, velocity: under_way.measured, commands }
    }

    /// Goes on for `step_s` with commands towards `target`, which the base obeys `latency` steps late, making up a share
    /// `follow` of the difference in each step.
    pub(super) fn step(&mut self, robot: &Robot, target: Twist, latency: usize, follow: f32, step_s: f32) {
        let command = robot.ramped(self.commands[0], target, step_s);
        self.commands.rotate_right(1);
        self.commands[0] = command;
        let obeyed = self.commands[latency.min(SENT_COMMANDS)];
        let towards = |now: f32, to: f32| now + follow * (to - now);
        let followed = Twist::new(
            towards(self.velocity.linear_mps, obeyed.linear_mps),
            towards(self.velocity.angular_radps, obeyed.angular_radps),
        );
        let next = robot.ramped(self.velocity, followed, step_s);
        let mean = Twist::new(
            0.5 * (self.velocity.linear_mps + next.linear_mps),
            0.5 * (self.velocity.angular_radps + next.angular_radps),
        );
        self.velocity = next;
        let way_m = mean.linear_mps * step_s;
        let (half_sin, half_cos) = small_sincos(0.5 * mean.angular_radps * step_s);
        // The chord of the arc points half of the turn away from the heading.
        let (cos, sin) = turned(self.cos, self.sin, half_cos, half_sin);
        self.x_m += way_m * cos;
        self.y_m += way_m * sin;
        (self.cos, self.sin) = turned(cos, sin, half_cos, half_sin);
    }

    /// Where, m.
    pub(super) fn place(&self) -> (f32, f32) {
        (self.x_m, self.y_m)
    }

    /// Speed along the heading, m/s.
    pub(super) fn linear_mps(&self) -> f32 {
        self.velocity.linear_mps
    }

    /// Velocity, m/s.
    pub(super) fn velocity_mps(&self) -> (f32, f32) {
        (self.velocity.linear_mps * self.cos, self.velocity.linear_mps * self.sin)
    }

    /// Whether it stands, and no command will change that.
    pub(super) fn is_at_rest(&self) -> bool {
        self.velocity.linear_mps.abs() < REST_MPS
            && self.commands.iter().all(|command| command.linear_mps.abs() < REST_MPS)
    }
}

fn turned(cos: f32, sin: f32, by_cos: f32, by_sin: f32) -> (f32, f32) {
    (cos * by_cos - sin * by_sin, sin * by_cos + cos * by_sin)
}

/// Sine and cosine; for the small turns of a step a few multiplications.
fn small_sincos(angle_rad: f32) -> (f32, f32) {
    if angle_rad.abs() > 0.25 {
        return libm::sincosf(angle_rad);
    }
    let square = angle_rad * angle_rad;
    (angle_rad * (1.0 - square / 6.0), 1.0 - square * (0.5 - square / 24.0))
}
