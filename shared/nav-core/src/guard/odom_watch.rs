//! Odometry that cannot be true: a pose that jumps, or one that stands still while the robot moves.

use super::cause::Cause;
use crate::geometry::{Pose, wrap_angle};
use crate::messages::{Goal, Odometry};
use crate::scale::Scale;
use crate::scan::SECTOR_COUNT;
use crate::task::Robot;
use crate::twist::Twist;

/// A robot may be this much faster than its limit before a pose is doubted.
const FASTER: f32 = 1.5;
/// A pose may be off by this much, besides: a slip, or a small correction, m of the reference robot ([`Scale`]).
const SLACK_M: f32 = 0.3;
/// The same of its heading, rad.
const SLACK_RAD: f32 = 0.3;
/// A pose that moved or turned by less stands still, m of the reference robot and rad.
const STILL: f32 = 0.02;
/// Commands above this share of the limits are meant to move the robot.
const MOVING_SHARE: f32 = 0.2;
/// A still pose is doubted after this time, s of the reference robot.
const FROZEN_AFTER_S: f32 = 1.0;
/// A sector has changed when its range did by this much, m of the reference robot.
const CHANGED_M: f32 = 0.15;

/// Watches the odometry, tick by tick.
#[derive(Clone, Debug)]
pub(super) struct OdomWatch {
    robot: Robot,
    scale: Scale,
    last: Odometry,
    /// `seq` and id of the goal when the pose jumped: until a newer one comes, goals are of the old frame.
    jumped: Option<((u64, u32), Cause)>,
    goal: (u64, u32),
    still: Option<Still>,
    frozen: Option<Cause>,
}

/// Since when the pose has stood still under commands that should move it, and what was seen then.
#[derive(Clone, Copy, Debug)]
struct Still {
    since_ns: u64,
    pose: Pose,
    sectors_m: [f32; SECTOR_COUNT],
}

impl OdomWatch {
    pub(super) fn new(robot: Robot) -> Self {
        let last = Odometry::default();
        Self { robot, scale: Scale::of(&robot), last, jumped: None, goal: (0, 0), still: None, frozen: None }
    }

    /// What cannot be true about this odometry, if anything. The robot may be set down elsewhere together with a goal of
    /// another id.
    pub(super) fn inspect(&mut self, odom: &Odometry, goal: &Goal) -> Option<Cause> {
        let goal_now = (goal.header.seq, goal.id);
        let is_new_goal = self.goal.1 != goal_now.1 || self.goal.0 == 0;
        self.goal = goal_now;
        if is_new_goal {
            (self.frozen, self.still) = (None, None);
        }
        if let Some((goal_then, _)) = self.jumped
            && goal_then != goal_now
        {
            self.jumped = None;
        }
        if odom.header.seq > self.last.header.seq {
            let jump = self.jump(odom).filter(|_| self.last.header.is_received() && !is_new_goal);
            if let Some(cause) = jump {
                self.jumped = Some((goal_now, cause));
            }
            if self.frozen.is_some() && self.has_moved(self.last.pose, odom.pose) {
                self.frozen = None;
            }
        }
        self.last = *odom;
        self.jumped.map(|(_, cause)| cause).or(self.frozen)
    }

    fn jump(&self, odom: &Odometry) -> Option<Cause> {
        let passed_s = odom.header.stamp_ns.saturating_sub(self.last.header.stamp_ns) as f32 / 1e9;
        let (before, now) = (self.last.pose, odom.pose);
        let moved =
            ((now.position() - before.position()).norm(), wrap_angle(now.yaw_rad - before.yaw_rad).abs());
        let possible = (
            FASTER * self.robot.linear_max_mps * passed_s + self.scale.m(SLACK_M),
            FASTER * self.robot.angular_max_radps * passed_s + SLACK_RAD,
        );
        (moved.0 > possible.0 || moved.1 > possible.1).then_some(Cause::Jump { moved, possible })
    }

    /// Takes in what left for the base in a tick that drove, and what was seen in it.
    pub(super) fn note(&mut self, now_ns: u64, out: Twist, sectors_m: &[f32; SECTOR_COUNT]) {
        let is_moving = out.linear_mps.abs() > MOVING_SHARE * self.robot.linear_max_mps
            || out.angular_radps.abs() > MOVING_SHARE * self.robot.angular_max_radps;
        let pose = self.last.pose;
        let goes_on = self.still.filter(|still| is_moving && !self.has_moved(still.pose, pose));
        let Some(still) = goes_on else {
            self.still = is_moving.then_some(Still { since_ns: now_ns, pose, sectors_m: *sectors_m });
            return;
        };
        let passed_ns = now_ns.saturating_sub(still.since_ns);
        let changed_m = self.scale.m(CHANGED_M);
        let pairs = still.sectors_m.iter().zip(sectors_m);
        let changed = pairs.filter(|(then, now)| (*then - *now).abs() > changed_m).count();
        if passed_ns > self.scale.ns(FROZEN_AFTER_S) && 2 * changed > SECTOR_COUNT {
            self.frozen = Some(Cause::Frozen { for_s: passed_ns as f32 / 1e9 });
        }
    }

    fn has_moved(&self, before: Pose, now: Pose) -> bool {
        (now.position() - before.position()).norm() > self.scale.m(STILL)
            || wrap_angle(now.yaw_rad - before.yaw_rad).abs() > STILL
    }
}
