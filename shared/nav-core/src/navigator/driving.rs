//! The low level's side of acting: what it sees, and what its choice means.

use super::Navigator;
use crate::geometry::{Point, wrap_angle};
use crate::observation::{LOW_ACTION, LOW_OBSERVATION, Motion, Target, encode_low};
use crate::sent::Sent;
use crate::task::DIRECTION_COUNT;
use crate::twist::Twist;

impl Navigator {
    /// The low-level observation towards the decision's subgoal, or the goal when there is none.
    pub fn encode_low(&self, sent: &Sent, observation: &mut [f32; LOW_OBSERVATION]) {
        let target = match &self.decision {
            Some(decision) if decision.action < DIRECTION_COUNT => decision.subgoal,
            _ => self.goal,
        };
        self.encode_low_towards(target, sent, observation);
    }

    /// The low-level observation towards any target of the `odom` frame.
    pub fn encode_low_towards(&self, target: Point, sent: &Sent, observation: &mut [f32; LOW_OBSERVATION]) {
        let target = Target {
            distance_m: (target - self.pose.position()).norm(),
            bearing_rad: wrap_angle(self.pose.bearing_to(target) - self.pose.yaw_rad),
        };
        let (now, before) = (self.clearance.newest(), self.clearance.oldest());
        let motion = Motion { measured: self.velocity, sent: sent.seen(self.rhythm.step as usize) };
        encode_low(&self.task, now, before, target, &motion, observation);
    }

    /// What a low-level action in [-1, 1] means. Nothing drives forward where something touches ahead, or where nothing
    /// is known, and nothing backwards where it is so behind.
    pub fn decode_low(&self, action: [f32; LOW_ACTION]) -> Twist {
        let robot = &self.task.robot;
        let mut linear_mps = robot.linear_of(action[0]);
        if self.scan.is_closed_ahead() {
            linear_mps = linear_mps.min(0.0);
        }
        if robot.reverses() && self.scan.is_closed_behind() {
            linear_mps = linear_mps.max(0.0);
        }
        Twist::new(linear_mps, action[1] * robot.angular_max_radps)
    }
}
