//! A tick seen from outside: messages in, command out.

use crate::guard::Cause;
use crate::messages::{CmdVel, Goal, LaserScan, Odometry, RunState};
use crate::navigator::DecisionReason;
use crate::shield::Intervention;
use crate::task::Task;
use crate::twist::Twist;

/// Everything a tick reads: the newest message of each topic, `seq` 0 where none was ever received.
#[derive(Clone, Copy, Debug)]
pub struct Inputs<'a> {
    /// The newest scan.
    pub scan: &'a LaserScan,
    /// The newest odometry.
    pub odom: &'a Odometry,
    /// The newest goal.
    pub goal: &'a Goal,
}

/// What a tick did, small enough to copy around.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TickStatus {
    /// What the robot is doing.
    pub state: RunState,
    /// [`crate::messages::fault`] bits.
    pub faults: u32,
    /// The first of the faults that needs words.
    pub cause: Option<Cause>,
    /// What was wished, within the limits of speed, before the safety gate saw it; zero where nothing drives.
    pub wish: Twist,
    /// What the safety gate made of the wish.
    pub intervention: Option<Intervention>,
    /// Why a decision was taken in this tick, if one was.
    pub decided: Option<DecisionReason>,
    /// The action being carried out (see [`crate::task`]).
    pub action: usize,
    /// Its subgoal, `odom` frame, m.
    pub subgoal_m: (f32, f32),
    /// Straight distance to the goal, m.
    pub goal_distance_m: f32,
}

/// Whatever answers a moment's messages with a command: the controller, a rival, or a stand-in of a test.
pub trait Tick {
    /// One control tick at `now_ns` (monotonic): what to do now, and what happened.
    fn tick(&mut self, now_ns: u64, inputs: Inputs<'_>) -> (CmdVel, TickStatus);

    /// The task: limits and timing.
    fn task(&self) -> &Task;
}
