//! The high level's choices at one moment: where each direction's subgoal would lie, and which are legal.
//!
//! Direction `k` points `k * 22.5` degrees counter-clockwise from the goal's direction. Its subgoal lies
//! `subgoal_distance_m` away, or as far as the corridor allows less a margin. The same mask serves acting,
//! exploring and both sides of the learning target.

use crate::scan::ScanView;
use crate::task::{
    ACTION_COUNT, ACTION_GOAL, ACTION_WAIT, CORRIDOR_LIMIT_M, DIRECTION_COUNT, SUBGOAL_MIN_M, Task,
};
use core::f32::consts::TAU;

/// Added to the footprint when a corridor is measured, m of the reference robot ([`crate::scale`]).
pub const CORRIDOR_CLEARANCE_M: f32 = 0.05;
/// Where no direction is legal, because everything is near, this margin is kept instead of the task's, m of the reference
/// robot.
const TIGHT_MARGIN_M: f32 = 0.1;
/// And a subgoal must only lie this much farther away than it counts as reached, m of the reference robot.
const TIGHT_BEYOND_M: f32 = 0.05;

/// Which actions are legal: bit `a` for action `a`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ActionMask(pub u32);

impl ActionMask {
    /// Every action.
    #[cfg(test)]
    pub(crate) const ALL: Self = Self((1 << ACTION_COUNT) - 1);

    /// Whether an action is legal.
    pub const fn allows(self, action: usize) -> bool {
        action < ACTION_COUNT && self.0 >> action & 1 == 1
    }

    /// How many actions are legal.
    pub const fn count(self) -> u32 {
        self.0.count_ones()
    }

    /// The legal actions in order.
    pub fn actions(self) -> impl Iterator<Item = usize> {
        (0..ACTION_COUNT).filter(move |&action| self.allows(action))
    }

    /// The decision rule: the legal action of the highest value; GOAL unless another beats it by more than
    /// `deviation_margin`. `None` when a legal value is not finite.
    pub fn best(self, values: &[f32; ACTION_COUNT], deviation_margin: f32) -> Option<usize> {
        let mut best = None;
        for action in self.actions() {
            if !values[action].is_finite() {
                return None;
            }
            if best.is_none_or(|current: usize| values[action] > values[current]) {
                best = Some(action);
            }
        }
        let best = best?;
        let prefers_goal = self.allows(ACTION_GOAL) && values[best] - values[ACTION_GOAL] <= deviation_margin;
        Some(if prefers_goal { ACTION_GOAL } else { best })
    }
}

/// Direction `k` relative to the goal's direction, rad in [0, 2π).
pub fn direction_angle_rad(direction: usize) -> f32 {
    direction as f32 * (TAU / DIRECTION_COUNT as f32)
}

/// Corridors and subgoals of the 16 directions, in the goal-aligned frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidates {
    /// Free length of each direction's corridor, m, at most [`CORRIDOR_LIMIT_M`] (scaled).
    pub corridor_m: [f32; DIRECTION_COUNT],
    /// Distance of each direction's subgoal, m.
    pub distance_m: [f32; DIRECTION_COUNT],
    /// What may be chosen.
    pub mask: ActionMask,
}

impl Candidates {
    /// Measures the corridors; `goal_bearing_rad` is the goal's direction in the robot frame.
    pub fn measure(task: &Task, scan: &ScanView, goal_bearing_rad: f32) -> Self {
        let scale = task.scale();
        let lane = task.robot.footprint.lane(scale.m(CORRIDOR_CLEARANCE_M));
        let limit_m = scale.m(CORRIDOR_LIMIT_M);
        let mut candidates = Self {
            corridor_m: [0.0; DIRECTION_COUNT],
            distance_m: [0.0; DIRECTION_COUNT],
            mask: ActionMask(1 << ACTION_GOAL | 1 << ACTION_WAIT),
        };
        for direction in 0..DIRECTION_COUNT {
            let angle = goal_bearing_rad + direction_angle_rad(direction);
            let free_m = scan.corridor_m(libm::cosf(angle), libm::sinf(angle), &lane, limit_m);
            let distance_m =
                (free_m - task.decision.corridor_margin_m).clamp(0.0, task.decision.subgoal_distance_m);
            candidates.corridor_m[direction] = free_m;
            candidates.distance_m[direction] = distance_m;
            if distance_m >= scale.m(SUBGOAL_MIN_M) {
                candidates.mask.0 |= 1 << direction;
            }
        }
        candidates.keep_where_it_can_turn(task, scan, goal_bearing_rad);
        if candidates.mask.actions().all(|action| action >= DIRECTION_COUNT) {
            candidates.make_do(task);
        }
        candidates
    }

    /// Leaves the directions that the robot can turn to on the spot or on its way, if there are any: between walls that are
    /// nearer than its corners reach, those are ahead, and behind if it reverses. Where there is none it must try what it can.
    fn keep_where_it_can_turn(&mut self, task: &Task, scan: &ScanView, goal_bearing_rad: f32) {
        let robot = &task.robot;
        let turns = scan.turns(&robot.footprint);
        let leads = |direction: usize| {
            turns.lead_to(goal_bearing_rad + direction_angle_rad(direction), robot.reverses())
        };
        let (all, directions) = (self.mask.0, (1 << DIRECTION_COUNT) - 1);
        let kept = (0..DIRECTION_COUNT)
            .filter(|&direction| self.mask.allows(direction) && !leads(direction))
            .fold(all, |kept, direction| kept & !(1 << direction));
        if kept & directions != 0 {
            self.mask.0 = kept;
        }
    }

    /// Shorter subgoals and less margin, so that a robot in a tight place has somewhere to go.
    fn make_do(&mut self, task: &Task) {
        let scale = task.scale();
        let margin_m = scale.m(TIGHT_MARGIN_M).min(task.decision.corridor_margin_m);
        for direction in 0..DIRECTION_COUNT {
            let distance_m = self.corridor_m[direction] - margin_m;
            if distance_m >= task.decision.subgoal_reached_m + scale.m(TIGHT_BEYOND_M) {
                self.distance_m[direction] = distance_m;
                self.mask.0 |= 1 << direction;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn goal_is_left_only_for_more_than_the_margin() {
        let mut values = [0.0; ACTION_COUNT];
        values[3] = 1.0;
        values[5] = 2.0;
        let mask = ActionMask(1 << 3 | 1 << ACTION_GOAL);
        assert_eq!(mask.best(&values, 0.5), Some(3), "5 is the best, but illegal");
        assert_eq!(mask.best(&values, 1.0), Some(ACTION_GOAL));
        values[ACTION_GOAL] = f32::NAN;
        assert_eq!(mask.best(&values, 0.0), None);
        values[ACTION_GOAL] = 0.0;
        values[9] = f32::NAN;
        assert_eq!(mask.best(&values, 0.0), Some(3), "an illegal value does not matter");
    }
}
