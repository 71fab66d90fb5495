//! What a configuration must be, beyond what its types say.

use anyhow::{Result, bail, ensure};
use nav_core::reward::RewardProfile;
use nav_sim::families::{DESIGN_RADIUS_M, Family};

use super::{Config, GateConfig, HighConfig, LowConfig};

impl Config {
    /// Checks what types cannot.
    ///
    /// # Errors
    /// The first field that makes no sense, with what it must be.
    pub fn validate(&self) -> Result<()> {
        self.task.validate().map_err(|sentence| anyhow::anyhow!("task.{sentence}"))?;
        self.disturbance.validate().map_err(|sentence| anyhow::anyhow!("disturbance.{sentence}"))?;
        finite(&toml::Value::try_from(self)?, "")?;
        ensure!(
            self.task.robot.radius_m <= DESIGN_RADIUS_M + 1e-6,
            "task.robot.radius_m must be {DESIGN_RADIUS_M} at most: the scene families have ways for such a robot"
        );
        ensure!(self.worlds_per_family > 0, "worlds_per_family must be at least 1");
        // TOML knows no larger one, and the configuration is kept as TOML.
        ensure!(i64::try_from(self.seed).is_ok(), "seed must be below 2^63");
        self.low.validate(self.task.episode_steps)?;
        self.high.validate()?;
        ensure!(
            self.high.deviation_margins.is_empty() || self.task.decision.deviation_margin.abs() <= 0.0,
            "task.decision.deviation_margin has no effect as long as high.deviation_margins lists margins to choose from: \
             set high.deviation_margins = [] to keep yours"
        );
        self.gate.validate()
    }
}

impl LowConfig {
    fn validate(&self, episode_steps: u32) -> Result<()> {
        families("low", &self.families)?;
        ensure!(self.envs > 0, "low.envs must be at least 1");
        ensure!(
            self.warmup_steps >= self.envs as u64 && self.warmup_steps < self.env_steps,
            "low.warmup_steps must be at least low.envs and below low.env_steps"
        );
        ensure!(self.env_steps_per_update > 0, "low.env_steps_per_update must be at least 1");
        ensure!(self.batch > 0, "low.batch must be at least 1");
        ensure!(self.replay_capacity >= self.batch, "low.replay_capacity must be at least low.batch");
        ensure!(
            (1..=episode_steps).contains(&self.subgoal_steps),
            "low.subgoal_steps must lie between 1 and task.episode_steps"
        );
        let [least_m, most_m] = self.subgoal_m;
        ensure!(
            0.0 < least_m && least_m < most_m,
            "low.subgoal_m must be [least, most] with 0 < least < most"
        );
        let [least, most] = self.noise;
        ensure!(0.0 <= least && least <= most, "low.noise must be [least, most] with 0 <= least <= most");
        within("low.discount", self.discount, 0.0, 0.99999)?;
        within("low.goal_share", self.goal_share, 0.0, 1.0)?;
        within("low.final_learning_rate_share", self.final_learning_rate_share, 0.0, 1.0)?;
        within("low.collapse.from_share", self.collapse.from_share, 0.0, 1.0)?;
        within("low.collapse.reach_min", self.collapse.reach_min, 0.0, 1.0)?;
        within("low.collapse.saturation_max", self.collapse.saturation_max, 0.0, 1.0)?;
        let td3 = &self.td3;
        hidden("low.td3", &td3.hidden)?;
        within("low.td3.actor_learning_rate", td3.actor_learning_rate, 1e-8, 1.0)?;
        within("low.td3.critic_learning_rate", td3.critic_learning_rate, 1e-8, 1.0)?;
        within("low.td3.tau", td3.tau, 1e-6, 1.0)?;
        within("low.td3.tanh_slope_min", td3.tanh_slope_min, 0.0, 1.0)?;
        ensure!(td3.policy_delay > 0, "low.td3.policy_delay must be at least 1");
        for (name, value) in [
            ("target_noise", td3.target_noise),
            ("target_noise_clip", td3.target_noise_clip),
            ("actor_output_gain", td3.actor_output_gain),
            ("gradient_norm_max", td3.gradient_norm_max),
            ("smooth_temporal", td3.smooth_temporal),
            ("smooth_spatial", td3.smooth_spatial),
            ("smooth_spatial_noise", td3.smooth_spatial_noise),
        ] {
            ensure!(value >= 0.0, "low.td3.{name} must not be negative");
        }
        if self.reward == RewardProfile::Decomposed {
            crash_costs("low", self.decomposed.collided, self.decomposed.least_collided(self.discount))?;
        }
        Ok(())
    }
}

impl HighConfig {
    fn validate(&self) -> Result<()> {
        families("high", &self.families)?;
        ensure!(self.envs > 0, "high.envs must be at least 1");
        ensure!((1..=10).contains(&self.n_step), "high.n_step must lie in [1, 10]");
        // By then at least one return over n decisions is complete.
        let least = self.envs as u64 * (self.n_step as u64 + 1);
        ensure!(
            self.warmup_decisions >= least && self.warmup_decisions < self.decisions,
            "high.warmup_decisions must be at least {least} (high.envs times high.n_step + 1) and below high.decisions"
        );
        ensure!(self.decisions_per_update > 0, "high.decisions_per_update must be at least 1");
        ensure!(self.batch > 0, "high.batch must be at least 1");
        ensure!(self.replay_capacity >= self.batch, "high.replay_capacity must be at least high.batch");
        within("high.discount", self.discount, 0.0, 0.99999)?;
        within("high.epsilon[0]", self.epsilon[0], 0.0, 1.0)?;
        within("high.epsilon[1]", self.epsilon[1], 0.0, 1.0)?;
        within("high.epsilon_share", self.epsilon_share, 0.0, 1.0)?;
        within("high.random_goal_share", self.random_goal_share, 0.0, 1.0)?;
        hidden("high.dqn", &self.dqn.hidden)?;
        within("high.dqn.learning_rate", self.dqn.learning_rate, 1e-8, 1.0)?;
        within("high.final_learning_rate", self.final_learning_rate, 0.0, 1.0)?;
        within("high.dqn.tau", self.dqn.tau, 1e-6, 1.0)?;
        ensure!(self.dqn.huber_delta > 0.0, "high.dqn.huber_delta must be positive");
        ensure!(self.dqn.gradient_norm_max >= 0.0, "high.dqn.gradient_norm_max must not be negative");
        if self.reward == RewardProfile::Decomposed {
            crash_costs("high", self.decomposed.collided, self.decomposed.least_collided(self.discount))?;
        }
        Ok(())
    }
}

impl GateConfig {
    fn validate(&self) -> Result<()> {
        for (name, worlds) in [("worlds", self.worlds), ("choosing_worlds", self.choosing_worlds)] {
            ensure!((1..=100_000).contains(&worlds), "gate.{name} must lie in [1, 100000] worlds a family");
        }
        for (name, share) in [
            ("low_reach", self.low_reach),
            ("low_collision", self.low_collision),
            ("spin", self.spin),
            ("static_collision", self.static_collision),
            ("people_collision", self.people_collision),
            ("clutter_success", self.clutter_success),
            ("u_trap_success", self.u_trap_success),
        ] {
            within(&format!("gate.{name}"), share, 0.0, 1.0)?;
        }
        Ok(())
    }
}

fn within(name: &str, value: f32, least: f32, most: f32) -> Result<()> {
    ensure!(value >= least && value <= most, "{name} must lie in [{least}, {most}]");
    Ok(())
}

fn hidden(learner: &str, widths: &[usize]) -> Result<()> {
    let is_fine = !widths.is_empty() && widths.iter().all(|width| (1..=4096).contains(width));
    ensure!(is_fine, "{learner}.hidden must hold at least one width, each in [1, 4096]");
    Ok(())
}

fn families(stage: &str, families: &[Family]) -> Result<()> {
    ensure!(!families.is_empty(), "{stage}.families must name at least one family");
    for (index, family) in families.iter().enumerate() {
        if !family.trainable() {
            bail!("{stage}.families names `{family}`, which is kept for testing: remove it");
        }
        ensure!(!families[..index].contains(family), "{stage}.families names `{family}` twice");
    }
    Ok(())
}

fn crash_costs(level: &str, collided: f32, least: f32) -> Result<()> {
    ensure!(
        collided > least,
        "{level}.decomposed.collided must exceed {least}, twice what standing still for ever costs: with less, \
         crashing pays"
    );
    Ok(())
}

/// Refuses every number that is not finite, by the name of its field.
fn finite(value: &toml::Value, path: &str) -> Result<()> {
    match value {
        toml::Value::Float(number) => ensure!(number.is_finite(), "{path} must be finite"),
        toml::Value::Table(table) => {
            for (key, value) in table {
                finite(value, &if path.is_empty() { key.clone() } else { format!("{path}.{key}") })?;
            }
        }
        toml::Value::Array(values) => {
            for value in values {
                finite(value, path)?;
            }
        }
        _ => {}
    }
    Ok(())
}
