//! What happened, for people and for programs.

use anyhow::{Context, Result};
use nav_core::geometry::Pose;
use nav_core::metrics::{EpisodeEnd, EpisodeMetrics};
use nav_core::task::Task;
use nav_host::terminal::one_line;
use serde::Serialize;
use std::path::Path;

/// An episode that ended.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct EpisodeReport {
    /// Name of the world.
    pub(crate) world: String,
    /// The file or map that it was read from.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) world_file: Option<String>,
    /// Seed of the world; what disturbs the robot in it follows from family, split and this.
    pub(crate) seed: u64,
    /// Id of the goal on the wire.
    pub(crate) goal_id: u32,
    /// How it went.
    #[serde(flatten)]
    pub(crate) metrics: EpisodeMetrics,
    /// Periods without a fresh command, in which the driver's guard stopped the robot.
    pub(crate) stale_steps: u64,
    /// FNV-1a, 64 bits, over the bits of all true poses from the start on: equal for equal trajectories.
    pub(crate) trajectory_hash: String,
    /// True poses from the start on, `[x m, y m, yaw rad]`, if asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) poses: Option<Vec<[f32; 3]>>,
}

/// All episodes together.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Summary {
    /// Episodes that ended.
    pub(crate) episodes: usize,
    /// Episodes asked for.
    pub(crate) requested: u32,
    /// Share that reached the goal.
    pub(crate) success_rate: f64,
    /// Share that collided.
    pub(crate) collision_rate: f64,
    /// Share that stood where the runtime wrongly believed the goal to be until time was over.
    pub(crate) believed_arrived_rate: f64,
    /// Share that ran out of time on the way.
    pub(crate) timeout_rate: f64,
    /// Mean duration of successes, s; 0 without any.
    pub(crate) mean_time_s: f64,
    /// Mean of success weighted by path length.
    pub(crate) mean_spl: f64,
    /// Smallest clearance of all, m; 0 without any episode.
    pub(crate) clearance_min_m: f64,
    /// Driven in all, m.
    pub(crate) path_m: f64,
    /// Real-time periods skipped because the simulator was late.
    pub(crate) late_periods: u64,
}

/// The file.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Report<'a> {
    /// Version of this program.
    pub(crate) simulator_version: &'static str,
    /// Name of the robot.
    pub(crate) robot: &'a str,
    /// `realtime` or `lockstep`.
    pub(crate) pace: &'static str,
    /// `complete`, the signal that ended it in words, or the error.
    pub(crate) ended: String,
    /// What the robot was.
    pub(crate) task: &'a Task,
    /// All together.
    pub(crate) summary: Summary,
    /// One by one.
    pub(crate) episodes: &'a [EpisodeReport],
}

/// Collects the poses of an episode.
#[derive(Clone, Debug)]
pub(crate) struct Trajectory {
    hash: u64,
    poses: Option<Vec<[f32; 3]>>,
}

impl Trajectory {
    /// From the start pose on.
    pub(crate) fn new(start: Pose, with_poses: bool) -> Self {
        let mut trajectory = Self { hash: 0xcbf2_9ce4_8422_2325, poses: with_poses.then(Vec::new) };
        trajectory.push(start);
        trajectory
    }

    /// Adds a pose.
    pub(crate) fn push(&mut self, pose: Pose) {
        let numbers = [pose.x_m, pose.y_m, pose.yaw_rad];
        for byte in numbers.iter().flat_map(|number| number.to_bits().to_le_bytes()) {
            self.hash = (self.hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
        if let Some(poses) = &mut self.poses {
            poses.push(numbers);
        }
    }

    /// The hash in hexadecimal, and the poses if they were kept.
    pub(crate) fn finish(self) -> (String, Option<Vec<[f32; 3]>>) {
        (format!("{:016x}", self.hash), self.poses)
    }
}

impl Summary {
    /// Adds up.
    pub(crate) fn of(episodes: &[EpisodeReport], requested: u32, late_periods: u64) -> Self {
        let count = episodes.len().max(1) as f64;
        let share = |end: EpisodeEnd| {
            episodes.iter().filter(|episode| episode.metrics.end == end).count() as f64 / count
        };
        let successes: Vec<f64> = episodes
            .iter()
            .filter(|episode| episode.metrics.end == EpisodeEnd::Success)
            .map(|episode| f64::from(episode.metrics.time_s))
            .collect();
        let all = |value: fn(&EpisodeMetrics) -> f32| {
            episodes.iter().map(move |episode| f64::from(value(&episode.metrics)))
        };
        let clearance_min_m = all(|m| m.clearance_min_m).fold(f64::INFINITY, f64::min);
        Self {
            episodes: episodes.len(),
            requested,
            success_rate: share(EpisodeEnd::Success),
            collision_rate: share(EpisodeEnd::Collision),
            believed_arrived_rate: share(EpisodeEnd::BelievedArrived),
            timeout_rate: share(EpisodeEnd::Timeout),
            mean_time_s: successes.iter().fold(0.0, |sum, time_s| sum + time_s)
                / successes.len().max(1) as f64,
            mean_spl: all(|m| m.spl.unwrap_or(0.0)).fold(0.0, |sum, spl| sum + spl) / count,
            clearance_min_m: if clearance_min_m.is_finite() { clearance_min_m } else { 0.0 },
            // `sum` of nothing is -0.0.
            path_m: all(|m| m.path_m).fold(0.0, |sum, path_m| sum + path_m),
            late_periods,
        }
    }

    /// One line for people.
    pub(crate) fn line(&self) -> String {
        format!(
            "{} of {} episodes: {:.1} % success, {:.1} % collision, {:.1} % believed to have arrived, {:.1} % timeout; \
             {:.1} s and SPL {:.2} on average; {:.1} m driven",
            self.episodes,
            self.requested,
            100.0 * self.success_rate,
            100.0 * self.collision_rate,
            100.0 * self.believed_arrived_rate,
            100.0 * self.timeout_rate,
            self.mean_time_s,
            self.mean_spl,
            self.path_m
        )
    }
}

impl EpisodeReport {
    /// One line for people.
    pub(crate) fn line(&self) -> String {
        let metrics = &self.metrics;
        format!(
            "{}  {:<16}  {:5.1} s  {:5.1} m driven, {:5.1} m shortest  clearance {:.2} m",
            one_line(self.world_file.as_ref().unwrap_or(&self.world)),
            metrics.end.word(),
            metrics.time_s,
            metrics.path_m,
            metrics.geodesic_m.unwrap_or(f32::NAN),
            metrics.clearance_min_m
        )
    }
}

impl Report<'_> {
    /// Writes the file whole or not at all.
    pub(crate) fn write(&self, path: &Path) -> Result<()> {
        let text = serde_json::to_string_pretty(self).context("the report cannot be put into JSON")?;
        nav_host::files::replace(path, text + "\n").with_context(|| unwritable(path))
    }
}

/// What to say of a report that cannot be written.
pub(crate) fn unwritable(path: &Path) -> String {
    format!("--report: {} cannot be written", path.display())
}
