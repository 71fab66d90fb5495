//! The task: everything a policy was trained for and depends on when it drives.
//!
//! Written once, in the training configuration; copied into the manifest by the export; read back from
//! there by runtime, simulator and evaluation. No field of it is typed twice.

mod robot;
mod check;

pub use self::robot::Robot;

use crate::geometry::Pose;
use crate::scale::Scale;
use core::f32::consts::TAU;
use serde::{Deserialize, Serialize};

/// Directions the high level can choose from, counter-clockwise from the direction of the goal.
pub const DIRECTION_COUNT: usize = 16;
/// Action index of "drive at the goal itself".
pub const ACTION_GOAL: usize = DIRECTION_COUNT;
/// Action index of "wait here".
pub const ACTION_WAIT: usize = DIRECTION_COUNT + 1;
/// How many actions the high level has: the directions, GOAL and WAIT.
pub const ACTION_COUNT: usize = DIRECTION_COUNT + 2;
/// A direction is legal when its subgoal lies at least this far away, m of the reference robot ([`Scale`]).
pub const SUBGOAL_MIN_M: f32 = 0.6;
/// Corridors to subgoals are measured up to this length, m of the reference robot.
pub const CORRIDOR_LIMIT_M: f32 = 4.0;
/// An episode lasts so long, s of the reference robot: 1.9 times what the longest way of a generated world takes.
pub const EPISODE_S: f32 = 50.0;

/// What a policy was trained for.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Task {
    /// Time from one control tick (and simulation step) to the next, s.
    pub control_period_s: f32,
    /// Time after which an episode is truncated, s; the policy does not see it.
    pub episode_s: f32,
    /// The goal counts as reached when the robot's centre is this close, m.
    pub goal_radius_m: f32,
    /// The robot.
    pub robot: Robot,
    /// The lidar.
    pub lidar: Lidar,
    /// How the high level decides.
    pub decision: Decision,
    /// Whether the safety gate stands between the policy and the base.
    pub shield: ShieldMode,
}

/// A planar lidar.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Lidar {
    /// Beams a scan, at most [`crate::messages::MAX_BEAMS`].
    pub beam_count: u32,
    /// Field of view, centred on the lidar's own x axis, rad; a full circle does not repeat its first beam.
    pub field_of_view_rad: f32,
    /// Shortest valid range, m.
    pub range_min_m: f32,
    /// Longest valid range, m.
    pub range_max_m: f32,
    /// Where it sits on the robot, and which way it looks: `robot_from_lidar`. Scans are in its own frame.
    pub mount: Pose,
}

/// When the high level decides, and what its choices mean.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Decision {
    /// Longest time that a subgoal is held, s.
    pub hold_s: f32,
    /// Distance of a direction's subgoal in free space, m.
    pub subgoal_distance_m: f32,
    /// A subgoal counts as reached at this distance, m.
    pub subgoal_reached_m: f32,
    /// Kept between a subgoal and the obstacle behind it, m.
    pub corridor_margin_m: f32,
    /// A time to collision below this ends a decision early, s.
    pub time_to_collision_s: f32,
    /// GOAL is left only for an action whose value is higher by more than this (validated after training).
    pub deviation_margin: f32,
    /// Time within which the high level expects to arrive, s: it sees how much of it is over. A property of the
    /// policy, whatever the time limit of an episode.
    pub horizon_s: f32,
    /// What the high level remembers.
    pub memory: Memory,
}

/// Whether the safety gate ([`crate::shield`]) is used. Training never does: a policy trained behind it becomes lazy.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ShieldMode {
    /// The nearest safe command to the policy's wish leaves.
    #[default]
    On,
    /// The policy's wish leaves.
    Off,
}

/// What the high level remembers of where it was.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Memory {
    /// Visit density only.
    Lite,
    /// Visit density and the optimistic geodesic distance over everything seen.
    Full,
}

impl ShieldMode {
    /// Its name in manifests, on command lines and in results.
    pub const fn id(self) -> &'static str {
        match self {
            Self::On => "on",
            Self::Off => "off",
        }
    }
}

impl core::fmt::Display for ShieldMode {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.pad(self.id())
    }
}

impl core::str::FromStr for ShieldMode {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        [Self::On, Self::Off].into_iter().find(|mode| mode.id() == text).ok_or("say on or off")
    }
}

impl Default for Task {
    fn default() -> Self {
        Self::of(Robot::default())
    }
}

impl Default for Lidar {
    fn default() -> Self {
        Self {
            beam_count: 72,
            field_of_view_rad: TAU,
            range_min_m: 0.05,
            range_max_m: 5.0,
            mount: Pose::default(),
        }
    }
}

impl Default for Decision {
    fn default() -> Self {
        Self::of(&Robot::default())
    }
}

impl Decision {
    /// What suits a robot.
    pub fn of(robot: &Robot) -> Self {
        let scale = Scale::of(robot);
        Self {
            hold_s: scale.s(2.0),
            subgoal_distance_m: scale.m(2.0),
            subgoal_reached_m: scale.m(0.4),
            // Room to brake in, as far as it is needed beyond a subgoal that counts as reached some way before.
            corridor_margin_m: scale.m(0.1) + robot.braking_m().min(scale.m(0.4)),
            time_to_collision_s: scale.s(1.5),
            deviation_margin: 0.0,
            horizon_s: scale.s(50.0),
            memory: Memory::Full,
        }
    }
}

impl Lidar {
    /// Whether the field of view is the whole circle.
    pub fn is_full_circle(&self) -> bool {
        self.field_of_view_rad > TAU - 1e-3
    }

    /// From one beam to the next, rad.
    pub fn angle_increment_rad(&self) -> f32 {
        let gaps = if self.is_full_circle() { self.beam_count } else { self.beam_count.saturating_sub(1) };
        let gaps = gaps.max(1) as f32;
        self.field_of_view_rad.min(TAU) / gaps
    }

    /// Direction of beam 0 in the lidar's frame, rad.
    pub fn angle_min_rad(&self) -> f32 {
        -0.5 * self.field_of_view_rad.min(TAU)
    }

    /// Where it is when the robot is at a pose.
    pub fn pose(&self, robot: Pose) -> Pose {
        // To the bit where it sits in the middle.
        if self.mount == Pose::default() { robot } else { robot.after(&self.mount) }
    }

    /// Direction of a beam in the lidar's frame, rad.
    pub fn beam_angle_rad(&self, beam: usize) -> f32 {
        self.angle_min_rad() + beam as f32 * self.angle_increment_rad()
    }
}

impl Task {
    /// What suits a robot, with the default lidar at 10 Hz.
    pub fn of(robot: Robot) -> Self {
        let scale = Scale::of(&robot);
        Self {
            control_period_s: 0.1,
            episode_s: scale.s(EPISODE_S),
            goal_radius_m: scale.m(0.3),
            robot,
            lidar: Lidar::default(),
            decision: Decision::of(&robot),
            shield: ShieldMode::On,
        }
    }

    /// What lengths and times are to its robot.
    pub fn scale(&self) -> Scale {
        Scale::of(&self.robot)
    }

    /// A time in whole ticks, at least one.
    pub fn ticks(&self, time_s: f32) -> u32 {
        libm::roundf(time_s / self.control_period_s).max(1.0) as u32
    }

    /// A tick as a share of the step for which rewards and discounts were chosen ([`Scale::step_s`]).
    pub fn step_share(&self) -> f32 {
        self.control_period_s / self.scale().step_s()
    }

    /// Ticks after which an episode is truncated.
    pub fn episode_steps(&self) -> u32 {
        self.ticks(self.episode_s)
    }

    /// [`Self::control_period_s`] as a whole number of nanoseconds.
    pub fn control_period_ns(&self) -> u64 {
        libm::round(f64::from(self.control_period_s) * 1e6) as u64 * 1000
    }
}
