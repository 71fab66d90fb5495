//! From a TOML file to a checked configuration, and back.

use anyhow::{Context, Result, bail};
use nav_core::task::Task;
use nav_env::robot_profile::RobotProfile;
use std::path::Path;

use super::{Config, Profile};

impl Config {
    /// Reads a TOML file. Its `profile` (or `default_profile`) and its `robot` (or the one that is given) give the fields
    /// that it does not name.
    ///
    /// # Errors
    /// A file that cannot be read, is not TOML, or has an unknown field or a value of the wrong kind.
    pub fn read(path: &Path, default_profile: Profile, robot: Option<&RobotProfile>) -> Result<Self> {
        let text = std::fs::read_to_string(path)
            .with_context(|| format!("cannot read the configuration {}: check --config", path.display()))?;
        Self::parse_for(&text, default_profile, robot)
            .with_context(|| format!("the configuration {}", path.display()))
    }

    /// The defaults of a profile for a robot.
    pub fn of_robot(profile: Profile, robot: &RobotProfile) -> Self {
        Self { robot: Some(robot.name.clone()), ..Self::of(profile, robot.task()) }
    }

    /// As [`Self::read`], from a text.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn parse(text: &str, default_profile: Profile) -> Result<Self> {
        Self::parse_for(text, default_profile, None)
    }

    fn parse_for(text: &str, default_profile: Profile, robot: Option<&RobotProfile>) -> Result<Self> {
        let overrides: toml::Table = text.parse().context("is not valid TOML")?;
        let named = named_robot(&overrides)?;
        if let (Some(robot), Some(own)) = (robot, overrides.get("robot")) {
            bail!("--robot {} contradicts the robot in --config ({own}): drop one of them", robot.name);
        }
        let config = Self::merged(overrides, default_profile, robot.or(named.as_ref()))?;
        config.validate()?;
        Ok(config)
    }

    /// As [`Self::parse`], of a configuration that was checked when it was new: rules may have changed since.
    ///
    /// # Errors
    /// As [`Self::parse`], but for values that make no sense.
    pub fn parse_unchecked(text: &str, default_profile: Profile) -> Result<Self> {
        // All of its robot is in it, even where the profile is gone.
        Self::merged(text.parse().context("is not valid TOML")?, default_profile, None)
    }

    fn merged(
        mut overrides: toml::Table,
        default_profile: Profile,
        robot: Option<&RobotProfile>,
    ) -> Result<Self> {
        let profile = match overrides.get("profile") {
            None => default_profile,
            Some(value) => value.clone().try_into().context("`profile` must be \"quick\" or \"full\"")?,
        };
        let name = robot.map(|robot| robot.name.clone().into()).or(overrides.remove("robot"));
        overrides.remove("robot");
        let task = driven(&overrides, robot.map_or_else(Task::default, RobotProfile::task))?;
        let mut merged = toml::Table::try_from(Self::of(profile, task)).context("cannot be merged")?;
        merge(&mut merged, overrides, "")?;
        merged.extend(name.map(|name| ("robot".to_owned(), name)));
        merged.try_into().context("has a value of the wrong kind")
    }

    /// As TOML, every field.
    pub fn to_toml(&self) -> String {
        toml::to_string_pretty(self).expect("a configuration is plain numbers, texts and lists")
    }
}

/// The profile that a file names, unless it says all of the robot by itself, as a run's own configuration does.
fn named_robot(overrides: &toml::Table) -> Result<Option<RobotProfile>> {
    let Some(name) = overrides.get("robot") else { return Ok(None) };
    let name = name.as_str().context("`robot` must be the name or the file of a profile, as a text")?;
    let says_all = |section: &str, whole: &toml::Value| {
        let said = overrides.get("task").and_then(|task| task.get(section));
        let said = said.and_then(toml::Value::as_table);
        whole
            .as_table()
            .is_some_and(|whole| said.is_some_and(|said| whole.keys().all(|field| said.contains_key(field))))
    };
    let Task { robot, lidar, .. } = Task::default();
    if says_all("robot", &toml::Value::try_from(robot)?) && says_all("lidar", &toml::Value::try_from(lidar)?)
    {
        return Ok(None);
    }
    Ok(Some(RobotProfile::read(name)?))
}

/// The task that the other defaults follow from: that of the robot's profile, with robot and control period as they are said.
fn driven(overrides: &toml::Table, of_profile: Task) -> Result<Task> {
    let Some(said) = overrides.get("task").and_then(toml::Value::as_table) else {
        return Ok(of_profile);
    };
    let mut base = toml::Table::try_from(of_profile).context("cannot be merged")?;
    let named = said.iter().filter(|(key, _)| ["robot", "control_period_s"].contains(&key.as_str()));
    merge(&mut base, named.map(|(key, value)| (key.clone(), value.clone())).collect(), "task")?;
    let Task { robot, lidar, control_period_s, .. } =
        base.try_into().context("has a value of the wrong kind")?;
    Ok(Task { lidar, control_period_s, ..Task::of(robot) })
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
            // One of several shapes, each with fields of its own.
            (Some(slot), value) if full.ends_with("robot.footprint") => *slot = value,
            (Some(toml::Value::Table(inner)), toml::Value::Table(table)) => merge(inner, table, &full)?,
            (Some(slot), value) => *slot = value,
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use nav_core::footprint::Footprint;

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
        assert!(message("[task.robot]\nfootprint.circle.radius_m = -1.0").contains("task.robot.footprint"));
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
        let text = "[task]\ncontrol_period_s = 0.05\n[task.robot]\nfootprint.circle.radius_m = 0.4\nlinear_max_mps = 1.0\n\
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
    fn a_named_robot_gives_the_defaults_and_what_the_file_says_wins() {
        let jackal = RobotProfile::read("jackal").expect("built in");
        let config = Config::of_robot(Profile::Quick, &jackal);
        assert_eq!((config.robot.as_deref(), config.task), (Some("jackal"), jackal.task()));
        let named = Config::parse("robot = 'jackal'", Profile::Quick).expect("valid");
        assert_eq!(named, config, "in a file as on the command line");

        let text = "[task.robot]\nlinear_max_mps = 1.0\n[task.lidar]\nrange_max_m = 8.0";
        let changed = Config::parse_for(text, Profile::Quick, Some(&jackal)).expect("valid");
        let task = &changed.task;
        assert_eq!(
            (task.robot.linear_max_mps, task.lidar.range_max_m, task.lidar.beam_count),
            (1.0, 8.0, 69)
        );
        // Half as fast: twice as long for everything, as if the profile had said so.
        assert_eq!(task.episode_s.to_bits(), (2.0 * config.task.episode_s).to_bits());
        assert!((changed.low.subgoal_s - 2.0 * config.low.subgoal_s).abs() < 1e-4);

        let message = |text| format!("{:#}", Config::parse(text, Profile::Quick).expect_err("refused"));
        assert!(message("robot = 'jakal'").contains("turtlebot3_burger"), "{}", message("robot = 'jakal'"));
        assert!(message("robot = 3").contains("`robot` must be"));
        let twice = Config::parse_for("robot = 'husky'", Profile::Quick, Some(&jackal));
        let twice = format!("{:#}", twice.expect_err("refused"));
        assert!(twice.contains("--robot jackal contradicts"), "{twice}");
    }

    #[test]
    fn a_runs_own_configuration_needs_no_profile() {
        let mut mine = RobotProfile::read("agv").expect("built in");
        mine.name = "gone".to_owned();
        let config = Config::of_robot(Profile::Quick, &mine);
        assert_eq!(Config::parse(&config.to_toml(), Profile::Quick).expect("all is said"), config);
        assert_eq!(Config::parse_unchecked(&config.to_toml(), Profile::Quick).expect("all is said"), config);
    }

    #[test]
    fn a_footprint_of_another_shape_takes_the_place_of_the_default_one() {
        let text =
            "[task.robot]\nfootprint = { rectangle = { front_m = 0.4, rear_m = 0.1, half_width_m = 0.3 } }";
        let config = Config::parse(text, Profile::Quick).expect("valid");
        let footprint = Footprint::Rectangle { front_m: 0.4, rear_m: 0.1, half_width_m: 0.3 };
        assert_eq!(config.task.robot.footprint, footprint);
        // The circle that it turns in has a radius of 0.5 m, of which two thirds are more than half of its width.
        assert!((config.task.decision.subgoal_distance_m - 10.0 / 3.0).abs() < 1e-5);
        assert_eq!(Config::parse(&config.to_toml(), Profile::Full).expect("valid"), config);
        let old =
            Config::parse("[task.robot]\nradius_m = 0.2", Profile::Quick).expect_err("as it was said once");
        assert!(format!("{old:#}").contains("known here: "), "{old:#}");
    }

    #[test]
    fn what_is_written_is_read_back() {
        for profile in [Profile::Quick, Profile::Full] {
            let config = Config::of_profile(profile);
            assert_eq!(Config::parse(&config.to_toml(), Profile::Quick).expect("valid"), config);
        }
    }
}
