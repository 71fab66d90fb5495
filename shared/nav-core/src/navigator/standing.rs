//! A robot that stands: for how long, and what it has tried in vain.
//!
//! A deterministic policy that sees the same scene chooses the same again, so that without this a robot whose low
//! level does not drive off would stand until its time is over. An action whose decision came to nothing is not legal
//! again until the robot has left the place, or everything legal there has been tried. The rule is part of the mask:
//! the same in acting, exploring and the learning target.

use crate::geometry::{Point, Pose, wrap_angle};
use crate::scale::Scale;
use crate::subgoal::ActionMask;
use crate::task::ACTION_WAIT;

/// A decision that moved the robot by less came to nothing, m of the reference robot ([`Scale`]), unless it turned towards its subgoal.
pub(super) const MOVED_M: f32 = 0.1;
/// A turn by less is none, rad.
pub(super) const TURNED_RAD: f32 = 0.3;
/// Standing ends when the robot is this far from where it began, m of the reference robot.
const STANDING_M: f32 = 0.15;
/// What was tried in vain is legal again this far from where it was tried, m of the reference robot.
const LEFT_M: f32 = 0.5;
/// Waiting is legal for so long, s of the reference robot; then the robot must try something. A decision that ends early comes to nothing if
/// the robot has stood for longer.
const PATIENCE_S: f32 = 3.0;

/// What is known of the place where the robot is.
#[derive(Clone, Debug)]
pub(super) struct Standing {
    scale: Scale,
    /// Where it stands, and for how many steps.
    place: Point,
    steps: u32,
    /// Actions tried in vain, and where the first of them was.
    failed: ActionMask,
    failed_at: Point,
    /// Where the present decision began, and how far its subgoal lay off the heading then, rad.
    begun: Pose,
    off_rad: f32,
}

impl Standing {
    /// Nothing tried yet.
    pub(super) fn new(pose: Pose, scale: &Scale) -> Self {
        Self {
            scale: *scale,
            place: pose.position(),
            steps: 0,
            failed: ActionMask::default(),
            failed_at: pose.position(),
            begun: pose,
            off_rad: 0.0,
        }
    }

    /// A step later the robot is here.
    pub(super) fn step(&mut self, position: Point) {
        self.steps += 1;
        if (position - self.place).norm() > self.scale.m(STANDING_M) {
            (self.place, self.steps) = (position, 0);
        }
        if (position - self.failed_at).norm() > self.scale.m(LEFT_M) {
            (self.failed, self.failed_at) = (ActionMask::default(), position);
        }
    }

    /// For how many steps it has stood.
    pub(super) fn steps(&self) -> u32 {
        self.steps
    }

    /// A decision for a subgoal begins.
    pub(super) fn begin(&mut self, pose: Pose, subgoal: Point) {
        (self.begun, self.off_rad) = (pose, off_rad(pose, subgoal));
    }

    /// A decision for a subgoal has ended. `ran_out`: it was stuck, or held for as long as it may be.
    pub(super) fn end(&mut self, action: usize, subgoal: Point, pose: Pose, ran_out: bool, period_s: f32) {
        let moved = (pose.position() - self.begun.position()).norm() >= self.scale.m(MOVED_M);
        let turned = self.off_rad - off_rad(pose, subgoal) >= TURNED_RAD;
        let is_long = self.steps as f32 * period_s >= self.scale.s(PATIENCE_S);
        if action == ACTION_WAIT || moved || turned || !(ran_out || is_long) {
            return;
        }
        if self.failed == ActionMask::default() {
            self.failed_at = pose.position();
        }
        self.failed.0 |= 1 << action;
    }

    /// The legal actions less those that were tried in vain; where nothing is left, all may be tried again, the last
    /// one not at once.
    pub(super) fn open(&mut self, legal: ActionMask, last: Option<usize>, period_s: f32) -> ActionMask {
        let patient = self.steps as f32 * period_s < self.scale.s(PATIENCE_S);
        let legal_now = if patient { legal.0 } else { legal.0 & !(1 << ACTION_WAIT) };
        if legal_now & !self.failed.0 == 0 {
            self.failed = ActionMask(last.map_or(0, |action| 1 << action));
        }
        match legal_now & !self.failed.0 {
            0 => legal,
            open => ActionMask(open),
        }
    }
}

/// How far a point lies off a heading, rad in [0, π].
fn off_rad(pose: Pose, point: Point) -> f32 {
    wrap_angle(pose.bearing_to(point) - pose.yaw_rad).abs()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::task::{ACTION_COUNT, ACTION_GOAL};

    const PERIOD_S: f32 = 0.1;
    const AHEAD: Point = Point::new(2.0, 0.0);

    /// Stands for `steps` with `action` at `yaw_rad` and ends at `end`.
    fn try_for(standing: &mut Standing, action: usize, steps: u32, (start, end): (Pose, Pose)) {
        standing.begin(start, AHEAD);
        (0..steps).for_each(|_| standing.step(start.position()));
        standing.step(end.position());
        standing.end(action, AHEAD, end, true, PERIOD_S);
    }

    #[test]
    fn what_came_to_nothing_is_closed_until_the_place_is_left() {
        let here = Pose::default();
        let mut standing = Standing::new(here, &Scale::REFERENCE);
        try_for(&mut standing, 3, 10, (here, here));
        let open = standing.open(ActionMask::ALL, Some(3), PERIOD_S);
        assert!(!open.allows(3) && open.allows(4) && open.allows(ACTION_GOAL));
        standing.step(Point::new(0.4, 0.0));
        assert!(!standing.open(ActionMask::ALL, Some(4), PERIOD_S).allows(3), "still the same place");
        standing.step(Point::new(0.6, 0.0));
        assert!(standing.open(ActionMask::ALL, Some(4), PERIOD_S).allows(3));
    }

    #[test]
    fn driving_and_turning_towards_the_subgoal_are_not_in_vain() {
        let here = Pose::default();
        let mut standing = Standing::new(here, &Scale::REFERENCE);
        try_for(&mut standing, 0, 20, (here, Pose::new(0.12, 0.0, 0.0)));
        try_for(&mut standing, 1, 20, (Pose::new(0.0, 0.0, 3.0), Pose::new(0.0, 0.0, 1.0)));
        assert_eq!(standing.open(ActionMask::ALL, Some(1), PERIOD_S).count(), ACTION_COUNT as u32 - 1);
        try_for(&mut standing, 2, 20, (Pose::new(0.0, 0.0, 1.0), Pose::new(0.0, 0.0, 3.0)));
        assert!(!standing.open(ActionMask::ALL, Some(2), PERIOD_S).allows(2), "turning away is");
    }

    #[test]
    fn nothing_can_be_chosen_for_ever_without_moving() {
        let here = Pose::default();
        let mut standing = Standing::new(here, &Scale::REFERENCE);
        let legal = ActionMask(1 << 2 | 1 << 5 | 1 << ACTION_GOAL | 1 << ACTION_WAIT);
        let (mut last, mut counts) = (None, [0_u32; ACTION_COUNT]);
        for _ in 0..60 {
            let open = standing.open(legal, last, PERIOD_S);
            // The policy's liking never changes: waiting first, then the highest number.
            let favourite = if open.allows(ACTION_WAIT) { Some(ACTION_WAIT) } else { open.actions().last() };
            let action = favourite.expect("something is always open");
            counts[action] += 1;
            try_for(&mut standing, action, 10, (here, here));
            last = Some(action);
        }
        assert!([2, 5, ACTION_GOAL].iter().all(|&action| counts[action] > 10), "{counts:?}");
        assert!(counts[ACTION_WAIT] <= 3, "{counts:?}");
    }
}
