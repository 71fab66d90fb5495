//! The ways to go on that a command is judged by.

use super::motion::{Clock, MOMENTS};
use crate::task::Robot;
use crate::twist::Twist;
use core::f32::consts::{FRAC_PI_2, FRAC_PI_4};

/// Moments for which the command of now is held before another follows: so early is something done about people.
pub(super) const HELD: usize = 8;
/// Ways to go on, and those that lead back.
const WAYS: usize = 12;
const WAYS_BACK: usize = 4;

/// What follows on the command of now: a target until a moment, and another from then on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Manoeuvre {
    pub(super) first: Twist,
    pub(super) until: usize,
    pub(super) then: Twist,
}

/// The ways to go on after a command that is held for a while.
pub(super) fn ways_on(robot: &Robot, clock: &Clock, command: Twist) -> [Manoeuvre; WAYS] {
    let (v, w) = (robot.linear_max_mps, robot.angular_max_radps);
    let (quarter, eighth) = (turning(robot, clock, FRAC_PI_2), turning(robot, clock, FRAC_PI_4));
    let long = (HELD + 4).max(quarter);
    let straight_on = Twist::new(command.linear_mps, 0.0);
    let fast = Twist::new(v, 0.0);
    let way = |first: Twist, until: usize, then: Twist| Manoeuvre { first, until, then };
    [
        way(straight_on, MOMENTS, straight_on),
        way(Twist::ZERO, MOMENTS, Twist::ZERO),
        way(Twist::new(v, w), eighth, fast),
        way(Twist::new(v, -w), eighth, fast),
        way(fast, MOMENTS, fast),
        way(Twist::new(0.0, w), quarter, fast),
        way(Twist::new(0.0, -w), quarter, fast),
        way(Twist::new(0.5 * command.linear_mps, command.angular_radps), quarter, straight_on),
        way(Twist::new(0.5 * v, w), quarter, fast),
        way(Twist::new(0.5 * v, -w), quarter, fast),
        way(Twist::new(0.0, w), long, fast),
        way(Twist::new(0.0, -w), long, fast),
    ]
}

/// More ways, for a robot that can drive backwards.
pub(super) fn ways_back(robot: &Robot, clock: &Clock) -> [Manoeuvre; WAYS_BACK] {
    let (v, w) = (robot.linear_min_mps, robot.angular_max_radps);
    let (quarter, eighth) = (turning(robot, clock, FRAC_PI_2), turning(robot, clock, FRAC_PI_4));
    let back = Twist::new(v, 0.0);
    let way = |first: Twist, until: usize, then: Twist| Manoeuvre { first, until, then };
    [
        way(back, MOMENTS, back),
        way(back, quarter, Twist::ZERO),
        way(Twist::new(v, w), eighth, back),
        way(Twist::new(v, -w), eighth, back),
    ]
}

/// Moments that a turn by so much takes at the fastest rate.
fn turning(robot: &Robot, clock: &Clock, angle_rad: f32) -> usize {
    clock.moments_within(angle_rad / robot.angular_max_radps)
}
