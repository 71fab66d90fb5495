//! Steering of the classical rivals: towards a point, slower in turns and before obstacles. Metres and seconds of the
//! constants are those of the reference robot ([`nav_core::scale`]).

use nav_core::geometry::{Point, wrap_angle};
use nav_core::guard::Guard;
use nav_core::messages::{CmdVel, Header, RunState};
use nav_core::navigator::Navigator;
use nav_core::shield::Shield;
use nav_core::shielding::Shielding;
use nav_core::task::{ACTION_GOAL, Task};
use nav_core::tick::{Inputs, TickStatus};
use nav_core::twist::Twist;

/// Seconds in which the robot turns towards its target.
const TURN_TIME_S: f32 = 0.4;
/// A robot whose turns gather speed slowly takes at least so much of the time that its whole turning rate takes.
const TURN_UP: f32 = 1.5;
/// Free length ahead below which the robot slows down, m.
const SLOW_M: f32 = 0.8;
/// A robot that brakes badly slows down at least so many braking distances ahead.
const SLOW_BRAKING: f32 = 2.5;
/// Beside the footprint, m; and how far ahead is looked.
const BESIDE_M: f32 = 0.03;
const AHEAD_M: f32 = 2.0;
/// It stands this far before what is ahead, m.
const STOP_M: f32 = 0.05;

/// What all classical rivals share: perception, steering and the guard's limits.
pub(crate) struct Follower {
    pub(crate) navigator: Navigator,
    pub(crate) task: Task,
    guard: Guard,
    shielding: Shielding,
    commands: u64,
    goal_id: Option<u32>,
}

impl Follower {
    pub(crate) fn new(task: &Task) -> Self {
        Self {
            navigator: Navigator::new(task),
            task: *task,
            guard: Guard::new(task),
            shielding: Shielding::new(task),
            commands: 0,
            goal_id: None,
        }
    }

    /// Takes in a moment; whether a new episode begins.
    pub(crate) fn observe(&mut self, inputs: &Inputs<'_>) -> bool {
        let is_new = self.goal_id != Some(inputs.goal.id);
        self.goal_id = Some(inputs.goal.id);
        if is_new {
            self.guard.restart_from(inputs.odom.twist(), 0);
        }
        self.navigator.observe(inputs.scan, inputs.odom, inputs.goal);
        self.shielding.observe(inputs.scan, inputs.odom, &self.navigator);
        is_new
    }

    /// The safety gate, unless it is switched off.
    pub(crate) fn shield(&self) -> Option<&Shield> {
        self.shielding.shield()
    }

    /// Drives towards a point of the `odom` frame.
    pub(crate) fn towards(
        &mut self,
        now_ns: u64,
        inputs: &Inputs<'_>,
        target: Point,
    ) -> (CmdVel, TickStatus) {
        let robot = &self.task.robot;
        let pose = self.navigator.pose();
        let bearing = wrap_angle(pose.bearing_to(target) - pose.yaw_rad);
        let scale = self.task.scale();
        let lane = robot.footprint.lane(scale.m(BESIDE_M));
        let slow_m = scale.m(SLOW_M).max(SLOW_BRAKING * robot.braking_m());
        let limit_m = scale.m(AHEAD_M).max(2.0 * slow_m);
        let ahead_m = self.navigator.scan().corridor_m(1.0, 0.0, &lane, limit_m);
        let turn_up_s = robot.angular_max_radps / robot.angular_acceleration_radps2;
        let turn_s = scale.s(TURN_TIME_S).max(TURN_UP * turn_up_s);
        let angular = (bearing / turn_s).clamp(-robot.angular_max_radps, robot.angular_max_radps);
        let aligned = (1.0 - bearing.abs() / 0.9).clamp(0.0, 1.0);
        let clear = ((ahead_m - scale.m(STOP_M)) / slow_m).clamp(0.0, 1.0);
        // Like the policy, a rival stands where it believes to have arrived.
        let has_arrived = self.navigator.goal_reached();
        let driving = Twist::new(robot.linear_max_mps * aligned * clear, angular);
        let wish = robot.limited(if has_arrived { Twist::ZERO } else { driving });
        let (allowed, intervention, acted) = if has_arrived {
            (wish, None, 0)
        } else {
            self.shielding.filter(wish, inputs.odom, &self.guard, &self.navigator)
        };
        let (out, limited) = self.guard.limit(allowed);
        let faults = limited | acted;
        let state = if has_arrived { RunState::Reached } else { RunState::Driving };
        self.commands += 1;
        let command = CmdVel {
            header: Header { stamp_ns: now_ns, seq: self.commands },
            linear_mps: out.linear_mps,
            angular_radps: out.angular_radps,
            scan_seq: inputs.scan.header.seq,
            faults,
            state: state as u32,
        };
        let status = TickStatus {
            state,
            faults,
            cause: None,
            wish,
            intervention,
            decided: None,
            action: ACTION_GOAL,
            subgoal_m: (target.x, target.y),
            goal_distance_m: self.navigator.goal_distance_m(),
        };
        (command, status)
    }
}
