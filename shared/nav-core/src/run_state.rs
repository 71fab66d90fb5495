//! When the robot is in which state: decided anew in each tick, from its faults and from whether the goal is
//! reached.
//!
//! ```text
//!          1 no stopping fault                3 the goal is reached
//!  ┌───────┐ ───────────────▶ ┌─────────┐ ──────────────────────▶ ┌─────────┐
//!  │ Ready │                  │ Driving │                         │ Reached │
//!  └───────┘ ◀─────────────── └─────────┘ ◀────────────────────── └─────────┘
//!          2 input is missing              4 another goal, not reached
//!
//!      5 a fault beyond missing input, from any state         ┌─────────┐
//!     ──────────────────────────────────────────────────────▶ │ Stopped │
//!     ◀────────────────────────────────────────────────────── └─────────┘
//!      6 it is over: to Driving or Reached; to Ready if input is missing now
//! ```
//! 2 leads to Ready from Reached, too, and 1 from Ready to Reached at once where the goal is near. Driving commands
//! what the policy wishes; the other three command a ramp to zero.

use crate::messages::{RunState, fault};

/// The state of a tick with these [`fault`] bits; `goal_reached` matters only while nothing stops the robot.
pub const fn run_state(faults: u32, goal_reached: bool) -> RunState {
    match faults & fault::STOPPING {
        0 if goal_reached => RunState::Reached,
        0 => RunState::Driving,
        stopping if stopping & !fault::MISSING == 0 => RunState::Ready,
        _ => RunState::Stopped,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Faults of a tick, and whether its goal is reached.
    type Moment = (u32, bool);

    #[test]
    fn transitions_are_as_drawn() {
        use RunState::{Driving, Reached, Ready, Stopped};
        const WAITING: Moment = (fault::STALE_ODOM, false);
        const UNDER_WAY: Moment = (fault::SPEED_LIMITED | fault::ACCELERATION_LIMITED, false);
        const ARRIVED: Moment = (0, true);
        const ILL: Moment = (fault::BAD_CLOCK | fault::STALE_ODOM, true);
        let drawn = [
            (1, (Ready, WAITING), (Driving, UNDER_WAY)),
            (1, (Ready, WAITING), (Reached, ARRIVED)),
            (2, (Driving, UNDER_WAY), (Ready, WAITING)),
            (2, (Reached, ARRIVED), (Ready, (fault::NO_GOAL | fault::STALE_SCAN, true))),
            (3, (Driving, UNDER_WAY), (Reached, ARRIVED)),
            (4, (Reached, ARRIVED), (Driving, UNDER_WAY)),
            (5, (Ready, WAITING), (Stopped, ILL)),
            (5, (Driving, UNDER_WAY), (Stopped, (fault::NON_FINITE, false))),
            (5, (Reached, ARRIVED), (Stopped, (fault::BAD_SCAN, true))),
            (6, (Stopped, ILL), (Driving, UNDER_WAY)),
            (6, (Stopped, ILL), (Reached, ARRIVED)),
            (6, (Stopped, ILL), (Ready, WAITING)),
        ];
        for (number, (from, before), (to, now)) in drawn {
            assert_eq!(run_state(before.0, before.1), from, "before transition {number}");
            assert_eq!(run_state(now.0, now.1), to, "after transition {number}");
        }
    }

    #[test]
    fn only_what_is_missing_leaves_the_robot_ready() {
        for faults in 0..1 << fault::NAMES.len() {
            let stopping = faults & fault::STOPPING;
            for goal_reached in [false, true] {
                let state = run_state(faults, goal_reached);
                assert_eq!(
                    stopping == 0,
                    matches!(state, RunState::Driving | RunState::Reached),
                    "{faults:b}"
                );
                let only_missing = stopping != 0 && stopping & !fault::MISSING == 0;
                assert_eq!(only_missing, state == RunState::Ready, "{faults:b}");
            }
        }
    }
}
