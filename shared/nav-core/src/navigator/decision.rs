//! The high level's side of acting: when a decision is due, what it is asked, and what carrying it out means.

use super::Navigator;
use super::standing::{MOVED_M, TURNED_RAD};
use crate::geometry::{Point, wrap_angle};
use crate::observation::{Direction, Globals, HIGH_OBSERVATION, encode_high};
use crate::subgoal::{ActionMask, CORRIDOR_CLEARANCE_M, Candidates, direction_angle_rad};
use crate::task::{ACTION_GOAL, ACTION_WAIT, DIRECTION_COUNT, Memory};

/// A WAIT lasts this long, s of the reference robot ([`crate::scale`]).
const WAIT_S: f32 = 0.5;
/// No decision ends earlier than this for a blocked corridor or a threatening person, s of the reference robot.
const HOLD_MIN_S: f32 = 0.4;
/// No decision ends earlier than this because the robot is stuck, s of the reference robot: what it did before must not
/// count.
const HOLD_STUCK_S: f32 = 1.0;
/// Visits are looked for in each direction at these distances, m of the reference robot.
const VISITS_M: [f32; 2] = [1.0, 2.5];

/// Why a new decision is due.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum DecisionReason {
    /// A new goal.
    Start,
    /// The subgoal is reached.
    Reached,
    /// Held for as long as a decision may be.
    Expired,
    /// The robot neither moves nor turns.
    Stuck,
    /// Something stands in the way to the subgoal.
    Blocked,
    /// Something closes in.
    Threat,
}

/// A decision being carried out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ActiveDecision {
    /// What was chosen.
    pub action: usize,
    /// Where to drive, `odom` frame; for WAIT the place where it was chosen.
    pub subgoal: Point,
    /// Ticks since it was chosen.
    pub held_ticks: u32,
}

impl Navigator {
    /// The decision being carried out.
    pub fn decision(&self) -> Option<&ActiveDecision> {
        self.decision.as_ref()
    }

    /// Why a new decision is due now, if one is.
    pub fn decision_due(&self) -> Option<DecisionReason> {
        let Some(decision) = &self.decision else { return Some(DecisionReason::Start) };
        let limits = &self.task.decision;
        let has_held = |time_s: f32| decision.held_ticks >= self.task.ticks(time_s);
        if decision.action == ACTION_WAIT {
            return has_held(self.scale.s(WAIT_S)).then_some(DecisionReason::Expired);
        }
        if has_held(limits.hold_s) {
            return Some(DecisionReason::Expired);
        }
        let to_subgoal = decision.subgoal - self.pose.position();
        let rest_m = to_subgoal.norm();
        if decision.action != ACTION_GOAL && rest_m < limits.subgoal_reached_m {
            return Some(DecisionReason::Reached);
        }
        if !has_held(self.scale.s(HOLD_MIN_S)) {
            return None;
        }
        if has_held(self.scale.s(HOLD_STUCK_S)) && self.is_stuck() {
            return Some(DecisionReason::Stuck);
        }
        if decision.action != ACTION_GOAL && self.is_blocked(decision.subgoal, rest_m) {
            return Some(DecisionReason::Blocked);
        }
        let contact_s = self.closing.time_to_contact_s(&self.geometry, self.velocity.linear_mps);
        (contact_s < limits.time_to_collision_s).then_some(DecisionReason::Threat)
    }

    /// Whether the robot is about where, and headed about as, it was [a while](super::STUCK_S) ago.
    fn is_stuck(&self) -> bool {
        let oldest = self.trail.oldest();
        (self.pose.position() - oldest.position()).norm() < self.scale.m(MOVED_M)
            && wrap_angle(self.pose.yaw_rad - oldest.yaw_rad).abs() < TURNED_RAD
    }

    /// Notes what has come of the decision that ends now, if one does.
    fn end_decision(&mut self) {
        if let (Some(decision), Some(reason)) = (self.decision, self.decision_due()) {
            let ran_out = matches!(reason, DecisionReason::Stuck | DecisionReason::Expired);
            let period_s = self.task.control_period_s;
            self.standing.end(decision.action, decision.subgoal, self.pose, ran_out, period_s);
        }
    }

    fn is_blocked(&self, subgoal: Point, rest_m: f32) -> bool {
        let local = self.pose.local_from_parent(subgoal);
        let (cos, sin) = (local.x / rest_m.max(1e-3), local.y / rest_m.max(1e-3));
        let lane = self.task.robot.footprint.lane(0.5 * self.scale.m(CORRIDOR_CLEARANCE_M));
        self.scan.corridor_m(cos, sin, &lane, rest_m) < 0.8 * rest_m
    }

    /// Measures the candidates, updates the geodesic and encodes the high-level observation. Called once between two
    /// calls of [`Self::commit`].
    pub fn prepare_decision(&mut self) -> (&[f32; HIGH_OBSERVATION], ActionMask) {
        self.end_decision();
        let position = self.pose.position();
        let goal_course_rad = self.pose.bearing_to(self.goal);
        let goal_bearing_rad = wrap_angle(goal_course_rad - self.pose.yaw_rad);
        let mut candidates = Candidates::measure(&self.task, &self.scan, goal_bearing_rad);
        candidates.mask = self.standing.open(candidates.mask, self.last_action, self.task.control_period_s);
        let remembers = self.task.decision.memory == Memory::Full;
        let mut here_m = None;
        if remembers {
            // A gain is at most a whole subgoal distance either way.
            let farther_m = self.task.decision.subgoal_distance_m;
            self.geodesic.update(&self.map, self.goal, position, farther_m);
            here_m = self.geodesic.distance_m(position);
        }
        let visits_m = VISITS_M.map(|m| self.scale.m(m));
        let mut directions = [Direction::default(); DIRECTION_COUNT];
        for (k, direction) in directions.iter_mut().enumerate() {
            let (sin, cos) = libm::sincosf(goal_course_rad + direction_angle_rad(k));
            let at =
                |distance_m: f32| Point::new(position.x + distance_m * cos, position.y + distance_m * sin);
            let there_m = here_m.and_then(|_| self.geodesic.distance_m(at(candidates.distance_m[k])));
            *direction = Direction {
                corridor_m: candidates.corridor_m[k],
                geodesic_gain: match (here_m, there_m) {
                    (Some(here), Some(there)) => {
                        ((here - there) / self.task.decision.subgoal_distance_m).clamp(-1.0, 1.0)
                    }
                    _ => 0.0,
                },
                visits_near: self.map.visit_density(at(visits_m[0])),
                visits_far: self.map.visit_density(at(visits_m[1])),
                closing_mps: self.closing.towards_mps(goal_bearing_rad + direction_angle_rad(k)),
                is_legal: candidates.mask.allows(k),
            };
        }
        let distance_m = self.goal_distance_m();
        let last_direction = self.last_action.filter(|&action| action < DIRECTION_COUNT);
        let globals = Globals {
            goal_distance_m: distance_m,
            heading_rad: -goal_bearing_rad,
            last_direction_rad: last_direction.map(|_| self.last_bearing_rad - goal_course_rad),
            last_was_goal: self.last_action == Some(ACTION_GOAL),
            last_was_wait: self.last_action == Some(ACTION_WAIT),
            elapsed: self.steps as f32 * self.task.control_period_s / self.task.decision.horizon_s,
            standing_s: self.standing.steps() as f32 * self.task.control_period_s,
            setback_m: distance_m - self.best_distance_m,
            detour_m: here_m.map_or(0.0, |here| here - distance_m),
            speed: self.velocity.linear_mps / self.task.robot.linear_max_mps,
        };
        encode_high(&self.scale, &directions, &globals, &mut self.high);
        self.candidates = Some(candidates);
        (&self.high, candidates.mask)
    }

    /// Carries out `action` from now on. The subgoal stays fixed in the `odom` frame. An action that is not
    /// legal now (or no candidates were prepared in this tick) becomes GOAL.
    pub fn commit(&mut self, action: usize) {
        let position = self.pose.position();
        let legal = self.candidates.filter(|candidates| candidates.mask.allows(action));
        let (action, subgoal) = match legal {
            Some(candidates) if action < DIRECTION_COUNT => {
                let course_rad = self.pose.bearing_to(self.goal) + direction_angle_rad(action);
                let (sin, cos) = libm::sincosf(course_rad);
                let distance_m = candidates.distance_m[action];
                self.last_bearing_rad = course_rad;
                (action, Point::new(position.x + distance_m * cos, position.y + distance_m * sin))
            }
            Some(_) if action == ACTION_WAIT => (ACTION_WAIT, position),
            _ => (ACTION_GOAL, self.goal),
        };
        self.last_action = Some(action);
        self.decision = Some(ActiveDecision { action, subgoal, held_ticks: 0 });
        self.standing.begin(self.pose, subgoal);
    }

    /// Whether the low level drives now; WAIT stands still without asking it.
    pub fn is_waiting(&self) -> bool {
        self.decision.is_some_and(|decision| decision.action == ACTION_WAIT)
    }
}
