//! What a training run is: read from TOML, checked, written beside the run.
//!
//! Every field has a default; a profile replaces some of them; a file replaces any; a flag replaces its own.
//! An unknown field is an error.

use anyhow::{Context, Result, bail, ensure};
use nav_core::manifest::Algorithm;
use nav_core::reward::{RewardProfile, decomposed, paper};
use nav_core::task::Task;
use nav_sim::disturbance::Disturbance;
use nav_sim::families::Family;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::path::Path;

use crate::dqn::DqnConfig;
use crate::td3::Td3Config;

/// How much is spent on a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "snake_case")]
pub enum Profile {
    /// One seed in at most six minutes on two cores: small networks, a few hundred thousand steps.
    #[default]
    Quick,
    /// What results are published with.
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
}

/// Stage A: TD3 on random subgoals and real goals.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LowConfig {
    /// Families driven in.
    pub families: Vec<Family>,
    /// Robots that drive side by side.
    pub envs: usize,
    /// Steps of all robots together.
    pub env_steps: u64,
    /// Steps with random actions before the first update.
    pub warmup_steps: u64,
    /// Steps for one update.
    pub env_steps_per_update: u32,
    /// Transitions an update.
    pub batch: usize,
    /// Transitions kept.
    pub replay_capacity: usize,
    /// Discount of a step.
    pub discount: f32,
    /// Standard deviation of the exploration noise, `[least, most]`, spread over the robots; halved in the
    /// course of the stage.
    pub noise: [f32; 2],
    /// Share of targets that are the world's goal; the rest are random subgoals. 1 for a flat policy.
    pub goal_share: f32,
    /// Distance of random subgoals, `[least, most]`, m.
    pub subgoal_m: [f32; 2],
    /// Steps after which a subgoal is given up (truncated).
    pub subgoal_steps: u32,
    /// Which reward.
    pub reward: RewardProfile,
    /// Weights of the profile `decomposed`.
    pub decomposed: decomposed::LowWeights,
    /// Weights of the profile `paper`.
    pub paper: paper::LowWeights,
    /// The learner.
    pub td3: Td3Config,
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
    /// Deviation margins tried on validation worlds after training; the best is kept.
    pub deviation_margins: Vec<f32>,
    /// The learner.
    pub dqn: DqnConfig,
}

/// What a run must reach on validation worlds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct GateConfig {
    /// Share of random subgoals that the low level must reach, static families.
    pub low_reach: f32,
    /// Share of them that may end in a collision.
    pub low_collision: f32,
    /// Share of the whole policy's steps that may be spin.
    pub spin: f32,
    /// Validation worlds a family.
    pub worlds: u32,
    /// Share of `clutter` worlds that must be solved.
    pub clutter_success: f32,
    /// Share of `u_trap` worlds that the hybrid must solve.
    pub u_trap_success: f32,
}

impl Default for Config {
    fn default() -> Self {
        Self::of_profile(Profile::Quick)
    }
}

impl Default for LowConfig {
    fn default() -> Self {
        Self {
            families: vec![
                Family::Clutter,
                Family::Boxes,
                Family::Tight,
                Family::Rooms,
                Family::Maze,
                Family::UTrap,
                Family::Crowd,
            ],
            envs: 16,
            env_steps: 300_000,
            warmup_steps: 5_000,
            env_steps_per_update: 4,
            batch: 256,
            replay_capacity: 300_000,
            discount: 0.98,
            noise: [0.05, 0.5],
            goal_share: 0.3,
            subgoal_m: [0.7, 3.0],
            subgoal_steps: 80,
            reward: RewardProfile::Decomposed,
            decomposed: decomposed::LowWeights::default(),
            paper: paper::LowWeights::default(),
            td3: Td3Config {
                hidden: vec![128, 128],
                actor_learning_rate: 1e-3,
                critic_learning_rate: 1e-3,
                smooth_temporal: 0.05,
                smooth_spatial: 0.0,
                ..Td3Config::default()
            },
        }
    }
}

impl Default for HighConfig {
    fn default() -> Self {
        Self {
            families: vec![
                Family::Clutter,
                Family::Boxes,
                Family::UTrap,
                Family::DeepU,
                Family::Maze,
                Family::Rooms,
                Family::Crowd,
            ],
            envs: 32,
            decisions: 90_000,
            warmup_decisions: 3_000,
            decisions_per_update: 3,
            batch: 128,
            replay_capacity: 150_000,
            discount: 0.995,
            n_step: 3,
            epsilon: [1.0, 0.05],
            epsilon_share: 0.4,
            random_goal_share: 0.25,
            final_learning_rate: 1.5e-4,
            reward: RewardProfile::Decomposed,
            decomposed: decomposed::HighWeights::default(),
            paper: paper::HighWeights::default(),
            deviation_margins: vec![0.0, 0.1, 0.25, 0.5],
            dqn: DqnConfig { hidden: vec![64, 64], ..DqnConfig::default() },
        }
    }
}

impl Default for GateConfig {
    fn default() -> Self {
        Self {
            low_reach: 0.9,
            low_collision: 0.05,
            spin: 0.05,
            worlds: 60,
            clutter_success: 0.9,
            u_trap_success: 0.8,
        }
    }
}

impl Config {
    /// The defaults of a profile.
    pub fn of_profile(profile: Profile) -> Self {
        let mut config = Self {
            profile,
            algorithm: Algorithm::Hybrid,
            seed: 1,
            worlds_per_family: 300,
            task: Task::default(),
            disturbance: Disturbance::trained(),
            low: LowConfig::default(),
            high: HighConfig::default(),
            gate: GateConfig::default(),
        };
        if profile == Profile::Full {
            config.worlds_per_family = 1_000;
            config.low.env_steps = 600_000;
            config.low.replay_capacity = 400_000;
            config.low.td3.hidden = vec![256, 256];
            config.high.decisions = 250_000;
            config.high.dqn.hidden = vec![128, 128];
            config.gate.low_reach = 0.97;
            config.gate.low_collision = 0.02;
            config.gate.spin = 0.03;
            config.gate.worlds = 100;
            config.gate.clutter_success = 0.95;
            config.gate.u_trap_success = 0.85;
        }
        config
    }

    /// Reads a TOML file. Its `profile` (or `default_profile`) gives the fields that it does not name.
    ///
    /// # Errors
    /// A file that cannot be read, is not TOML, or has an unknown field or a value of the wrong kind.
    pub fn read(path: &Path, default_profile: Profile) -> Result<Self> {
        let text = std::fs::read_to_string(path)
            .with_context(|| format!("cannot read the configuration {}: check --config", path.display()))?;
        Self::parse(&text, default_profile).with_context(|| format!("the configuration {}", path.display()))
    }

    /// As [`Self::read`], from a text.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn parse(text: &str, default_profile: Profile) -> Result<Self> {
        let overrides: toml::Table = text.parse().context("is not valid TOML")?;
        let profile = match overrides.get("profile") {
            None => default_profile,
            Some(value) => value.clone().try_into().context("`profile` must be \"quick\" or \"full\"")?,
        };
        let mut merged = toml::Table::try_from(Self::of_profile(profile)).context("cannot be merged")?;
        merge(&mut merged, overrides, "")?;
        let config: Self = merged.try_into().context("has a value of the wrong kind")?;
        config.validate()?;
        Ok(config)
    }

    /// As TOML, every field.
    pub fn to_toml(&self) -> String {
        toml::to_string_pretty(self).expect("a configuration is plain numbers, texts and lists")
    }

    /// SHA-256 of [`Self::to_toml`], hexadecimal.
    pub fn sha256(&self) -> String {
        Sha256::digest(self.to_toml()).iter().map(|byte| format!("{byte:02x}")).collect()
    }

    /// Checks what types cannot.
    ///
    /// # Errors
    /// The first field that makes no sense, with what it must be.
    pub fn validate(&self) -> Result<()> {
        self.task.validate().map_err(|sentence| anyhow::anyhow!("task.{sentence}"))?;
        self.disturbance.validate().map_err(|sentence| anyhow::anyhow!("disturbance.{sentence}"))?;
        let (low, high) = (&self.low, &self.high);
        ensure!(self.worlds_per_family > 0, "worlds_per_family must be at least 1");
        for (stage, families) in [("low", &low.families), ("high", &high.families)] {
            ensure!(!families.is_empty(), "{stage}.families must name at least one family");
            if let Some(family) = families.iter().find(|family| !family.trainable()) {
                bail!("{stage}.families names `{family}`, which is kept for testing: remove it");
            }
        }
        ensure!(low.envs > 0 && high.envs > 0, "low.envs and high.envs must be at least 1");
        ensure!(low.env_steps_per_update > 0, "low.env_steps_per_update must be at least 1");
        ensure!(high.decisions_per_update > 0, "high.decisions_per_update must be at least 1");
        ensure!(low.batch > 0 && high.batch > 0, "low.batch and high.batch must be at least 1");
        ensure!(low.replay_capacity >= low.batch, "low.replay_capacity must be at least low.batch");
        ensure!(high.replay_capacity >= high.batch, "high.replay_capacity must be at least high.batch");
        ensure!((0.0..1.0).contains(&low.discount), "low.discount must lie in [0, 1)");
        ensure!((0.0..1.0).contains(&high.discount), "high.discount must lie in [0, 1)");
        ensure!((0.0..=1.0).contains(&low.goal_share), "low.goal_share must lie in [0, 1]");
        ensure!((1..=10).contains(&high.n_step), "high.n_step must lie in [1, 10]");
        ensure!(!high.deviation_margins.is_empty(), "high.deviation_margins must hold at least one margin");
        if low.reward == RewardProfile::Decomposed {
            ensure!(
                low.decomposed.crash_costs_more_than_waiting(low.discount),
                "low.decomposed.collided must exceed 2 * time / (1 - discount) = {}: with less, crashing pays",
                2.0 * low.decomposed.time / (1.0 - low.discount)
            );
        }
        Ok(())
    }
}

/// Lays `overrides` over `base`, refusing keys that `base` does not have.
fn merge(base: &mut toml::Table, overrides: toml::Table, path: &str) -> Result<()> {
    for (key, value) in overrides {
        let full = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
        match (base.get_mut(&key), value) {
            (None, _) => {
                let known: Vec<_> = base.keys().map(String::as_str).collect();
                bail!("has an unknown field `{full}`; known here: {}", known.join(", "))
            }
            (Some(toml::Value::Table(inner)), toml::Value::Table(table)) => merge(inner, table, &full)?,
            (Some(slot), value) => *slot = value,
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_overrides_its_profile_and_nothing_else() {
        let config = Config::parse("profile = 'full'\n[low]\nenvs = 3", Profile::Quick).expect("valid");
        assert_eq!(config.low.envs, 3);
        let mut expected = Config::of_profile(Profile::Full);
        expected.low.envs = 3;
        assert_eq!(config, expected);
    }

    #[test]
    fn typos_and_nonsense_are_refused_by_name() {
        let message = |text| format!("{:#}", Config::parse(text, Profile::Quick).expect_err("refused"));
        assert!(
            message("[low]\nenv = 3").contains("unknown field `low.env`"),
            "{}",
            message("[low]\nenv = 3")
        );
        assert!(message("[low]\nfamilies = ['hook']").contains("kept for testing"));
        assert!(message("[low.decomposed]\ncollided = 1.0").contains("crashing pays"));
        assert!(message("[task.robot]\nradius_m = -1.0").contains("task.robot.radius_m"));
        assert!(message("seed = 'one'").contains("wrong kind"));
        assert!(message("seed = ").contains("TOML"));
    }

    #[test]
    fn what_is_written_is_read_back() {
        for profile in [Profile::Quick, Profile::Full] {
            let config = Config::of_profile(profile);
            assert_eq!(Config::parse(&config.to_toml(), Profile::Quick).expect("valid"), config);
        }
    }
}
