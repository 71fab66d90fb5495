//! The task: everything a policy was trained for and depends on when it drives.
//!
//! Written once, in the training configuration; copied into the manifest by the export; read back from
//! there by runtime, simulator and evaluation. No field of it is typed twice.

mod robot;

pub use self::robot::Robot;

use crate::messages::MAX_BEAMS;
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
/// A direction is legal when its subgoal lies at least this far away, m.
pub const SUBGOAL_MIN_M: f32 = 0.6;
/// Corridors to subgoals are measured up to this length, m.
pub const CORRIDOR_LIMIT_M: f32 = 4.0;

/// What a policy was trained for.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Task {
    /// Time from one control tick (and simulation step) to the next, s. The decision rules and the changes in
    /// the observation count ticks, and were chosen for 0.1 s.
    pub control_period_s: f32,
    /// Steps after which an episode is truncated; the policy does not see it.
    pub episode_steps: u32,
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

/// A planar lidar at the robot's centre.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Lidar {
    /// Beams a scan, at most [`crate::messages::MAX_BEAMS`].
    pub beam_count: u32,
    /// Field of view, centred on the robot's x axis, rad; a full circle does not repeat its first beam.
    pub field_of_view_rad: f32,
    /// Shortest valid range, m.
    pub range_min_m: f32,
    /// Longest valid range, m.
    pub range_max_m: f32,
}

/// When the high level decides, and what its choices mean.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Decision {
    /// Longest time that a subgoal is held, steps.
    pub hold_steps: u32,
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
        Self {
            control_period_s: 0.1,
            episode_steps: 500,
            goal_radius_m: 0.3,
            robot: Robot::default(),
            lidar: Lidar::default(),
            decision: Decision::default(),
            shield: ShieldMode::On,
        }
    }
}

impl Default for Lidar {
    fn default() -> Self {
        Self { beam_count: 72, field_of_view_rad: TAU, range_min_m: 0.05, range_max_m: 5.0 }
    }
}

impl Default for Decision {
    fn default() -> Self {
        Self {
            hold_steps: 20,
            subgoal_distance_m: 2.0,
            subgoal_reached_m: 0.4,
            corridor_margin_m: 0.35,
            time_to_collision_s: 1.5,
            deviation_margin: 0.0,
            horizon_s: 50.0,
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

    /// Direction of beam 0 in the robot frame, rad.
    pub fn angle_min_rad(&self) -> f32 {
        -0.5 * self.field_of_view_rad.min(TAU)
    }

    /// Direction of a beam in the robot frame, rad.
    pub fn beam_angle_rad(&self, beam: usize) -> f32 {
        self.angle_min_rad() + beam as f32 * self.angle_increment_rad()
    }
}

impl Task {
    /// [`Self::control_period_s`] as a whole number of nanoseconds.
    pub fn control_period_ns(&self) -> u64 {
        libm::round(f64::from(self.control_period_s) * 1e6) as u64 * 1000
    }

    /// The first thing about this task that makes no sense, as a sentence.
    ///
    /// # Errors
    /// A field outside its range, named with its unit.
    pub fn validate(&self) -> Result<(), &'static str> {
        let within = |value: f32, low: f32, high: f32| value >= low && value <= high;
        let checks = [
            (within(self.control_period_s, 0.001, 1.0), "control_period_s must lie in [0.001, 1]"),
            (self.episode_steps > 0, "episode_steps must be at least 1"),
            (within(self.goal_radius_m, 0.05, 2.0), "goal_radius_m must lie in [0.05, 2]"),
            (within(self.robot.radius_m, 0.05, 1.0), "robot.radius_m must lie in [0.05, 1]"),
            (within(self.robot.linear_max_mps, 0.01, 5.0), "robot.linear_max_mps must lie in [0.01, 5]"),
            (
                within(self.robot.linear_min_mps, -self.robot.linear_max_mps, 0.0),
                "robot.linear_min_mps must lie in [-robot.linear_max_mps, 0]",
            ),
            (
                within(self.robot.angular_max_radps, 0.01, 10.0),
                "robot.angular_max_radps must lie in [0.01, 10]",
            ),
            (
                within(self.robot.linear_acceleration_mps2, 0.01, 50.0),
                "robot.linear_acceleration_mps2 must lie in [0.01, 50]",
            ),
            (
                within(self.robot.angular_acceleration_radps2, 0.01, 100.0),
                "robot.angular_acceleration_radps2 must lie in [0.01, 100]",
            ),
            (
                (1..=MAX_BEAMS).contains(&(self.lidar.beam_count as usize)),
                "lidar.beam_count must lie in [1, 1440]",
            ),
            (
                within(self.lidar.field_of_view_rad, 0.1, TAU + 1e-3),
                "lidar.field_of_view_rad must lie in [0.1, 2 pi]",
            ),
            (within(self.lidar.range_min_m, 0.0, 1.0), "lidar.range_min_m must lie in [0, 1]"),
            (within(self.lidar.range_max_m, 1.0, 100.0), "lidar.range_max_m must lie in [1, 100]"),
            ((1..=200).contains(&self.decision.hold_steps), "decision.hold_steps must lie in [1, 200]"),
            (
                within(self.decision.subgoal_distance_m, 0.5, 10.0),
                "decision.subgoal_distance_m must lie in [0.5, 10]",
            ),
            (
                within(self.decision.subgoal_reached_m, 0.05, 2.0),
                "decision.subgoal_reached_m must lie in [0.05, 2]",
            ),
            (
                within(self.decision.corridor_margin_m, 0.0, 2.0),
                "decision.corridor_margin_m must lie in [0, 2]",
            ),
            (
                within(self.decision.time_to_collision_s, 0.0, 10.0),
                "decision.time_to_collision_s must lie in [0, 10]",
            ),
            (within(self.decision.horizon_s, 1.0, 3600.0), "decision.horizon_s must lie in [1, 3600]"),
            (self.decision.deviation_margin.is_finite(), "decision.deviation_margin must be finite"),
            (
                self.decision.subgoal_distance_m > SUBGOAL_MIN_M
                    && self.decision.subgoal_distance_m + self.decision.corridor_margin_m <= CORRIDOR_LIMIT_M,
                "decision.subgoal_distance_m must exceed 0.6, and with decision.corridor_margin_m be 4 at most",
            ),
            (
                self.decision.subgoal_reached_m < SUBGOAL_MIN_M,
                "decision.subgoal_reached_m must be below 0.6, the shortest subgoal",
            ),
        ];
        match checks.into_iter().find(|(fine, _)| !fine) {
            Some((_, sentence)) => Err(sentence),
            None => Ok(()),
        }
    }
}
