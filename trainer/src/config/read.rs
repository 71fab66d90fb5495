//! From a TOML file to a checked configuration, and back.

use anyhow::{Context, Result, bail, ensure};
use nav_core::reward::RewardProfile;
use nav_sim::families::DESIGN_RADIUS_M;
use sha2::{Digest, Sha256};
use std::path::Path;

use super::{Config, Profile};

impl Config {
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
        ensure!(
            self.task.robot.radius_m <= DESIGN_RADIUS_M + 1e-6,
            "task.robot.radius_m must be {DESIGN_RADIUS_M} at most: the scene families have ways for such a robot"
        );
        let (low, high) = (&self.low, &self.high);
        ensure!(self.worlds_per_family > 0, "worlds_per_family must be at least 1");
        for (stage, families) in [("low", &low.families), ("high", &high.families)] {
            ensure!(!families.is_empty(), "{stage}.families must name at least one family");
            if let Some(family) = families.iter().find(|family| !family.trainable()) {
                bail!("{stage}.families names `{family}`, which is kept for testing: remove it");
            }
        }
        ensure!(low.envs > 0 && high.envs > 0, "low.envs and high.envs must be at least 1");
        ensure!(
            (1..=self.task.episode_steps).contains(&low.subgoal_steps),
            "low.subgoal_steps must lie between 1 and task.episode_steps"
        );
        ensure!(low.env_steps_per_update > 0, "low.env_steps_per_update must be at least 1");
        ensure!(high.decisions_per_update > 0, "high.decisions_per_update must be at least 1");
        ensure!(low.batch > 0 && high.batch > 0, "low.batch and high.batch must be at least 1");
        ensure!(low.replay_capacity >= low.batch, "low.replay_capacity must be at least low.batch");
        ensure!(high.replay_capacity >= high.batch, "high.replay_capacity must be at least high.batch");
        ensure!((0.0..1.0).contains(&low.discount), "low.discount must lie in [0, 1)");
        ensure!(
            (0.0..=1.0).contains(&low.final_learning_rate_share),
            "low.final_learning_rate_share must lie in [0, 1]"
        );
        ensure!((0.0..1.0).contains(&high.discount), "high.discount must lie in [0, 1)");
        ensure!((0.0..=1.0).contains(&low.goal_share), "low.goal_share must lie in [0, 1]");
        ensure!((1..=10).contains(&high.n_step), "high.n_step must lie in [1, 10]");
        ensure!(!high.deviation_margins.is_empty(), "high.deviation_margins must hold at least one margin");
        let rules = [
            ("low", low.reward, low.decomposed.collided, low.decomposed.least_collided(low.discount)),
            ("high", high.reward, high.decomposed.collided, high.decomposed.least_collided(high.discount)),
        ];
        for (level, reward, collided, least) in rules {
            ensure!(
                reward != RewardProfile::Decomposed || collided > least,
                "{level}.decomposed.collided must exceed {least}, twice what standing still for ever costs: with \
                 less, crashing pays"
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
