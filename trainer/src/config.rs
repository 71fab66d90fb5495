//! What a training run is: read from TOML, checked, written beside the run.
//!
//! Every field has a default; a profile replaces some of them; a file replaces any; a flag replaces its own. Lengths, times
//! and what is paid or discounted a step have defaults that follow from `task.robot` and `task.control_period_s`
//! ([`nav_core::scale`]).
//! An unknown field is an error.

use nav_core::manifest::Algorithm;
use nav_core::reward::{RewardProfile, decomposed, paper};
use nav_core::task::Task;
use nav_env::low::Progress;
use nav_sim::disturbance::Disturbance;
use nav_sim::families::Family;
use serde::{Deserialize, Serialize};

use crate::dqn::DqnConfig;
use crate::td3::Td3Config;

mod profiles;
mod read;
mod thresholds;
pub mod bounds;
mod check;
mod robots;

/// How much is spent on a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "snake_case")]
pub enum Profile {
    /// One seed in at most six minutes on two cores: small networks, a few hundred thousand steps.
    #[default]
    Quick,
    /// More worlds, almost three times the decisions, a wider scorer and a stricter gate. The low level is that of
    /// `quick`: half as many steps more made it no better.
    Full,
}

impl std::fmt::Display for Profile {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Quick => "quick",
            Self::Full => "full",
        })
    }
}

/// A training run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Config {
    /// Where the defaults of the other fields come from.
    pub profile: Profile,
    /// The robot's profile, where one was named: where the defaults of `task.robot`, `task.lidar` and
    /// `task.control_period_s` come from.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub robot: Option<String>,
    /// What is trained.
    pub algorithm: Algorithm,
    /// Every random number of the run follows from this.
    pub seed: u64,
    /// Training worlds generated for each family; episodes draw from them.
    pub worlds_per_family: u32,
    /// What the policy is trained for.
    pub task: Task,
    /// How the simulated robot differs from a perfect one.
    pub disturbance: Disturbance,
    /// Stage A: the low level alone.
    pub low: LowConfig,
    /// Stage B: the high level above the frozen low level.
    pub high: HighConfig,
    /// What a run must reach before it may be exported.
    pub gate: GateConfig,
    /// The learning curve.
    pub curve: CurveConfig,
}

/// Stage A: TD3 on random subgoals and real goals.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LowConfig {
    /// Families driven in.
    pub families: Vec<Family>,
    /// Robots that drive side by side.
    pub envs: usize,
    /// Steps of all robots together, each as long as learning takes a step to be (`nav_core::scale`; 0.1 s for the default robot)
    /// and at least a tick.
    pub env_steps: u64,
    /// Steps with random actions before the first update.
    pub warmup_steps: u64,
    /// Steps for one update.
    pub env_steps_per_update: u32,
    /// Transitions an update.
    pub batch: usize,
    /// Transitions kept.
    pub replay_capacity: usize,
    /// Discount of a step (a control period).
    pub discount: f32,
    /// Ticks of a return before it bootstraps.
    pub n_step: usize,
    /// Whether every other transition of a batch is its mirror image, left for right.
    pub mirror: bool,
    /// Standard deviation of the exploration noise, `[least, most]`, spread over the robots; halved in the
    /// course of the stage.
    pub noise: [f32; 2],
    /// Share of targets that are the world's goal; the rest are random subgoals. 1 for a flat policy.
    pub goal_share: f32,
    /// Distance of random subgoals, `[least, most]`, m.
    pub subgoal_m: [f32; 2],
    /// Time after which a subgoal is given up (truncated), s: by default 2.7 times what the farthest takes at full speed.
    pub subgoal_s: f32,
    /// The learning rates fall from the learner's to this share of them over the stage.
    pub final_learning_rate_share: f32,
    /// Which reward.
    pub reward: RewardProfile,
    /// How progress towards the world's goal is measured: `straight`, or `geodesic`, round what stands.
    pub progress: Progress,
    /// Weights of the profile `decomposed`.
    pub decomposed: decomposed::LowWeights,
    /// Weights of the profile `paper`.
    pub paper: paper::LowWeights,
    /// When the stage is stopped early.
    pub collapse: CollapseConfig,
    /// The learner.
    pub td3: Td3Config,
}

/// When stage A has collapsed: its robots do not reach their targets and its actor sits in the flat ends of tanh. Such a
/// run does not recover, so that it is stopped, with status 1, before the rest of its time is spent.
///
/// Both must hold, because a healthy actor drives at full speed, with half of its actions beyond ±0.99 and more.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CollapseConfig {
    /// Share of the stage from which on it is watched; 1 turns the watch off. Healthy hybrids reach 68 % of their
    /// targets and more by a third of it, a flat run, which drives at goals alone, 28 %.
    pub from_share: f32,
    /// Share of the newest targets that must be reached, with exploration.
    pub reach_min: f32,
    /// Share of actions beyond ±0.99 above which a low reach is a collapse.
    pub saturation_max: f32,
}

/// Stage B: DQN over subgoals, the low level frozen.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct HighConfig {
    /// Families driven in.
    pub families: Vec<Family>,
    /// Robots that drive side by side.
    pub envs: usize,
    /// Decisions of all robots together.
    pub decisions: u64,
    /// Decisions before the first update.
    pub warmup_decisions: u64,
    /// Decisions for one update.
    pub decisions_per_update: u32,
    /// Decisions an update learns from.
    pub batch: usize,
    /// Decisions kept.
    pub replay_capacity: usize,
    /// Discount of a step (a decision of n steps discounts by its n-th power).
    pub discount: f32,
    /// Decisions of a return before it bootstraps.
    pub n_step: usize,
    /// As `low.mirror`, of decisions.
    pub mirror: bool,
    /// Share of random choices at the start and at the end.
    pub epsilon: [f32; 2],
    /// Share of the stage in which epsilon falls from the one to the other.
    pub epsilon_share: f32,
    /// Share of random choices that are GOAL.
    pub random_goal_share: f32,
    /// The learning rate falls from the learner's to this over the stage.
    pub final_learning_rate: f32,
    /// Which reward.
    pub reward: RewardProfile,
    /// Weights of the profile `decomposed`.
    pub decomposed: decomposed::HighWeights,
    /// Weights of the profile `paper`.
    pub paper: paper::HighWeights,
    /// Deviation margins tried on validation worlds after training; the best is kept. None: the margin is
    /// `task.decision.deviation_margin`.
    pub deviation_margins: Vec<f32>,
    /// The learner.
    pub dqn: DqnConfig,
}

/// What a run must reach on validation worlds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct GateConfig {
    /// Share of random subgoals that the low level must reach behind the safety gate, static families.
    pub low_reach: f32,
    /// Share of them that may end in a collision there.
    pub low_collision: f32,
    /// Share of the whole policy's steps that may be spin.
    pub spin: f32,
    /// Validation worlds a family that judge the policy.
    pub worlds: u32,
    /// Other validation worlds a family, on which the deviation margin is chosen before.
    pub choosing_worlds: u32,
    /// Share of the worlds of a family without people that may end in a collision, for each family.
    pub static_collision: f32,
    /// By how much the share of the worlds of a family with people that end in a collision may exceed that of the reactive rival
    /// behind the same safety gate, for each family.
    pub people_collision_beyond_reactive: f32,
    /// Share of `clutter` worlds that must be solved.
    pub clutter_success: f32,
    /// Share of `u_trap` worlds that the hybrid must solve.
    pub u_trap_success: f32,
}

/// How the policy is followed on validation worlds while it trains (`curve.csv` in the run's folder).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CurveConfig {
    /// Points a stage, spread evenly, the last one at its end; 0 draws none.
    pub points: u32,
    /// Validation worlds a family, others than those of the gate.
    pub worlds: u32,
}
