//! From a TOML file to a checked configuration, and back.

use anyhow::{Context, Result, bail};
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
        let config = Self::parse_unchecked(text, default_profile)?;
        config.validate()?;
        Ok(config)
    }

    /// As [`Self::parse`], of a configuration that was checked when it was new: rules may have changed since.
    ///
    /// # Errors
    /// As [`Self::parse`], but for values that make no sense.
    pub fn parse_unchecked(text: &str, default_profile: Profile) -> Result<Self> {
        let overrides: toml::Table = text.parse().context("is not valid TOML")?;
        let profile = match overrides.get("profile") {
            None => default_profile,
            Some(value) => value.clone().try_into().context("`profile` must be \"quick\" or \"full\"")?,
        };
        let mut merged = toml::Table::try_from(Self::of_profile(profile)).context("cannot be merged")?;
        merge(&mut merged, overrides, "")?;
        merged.try_into().context("has a value of the wrong kind")
    }

    /// As TOML, every field.
    pub fn to_toml(&self) -> String {
        toml::to_string_pretty(self).expect("a configuration is plain numbers, texts and lists")
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
        for (text, field) in [
            ("[low]\nsubgoal_m = [3.0, 0.7]", "low.subgoal_m"),
            ("[low]\nnoise = [nan, 0.5]", "low.noise must be finite"),
            ("[low]\nwarmup_steps = 400_000", "low.warmup_steps"),
            ("[low.td3]\nhidden = [0]", "low.td3.hidden"),
            ("[low.td3]\nhidden = [8, 8, 8, 8, 8, 8, 8, 8]", "low.td3.hidden has 8 layers"),
            ("[low.td3]\nhidden = []", "low.td3.hidden has 0 layers"),
            ("[low]\nreplay_capacity = 4000000000", "low.replay_capacity is 4000000000, which needs 26"),
            ("worlds_per_family = 4294967295", "worlds_per_family"),
            ("[high]\nwarmup_decisions = 0", "high.warmup_decisions"),
            ("[high.dqn]\nhuber_delta = 0.0", "high.dqn.huber_delta"),
            ("[high]\nfamilies = ['maze', 'maze']", "twice"),
            ("[gate]\nworlds = 0", "gate.worlds"),
            ("[task.decision]\ndeviation_margin = 0.3", "high.deviation_margins = []"),
            ("[gate]\nspin = nan", "gate.spin must be finite"),
        ] {
            assert!(message(text).contains(field), "{}", message(text));
        }
        let kept = "[task.decision]\ndeviation_margin = 0.3\n[high]\ndeviation_margins = []";
        Config::parse(kept, Profile::Quick).expect("then it is the margin");
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
