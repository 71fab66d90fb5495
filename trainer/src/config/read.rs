//! From a TOML file to a checked configuration, and back.

use anyhow::{Context, Result, bail};
use nav_core::task::Task;
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
        let task = driven(&overrides)?;
        let mut merged = toml::Table::try_from(Self::of(profile, task)).context("cannot be merged")?;
        merge(&mut merged, overrides, "")?;
        merged.try_into().context("has a value of the wrong kind")
    }

    /// As TOML, every field.
    pub fn to_toml(&self) -> String {
        toml::to_string_pretty(self).expect("a configuration is plain numbers, texts and lists")
    }
}

/// The task that the other defaults follow from: its robot and its control period, where they are said.
fn driven(overrides: &toml::Table) -> Result<Task> {
    let Some(said) = overrides.get("task").and_then(toml::Value::as_table) else {
        return Ok(Task::default());
    };
    let mut base = toml::Table::try_from(Task::default()).context("cannot be merged")?;
    let named = said.iter().filter(|(key, _)| ["robot", "control_period_s"].contains(&key.as_str()));
    merge(&mut base, named.map(|(key, value)| (key.clone(), value.clone())).collect(), "task")?;
    let Task { robot, control_period_s, .. } = base.try_into().context("has a value of the wrong kind")?;
    Ok(Task { control_period_s, ..Task::of(robot) })
}

/// Lays `overrides` over `base`, refusing keys that `base` does not have.
pub(super) fn merge(base: &mut toml::Table, overrides: toml::Table, path: &str) -> Result<()> {
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
    fn defaults_follow_from_the_robot_and_what_is_said_stays() {
        let text = "[task]\ncontrol_period_s = 0.05\n[task.robot]\nradius_m = 0.4\nlinear_max_mps = 1.0\n\
                    [task.decision]\nhold_s = 3.0\n[low]\ndiscount = 0.9";
        let config = Config::parse(text, Profile::Quick).expect("valid");
        let (task, low) = (&config.task, &config.low);
        // Twice as large and as fast: everything takes twice as long, and a step is four ticks.
        let lengths_m = [
            task.goal_radius_m,
            task.decision.subgoal_distance_m,
            low.subgoal_m[1],
            low.decomposed.proximity_m,
        ];
        assert_eq!(lengths_m.map(f32::to_bits), [0.6, 4.0, 6.0, 0.5_f32].map(f32::to_bits));
        let times_s = [task.episode_s, task.decision.hold_s, task.decision.horizon_s, low.subgoal_s];
        assert_eq!(times_s.map(f32::to_bits), [100.0, 3.0, 100.0, 16.0_f32].map(f32::to_bits));
        assert_eq!((low.n_step, low.decomposed.progress, low.decomposed.time), (12, 1.25, 0.005));
        assert!((config.high.discount.powi(4) - 0.995).abs() < 1e-6 && (low.discount - 0.9).abs() < 1e-6);
        assert_eq!(
            (config.low.warmup_steps, config.high.decomposed.reached),
            (5_000, 10.0),
            "counts and shares stay"
        );
        let twice = Config::parse(&config.to_toml(), Profile::Quick).expect("valid");
        assert_eq!(twice, config);
    }

    #[test]
    fn what_is_written_is_read_back() {
        for profile in [Profile::Quick, Profile::Full] {
            let config = Config::of_profile(profile);
            assert_eq!(Config::parse(&config.to_toml(), Profile::Quick).expect("valid"), config);
        }
    }
}
