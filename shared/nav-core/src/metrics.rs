//! What an episode is judged by. One accumulator, fed once a step with the truth, for every program.
//!
//! | metric | unit | meaning |
//! |---|---|---|
//! | time | s | from start to the end of the episode |
//! | path length | m | driven |
//! | path efficiency | 1 | shortest way (known map) over path length, successes only; also against the straight line, as the paper takes it |
//! | SPL | 1 | success weighted by path length (Anderson et al. 2018): 0 on failure |
//! | smoothness | 1 | mean over steps of 1 - min(change of heading / 90 degrees, 1), the paper's R_smooth without its 0.1 |
//! | log jerk | 1 | -ln of the dimensionless squared jerk of the speed (Balasubramanian et al. 2015); higher is smoother |
//! | clearance | m | smallest and mean distance from the footprint to anything |
//! | distance left | m | straight line from where the robot ended to the goal |
//! | time to collision | s | smallest at the velocities of the moment |
//! | stood at the end | s | for so long the robot had been within 0.15 m of one place when the episode ended |
//! | spin | 1 | share of steps whose last 2 s moved less than 0.25 m net and turned more than 0.4 of what the robot can |
//!
//! The metres and seconds of the last two are those of the reference robot ([`crate::scale`]).
//!
//! Formulas, and vectors for other implementations: `conformance/metrics/README.md` of this crate. Where other libraries
//! differ: `METRICS.md`.

use crate::geometry::{Point, Pose, wrap_angle};
use crate::scale::Scale;
use crate::task::Task;
use heapless::Deque;
use serde::{Deserialize, Serialize};

const STOOD_M: f32 = 0.15;
const SPIN_WINDOW_S: f32 = 2.0;
const SPIN_MOVED_M: f32 = 0.25;
/// Of what the robot can turn in the window: 0.8 rad of the reference robot.
const SPIN_TURNED_SHARE: f32 = 0.4;
/// Longest spin window, ticks, and the present.
const SPIN_TICKS_MAX: usize = 1001;

/// How an episode ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EpisodeEnd {
    /// The goal was reached.
    Success,
    /// The robot hit something, or was hit.
    Collision,
    /// Time ran out on the way.
    Timeout,
    /// Time ran out while the robot stood where it wrongly believed the goal to be.
    BelievedArrived,
}

impl EpisodeEnd {
    /// In a word, as reports and pictures have it.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Success => "success",
            Self::Collision => "collision",
            Self::Timeout => "timeout",
            Self::BelievedArrived => "believed_arrived",
        }
    }
}

/// The truth of one step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StepTruth {
    /// Where the robot is, world frame.
    pub pose: Pose,
    /// How fast it drives, m/s.
    pub linear_mps: f32,
    /// From the footprint to the nearest thing, m.
    pub clearance_m: f32,
    /// At the velocities of the moment, s; infinite when nothing is approached.
    pub time_to_collision_s: f32,
}

/// What an episode came to.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct EpisodeMetrics {
    /// How it ended.
    pub end: EpisodeEnd,
    /// Whether a collision happened while the robot stood (below 0.05 m/s).
    pub hit_while_standing: bool,
    /// Steps taken.
    pub steps: u32,
    /// Duration, s.
    pub time_s: f32,
    /// Driven, m.
    pub path_m: f32,
    /// Shortest way for the footprint on the known map, m; absent where the map has none.
    pub geodesic_m: Option<f32>,
    /// Straight line from start to goal, m.
    pub euclidean_m: f32,
    /// Straight line from where the robot ended to the goal, m.
    pub distance_left_m: f32,
    /// Success weighted by path length; absent without a shortest way.
    pub spl: Option<f32>,
    /// Geodesic over path length, at most 1; of successes only.
    pub path_efficiency: Option<f32>,
    /// Straight line over path length, the paper's reference; of successes only.
    pub path_efficiency_euclidean: Option<f32>,
    /// Mean smoothness of the turns, 0 to 1; higher is smoother.
    pub smoothness: f32,
    /// Logarithm of the dimensionless jerk, negative; higher is smoother; absent for an episode without motion or of two steps at most.
    pub log_jerk: Option<f32>,
    /// Smallest clearance, m.
    pub clearance_min_m: f32,
    /// Mean clearance, m.
    pub clearance_mean_m: f32,
    /// Smallest time to collision, s; absent when nothing was ever approached.
    pub time_to_collision_min_s: Option<f32>,
    /// For how long the robot had stood when the episode ended, s.
    pub stood_at_end_s: f32,
    /// Share of the steps in which the robot span on the spot.
    pub spin: f32,
}

/// Adds up an episode, step by step.
#[derive(Clone, Debug)]
pub struct EpisodeRecorder {
    period_s: f32,
    scale: Scale,
    goal: Point,
    /// From the start to the goal, m.
    euclidean_m: f32,
    last: Pose,
    last_speed_mps: f32,
    last_acceleration_mps2: Option<f32>,
    steps: u32,
    path_m: f32,
    turn_smoothness_sum: f32,
    squared_jerk_sum: f32,
    speed_peak_mps: f32,
    clearance_min_m: f32,
    clearance_sum_m: f32,
    time_to_collision_min_s: f32,
    /// Where it has stood, and for how many steps.
    stood_at: Pose,
    stood_steps: u32,
    spin_steps: u32,
    /// (pose, turned since) of the last spin window.
    window: Deque<(Pose, f32), SPIN_TICKS_MAX>,
    window_steps: usize,
    /// Turning more than this within the window is spin, rad.
    spin_rad: f32,
    turned_rad: f32,
}

impl EpisodeRecorder {
    /// An episode of a task that leads from `start` to `goal`, world frame.
    pub fn new(start: Pose, goal: Point, task: &Task) -> Self {
        let (period_s, scale) = (task.control_period_s, task.scale());
        Self {
            period_s,
            scale,
            goal,
            euclidean_m: (goal - start.position()).norm(),
            last: start,
            last_speed_mps: 0.0,
            last_acceleration_mps2: None,
            steps: 0,
            path_m: 0.0,
            turn_smoothness_sum: 0.0,
            squared_jerk_sum: 0.0,
            speed_peak_mps: 0.0,
            clearance_min_m: f32::INFINITY,
            clearance_sum_m: 0.0,
            time_to_collision_min_s: f32::INFINITY,
            stood_at: start,
            stood_steps: 0,
            spin_steps: 0,
            window: Deque::new(),
            window_steps: ((scale.s(SPIN_WINDOW_S) / period_s) as usize).clamp(1, SPIN_TICKS_MAX - 1),
            spin_rad: SPIN_TURNED_SHARE * (task.robot.angular_max_radps * scale.s(SPIN_WINDOW_S)),
            turned_rad: 0.0,
        }
    }

    /// Adds a step.
    pub fn step(&mut self, truth: &StepTruth) {
        let turn_rad = wrap_angle(truth.pose.yaw_rad - self.last.yaw_rad).abs();
        self.steps += 1;
        self.path_m += (truth.pose.position() - self.last.position()).norm();
        self.turn_smoothness_sum += 1.0 - (turn_rad.to_degrees() / 90.0).min(1.0);
        let acceleration = (truth.linear_mps - self.last_speed_mps) / self.period_s;
        if let Some(before) = self.last_acceleration_mps2 {
            let jerk = (acceleration - before) / self.period_s;
            self.squared_jerk_sum += jerk * jerk * self.period_s;
        }
        self.last_acceleration_mps2 = Some(acceleration);
        self.last_speed_mps = truth.linear_mps;
        self.speed_peak_mps = self.speed_peak_mps.max(truth.linear_mps.abs());
        self.clearance_min_m = self.clearance_min_m.min(truth.clearance_m);
        self.clearance_sum_m += truth.clearance_m;
        self.time_to_collision_min_s = self.time_to_collision_min_s.min(truth.time_to_collision_s);
        self.stood_steps += 1;
        if (truth.pose.position() - self.stood_at.position()).norm() > self.scale.m(STOOD_M) {
            (self.stood_at, self.stood_steps) = (truth.pose, 0);
        }
        self.count_spin(&truth.pose, turn_rad);
        self.last = truth.pose;
    }

    fn count_spin(&mut self, pose: &Pose, turn_rad: f32) {
        self.turned_rad += turn_rad;
        if self.window.len() > self.window_steps {
            self.window.pop_front();
        }
        let _ = self.window.push_back((*pose, self.turned_rad));
        if self.window.len() <= self.window_steps {
            return;
        }
        if let Some((then, turned_then)) = self.window.front() {
            let moved = (pose.position() - then.position()).norm();
            if moved < self.scale.m(SPIN_MOVED_M) && self.turned_rad - turned_then > self.spin_rad {
                self.spin_steps += 1;
            }
        }
    }

    /// The metrics, given how it ended and the shortest way, m (if there is one).
    pub fn finish(
        &self,
        end: EpisodeEnd,
        hit_while_standing: bool,
        geodesic_m: Option<f32>,
    ) -> EpisodeMetrics {
        let steps = self.steps.max(1) as f32;
        let is_success = end == EpisodeEnd::Success;
        let efficiency = |reference_m: f32| (reference_m / self.path_m.max(reference_m)).min(1.0);
        let time_s = self.steps as f32 * self.period_s;
        let dimensionless =
            time_s * time_s * time_s * self.squared_jerk_sum / (self.speed_peak_mps * self.speed_peak_mps);
        EpisodeMetrics {
            end,
            hit_while_standing,
            steps: self.steps,
            time_s,
            path_m: self.path_m,
            geodesic_m,
            euclidean_m: self.euclidean_m,
            distance_left_m: (self.goal - self.last.position()).norm(),
            spl: geodesic_m.map(|geodesic_m| if is_success { efficiency(geodesic_m) } else { 0.0 }),
            path_efficiency: geodesic_m.filter(|_| is_success).map(efficiency),
            path_efficiency_euclidean: is_success.then(|| efficiency(self.euclidean_m)),
            smoothness: self.turn_smoothness_sum / steps,
            log_jerk: (dimensionless.is_finite() && dimensionless > 0.0).then(|| -libm::logf(dimensionless)),
            clearance_min_m: if self.steps == 0 { 0.0 } else { self.clearance_min_m },
            clearance_mean_m: self.clearance_sum_m / steps,
            time_to_collision_min_s: self
                .time_to_collision_min_s
                .is_finite()
                .then_some(self.time_to_collision_min_s),
            stood_at_end_s: self.stood_steps as f32 * self.period_s,
            spin: self.spin_steps as f32 / steps,
        }
    }
}

#[cfg(test)]
mod tests;
