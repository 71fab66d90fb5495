//! What a configuration must be, beyond what its types say.

use anyhow::{Result, bail, ensure};
use nav_core::network::MAX_LAYERS;
use nav_core::observation::{HIGH_OBSERVATION, LOW_ACTION, LOW_OBSERVATION};
use nav_core::task::Task;
use nav_sim::families::Family;

use super::{Config, HighConfig, LowConfig, bounds};
use crate::dqn::Decision;
use crate::td3::Transition;

/// Numbers in a row of the replay buffers.
const LOW_ROW: usize = Transition::row_length(LOW_OBSERVATION, LOW_ACTION);
const HIGH_ROW: usize = Decision::row_length(HIGH_OBSERVATION);

impl Config {
    /// Checks what types cannot.
    ///
    /// # Errors
    /// The first field that makes no sense, with what it must be.
    pub fn validate(&self) -> Result<()> {
        ensure!(
            i64::try_from(self.seed).is_ok(),
            "seed (--seed) is {}, and must lie in [0, {}]: TOML, in which the configuration is kept, has no larger numbers",
            self.seed,
            i64::MAX
        );
        self.task.validate().map_err(|sentence| anyhow::anyhow!("task.{sentence}"))?;
        self.disturbance.validate().map_err(|sentence| anyhow::anyhow!("disturbance.{sentence}"))?;
        let toml = toml::Value::try_from(self)?;
        finite(&toml, "")?;
        replay("low.replay_capacity", self.low.replay_capacity, LOW_ROW)?;
        replay("high.replay_capacity", self.high.replay_capacity, HIGH_ROW)?;
        bounds::check(&toml, "")?;
        self.low.validate(&self.task)?;
        self.high.validate()?;
        ensure!(
            self.high.deviation_margins.is_empty() || self.task.decision.deviation_margin.abs() <= 0.0,
            "task.decision.deviation_margin has no effect as long as high.deviation_margins lists margins to choose from: \
             set high.deviation_margins = [] to keep yours"
        );
        Ok(())
    }
}

impl LowConfig {
    fn validate(&self, task: &Task) -> Result<()> {
        families("low", &self.families)?;
        ensure!(
            self.warmup_steps >= self.envs as u64 && self.warmup_steps < self.env_steps,
            "low.warmup_steps must be at least low.envs and below low.env_steps"
        );
        ensure!(self.replay_capacity >= self.batch, "low.replay_capacity must be at least low.batch");
        ensure!(
            (task.control_period_s..=task.episode_s).contains(&self.subgoal_s),
            "low.subgoal_s must lie between task.control_period_s and task.episode_s"
        );
        let [least_m, most_m] = self.subgoal_m;
        ensure!(
            0.0 < least_m && least_m < most_m,
            "low.subgoal_m must be [least, most] with 0 < least < most"
        );
        let [least, most] = self.noise;
        ensure!(0.0 <= least && least <= most, "low.noise must be [least, most] with 0 <= least <= most");
        hidden("low.td3", &self.td3.hidden)?;
        crash_costs("low", self.paid().least_crash_if_crashing_pays(self.discount))
    }
}

impl HighConfig {
    fn validate(&self) -> Result<()> {
        families("high", &self.families)?;
        // By then at least one return over n decisions is complete.
        let least = self.envs as u64 * (self.n_step as u64 + 1);
        ensure!(
            self.warmup_decisions >= least && self.warmup_decisions < self.decisions,
            "high.warmup_decisions must be at least {least} (high.envs times high.n_step + 1) and below high.decisions"
        );
        ensure!(self.replay_capacity >= self.batch, "high.replay_capacity must be at least high.batch");
        hidden("high.dqn", &self.dqn.hidden)?;
        crash_costs("high", self.paid().least_crash_if_crashing_pays(self.discount))
    }
}

/// A replay buffer is reserved at once: more than its range is refused with the memory that it would need.
fn replay(field: &str, rows: usize, row: usize) -> Result<()> {
    let bound = bounds::BOUNDS.iter().find(|bound| bound.field == field);
    let most = bound.map_or(f64::INFINITY, |bound| bound.most);
    let gigabytes = |rows: f64| rows * row as f64 * 4e-9;
    ensure!(
        rows as f64 <= most,
        "{field} is {rows}, which needs {:.0} GB of memory; it must be {most} at most ({:.1} GB)",
        gigabytes(rows as f64),
        gigabytes(most)
    );
    Ok(())
}

fn hidden(learner: &str, widths: &[usize]) -> Result<()> {
    ensure!(
        (1..MAX_LAYERS).contains(&widths.len()),
        "{learner}.hidden has {} layers, and must have 1 to {}: the robot's executor takes no more",
        widths.len(),
        MAX_LAYERS - 1
    );
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

fn crash_costs(level: &str, least_if_crashing_pays: Option<f32>) -> Result<()> {
    if let Some(least) = least_if_crashing_pays {
        bail!(
            "{level}.decomposed.collided must exceed {least}, twice what standing still for ever costs: with less, \
             crashing pays"
        );
    }
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
