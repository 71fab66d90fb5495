//! The commands that are tried in place of a wish.

use crate::task::Robot;
use crate::twist::Twist;
use heapless::Vec;

/// Forward speeds that are tried, from standing to the fastest.
const SPEEDS: usize = 5;
/// Speeds backwards, likewise, for a robot that can.
const SPEEDS_BACK: usize = 3;
/// Turning rates that are tried, from one limit to the other.
const TURNS: usize = 9;
const CANDIDATES: usize = (SPEEDS + SPEEDS_BACK - 1) * TURNS;
/// What a wish's whole speed is worth...
const SPEED_COST: f32 = 0.5;
/// ...and its whole turning rate, from straight to the limit.
const TURN_COST: f32 = 0.1;

/// Where the robot may drive: not where something touches it, or nothing is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Open {
    /// Forward.
    pub ahead: bool,
    /// Backwards.
    pub behind: bool,
}

/// Commands to be tried, and how far from the wish each of them is: every second of the lattice first, and of these
/// and the others the nearest first.
pub(super) fn candidates(robot: &Robot, wish: Twist, open: Open) -> Vec<(f32, Twist), CANDIDATES> {
    let mut candidates: Vec<_, CANDIDATES> = Vec::new();
    let share = |part: usize, parts: usize| part as f32 / (parts - 1) as f32;
    let ahead =
        (1..SPEEDS).filter(|_| open.ahead).map(|part| (part, robot.linear_max_mps * share(part, SPEEDS)));
    let behind = (1..SPEEDS_BACK)
        .filter(|_| open.behind && robot.reverses())
        .map(|part| (part, robot.linear_min_mps * share(part, SPEEDS_BACK)));
    for (speed, linear_mps) in core::iter::once((0, 0.0)).chain(ahead).chain(behind) {
        for turn in 0..TURNS {
            let angular_radps = robot.angular_max_radps * (2.0 * share(turn, TURNS) - 1.0);
            let away = SPEED_COST * (linear_mps - wish.linear_mps).abs() / robot.linear_max_mps
                + TURN_COST * (angular_radps - wish.angular_radps).abs() / robot.angular_max_radps;
            let is_between = speed % 2 + turn % 2 > 0;
            // There is room for all.
            let _ = candidates.push((is_between, away, Twist::new(linear_mps, angular_radps)));
        }
    }
    candidates.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    candidates.into_iter().map(|(_, away, candidate)| (away, candidate)).collect()
}
