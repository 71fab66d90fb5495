//! Robots by name, and everybody's own as a file: what a base and its lidar are, as TOML.
//!
//! ```toml
//! control_period_s = 0.2    # if it is not 0.1
//! [robot]                   # the fields of nav_core::task::Robot
//! footprint = { circle = { radius_m = 0.105 } }
//! linear_max_mps = 0.22
//! angular_max_radps = 2.84
//! [lidar]                   # those of nav_core::task::Lidar
//! beam_count = 72
//! range_max_m = 3.5
//! ```
//! What a task has besides follows from the robot ([`Task::of`]). The profiles of `robots/` are part of the program, so that
//! their names mean the same wherever it is started. [`odd`] says what is odd about a robot, [`facts`] what follows from it.

pub mod facts;
pub mod odd;

use nav_core::task::{Lidar, Robot, Task};
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// The profiles that every build knows, with their texts.
const BUILT_IN: [(&str, &str); 7] = [
    ("turtlebot3_burger", include_str!("../../../robots/turtlebot3_burger.toml")),
    ("turtlebot3_waffle", include_str!("../../../robots/turtlebot3_waffle.toml")),
    ("turtlebot4", include_str!("../../../robots/turtlebot4.toml")),
    ("jackal", include_str!("../../../robots/jackal.toml")),
    ("husky", include_str!("../../../robots/husky.toml")),
    ("pioneer_front_lidar", include_str!("../../../robots/pioneer_front_lidar.toml")),
    ("agv", include_str!("../../../robots/agv.toml")),
];

/// Letters of a name at most.
const NAME_MAX: usize = 40;

/// What a profile must say: anything else would be a guess about somebody's robot.
const REQUIRED: [(&str, &[&str]); 2] = [
    ("robot", &["footprint", "linear_max_mps", "angular_max_radps"]),
    ("lidar", &["beam_count", "range_max_m"]),
];

/// What it should say, but that has a usual value: field, and what depends on it.
const ASSUMED: [(&str, &str); 3] = [
    ("linear_acceleration_mps2", "how far it drives until it stands"),
    ("angular_acceleration_radps2", "how fast it begins to turn"),
    ("latency_s", "how early the safety gate acts"),
];

/// A robot and its lidar.
#[derive(Clone, Debug, PartialEq)]
pub struct RobotProfile {
    /// That of the profile, or of its file without folder and extension.
    pub name: String,
    /// The base.
    pub robot: Robot,
    /// The lidar.
    pub lidar: Lidar,
    /// From one control tick to the next, s.
    pub control_period_s: f32,
    /// Fields of `robot` that it does not say.
    assumed: Vec<&'static str>,
}

/// Why there is no such profile.
#[derive(Debug, thiserror::Error)]
pub enum ProfileError {
    /// Neither a name nor a file.
    #[error(
        "there is no robot named {given:?} and no such file: give one of {}, or a TOML file with [robot] and [lidar]",
        names().collect::<Vec<_>>().join(", ")
    )]
    Unknown {
        /// What was given.
        given: String,
    },
    /// The file could not be read.
    #[error("cannot read the robot {}", .path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The text is no profile.
    #[error("the robot {given} {problem}")]
    Parse {
        /// What was given.
        given: String,
        /// What is wrong, and in which line.
        problem: String,
    },
}

/// The text, as serde sees it.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Said {
    robot: Robot,
    lidar: Lidar,
    control_period_s: Option<f32>,
}

/// The names that every build knows.
pub fn names() -> impl Iterator<Item = &'static str> {
    BUILT_IN.iter().map(|(name, _)| *name)
}

impl RobotProfile {
    /// That of a name, or of a file.
    ///
    /// # Errors
    /// An unknown name, or a file that cannot be read, is no profile, or describes no robot that could be driven.
    pub fn read(given: &str) -> Result<Self, ProfileError> {
        let path = Path::new(given);
        if let Some((name, text)) = BUILT_IN.iter().find(|(name, _)| *name == given) {
            return Self::parse(given, name, text);
        }
        let is_path = given.contains(['/', '\\']) || path.extension().is_some();
        if !is_path && !path.is_file() {
            return Err(ProfileError::Unknown { given: given.to_owned() });
        }
        let text = std::fs::read_to_string(path)
            .map_err(|source| ProfileError::Read { path: path.to_path_buf(), source })?;
        let name = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
        // It names runs, and stands in manifests and tables.
        let is_plain = |letter: char| letter.is_ascii_alphanumeric() || "_-.+".contains(letter);
        if name.is_empty() || name.len() > NAME_MAX || !name.chars().all(is_plain) {
            let problem =
                format!("needs another file name: it has 1 to {NAME_MAX} letters, digits and _ - . +");
            return Err(ProfileError::Parse { given: given.to_owned(), problem });
        }
        Self::parse(given, &name, &text)
    }

    fn parse(given: &str, name: &str, text: &str) -> Result<Self, ProfileError> {
        let problem = |problem: String| ProfileError::Parse { given: given.to_owned(), problem };
        let table: toml::Table = text.parse().map_err(|error| problem(located(text, &error)))?;
        let said =
            |section: &str, field: &str| table.get(section).and_then(|section| section.get(field)).is_some();
        // What is misspelt is said before what is then missing.
        let Said { robot, lidar, control_period_s } = match toml::from_str(text) {
            Ok(said) => said,
            Err(error) => return Err(problem(located(text, &error))),
        };
        for (section, fields) in REQUIRED {
            if let Some(field) = fields.iter().find(|field| !said(section, field)) {
                return Err(problem(format!("does not say {section}.{field}: it must")));
            }
        }
        let assumed = ASSUMED.iter().map(|(field, _)| *field).filter(|field| !said("robot", field)).collect();
        let control_period_s = control_period_s.unwrap_or(Task::of(robot).control_period_s);
        let profile = Self { name: name.to_owned(), robot, lidar, control_period_s, assumed };
        match profile.task().validate() {
            Ok(()) => Ok(profile),
            Err(sentence) => Err(problem(format!("cannot be used: {sentence}"))),
        }
    }

    /// What it is trained for, and drives.
    pub fn task(&self) -> Task {
        let Self { robot, lidar, control_period_s, .. } = *self;
        Task { lidar, control_period_s, ..Task::of(robot) }
    }

    /// In what the robot of a task is another than this, if in anything: the field, and both values.
    pub fn difference(&self, task: &Task) -> Option<String> {
        let table = |robot: &Robot, lidar: &Lidar, control_period_s: f32| {
            let mut table = toml::Table::new();
            table.insert("robot".to_owned(), toml::Value::try_from(robot).ok()?);
            table.insert("lidar".to_owned(), toml::Value::try_from(lidar).ok()?);
            table.insert("control_period_s".to_owned(), f64::from(control_period_s).into());
            Some(toml::Value::Table(table))
        };
        let own = table(&self.robot, &self.lidar, self.control_period_s)?;
        let other = table(&task.robot, &task.lidar, task.control_period_s)?;
        let (field, other, own) = first_difference(&other, &own, "")?;
        Some(format!("{field} is {other}, and {own} of {}", self.name))
    }
}

/// The first field in which two values differ, and both.
fn first_difference(one: &toml::Value, other: &toml::Value, path: &str) -> Option<(String, String, String)> {
    match (one, other) {
        _ if one == other => None,
        (toml::Value::Table(one), toml::Value::Table(other)) => one.iter().find_map(|(key, value)| {
            let full = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
            let Some(other) = other.get(key) else {
                return Some((full, value.to_string(), "none".to_owned()));
            };
            first_difference(value, other, &full)
        }),
        _ => Some((path.to_owned(), short(one), short(other))),
    }
}

/// A number as it was typed: 0.8, not the nearest `f32` in the digits of an `f64`.
fn short(value: &toml::Value) -> String {
    value.as_float().map_or_else(|| value.to_string(), |number| (number as f32).to_string())
}

/// What TOML says, with the line that it says it of.
fn located(text: &str, error: &toml::de::Error) -> String {
    let message = error.message().trim();
    let Some(span) = error.span() else { return format!("is no profile: {message}") };
    let before = text.get(..span.start).unwrap_or_default();
    let number = before.matches('\n').count();
    let line = text.lines().nth(number).unwrap_or_default().trim();
    format!("is no profile: line {} (`{line}`): {message}", number + 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nav_core::footprint::Footprint;

    fn parse(text: &str) -> Result<RobotProfile, String> {
        RobotProfile::parse("mine.toml", "mine", text).map_err(|error| error.to_string())
    }

    const SAID: &str = "[robot]\nfootprint.circle.radius_m = 0.3\nlinear_max_mps = 0.5\nangular_max_radps = 1.0\n\
                        [lidar]\nbeam_count = 60\nrange_max_m = 8.0\n";

    #[test]
    fn every_built_in_profile_is_a_robot_under_its_own_name() {
        for (name, text) in BUILT_IN {
            let profile = RobotProfile::read(name).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(profile.name, name);
            assert_eq!(profile.task().validate(), Ok(()));
            assert_eq!(profile.assumed, Vec::<&str>::new(), "{name} says all of its robot");
            assert!(profile.lidar.beam_count <= 80, "{name}: a run must not take longer than usual");
            // A source beside each number.
            for line in text.lines().filter(|line| line.contains(" = ")) {
                let is_told = line.contains('#') || {
                    let before = text.split(line).next().unwrap_or_default();
                    before.lines().last().is_some_and(|line| line.starts_with('#'))
                };
                assert!(is_told, "{name}: where is this from? {line}");
            }
        }
    }

    #[test]
    fn the_folder_of_profiles_holds_these_and_no_other() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../robots");
        let mut found: Vec<String> = std::fs::read_dir(folder)
            .expect("the workspace has it")
            .map(|entry| entry.expect("readable").file_name().to_string_lossy().into_owned())
            .collect();
        let mut known: Vec<String> = names().map(|name| format!("{name}.toml")).collect();
        found.sort();
        known.sort();
        assert_eq!(found, known);
    }

    #[test]
    fn what_is_not_said_follows_from_the_robot() {
        let profile = parse(SAID).expect("a profile");
        let task = profile.task();
        let Robot { footprint, linear_max_mps, .. } = task.robot;
        let said = (footprint, linear_max_mps, task.lidar.beam_count);
        assert_eq!(said, (Footprint::circle(0.3), 0.5, 60));
        assert_eq!(task, Task { lidar: task.lidar, ..Task::of(task.robot) });
        assert_eq!(profile.assumed.len(), 3, "and is known to be assumed");
        let fast = parse(&format!("control_period_s = 0.05\n{SAID}")).expect("a profile");
        assert!((fast.task().control_period_s - 0.05).abs() < 1e-6);
    }

    #[test]
    fn nonsense_is_refused_by_name() {
        for (text, parts) in [
            (SAID.replace("0.3", "'wide'"), &["line 2 (`footprint.circle.radius_m = 'wide'`)"][..]),
            (SAID.replace("radius_m", "radus_m"), &["line 2", ": radus_m", ": radius_m"]),
            (SAID.replace("linear_max_mps", "speed"), &["`speed`", "`footprint`", "`latency_s`", "line 3"]),
            (SAID.replace("[lidar]", "[laser]"), &["`laser`", "`lidar`", "`control_period_s`"]),
            (SAID.replace("0.3", "-0.3"), &["cannot be used: robot.footprint must be"]),
            (SAID.replace("8.0", "0.5"), &["lidar.range_max_m must be at least"]),
            (SAID.replace("linear_max_mps = 0.5\n", ""), &["does not say robot.linear_max_mps"]),
            (SAID.replace("beam_count = 60\n", ""), &["does not say lidar.beam_count"]),
            (format!("control_period_s = 2.0\n{SAID}"), &["control_period_s must lie in [0.001, 1]"]),
            ("[robot".to_owned(), &["line 1"]),
        ] {
            let error = parse(&text).expect_err(&text);
            for part in parts {
                assert!(error.contains(part), "{part}: {error}");
            }
        }
    }

    #[test]
    fn a_name_is_known_everywhere_and_a_file_is_read() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("my_robot.toml");
        std::fs::write(&path, SAID).expect("written");
        let profile = RobotProfile::read(&path.to_string_lossy()).expect("a profile");
        assert_eq!(profile.name, "my_robot");
        let unknown = RobotProfile::read("jakal").expect_err("unknown").to_string();
        assert!(names().all(|name| unknown.contains(name)) && unknown.contains("TOML file"), "{unknown}");
        let spaced = folder.path().join("my robot.toml");
        std::fs::write(&spaced, SAID).expect("written");
        let spaced = RobotProfile::read(&spaced.to_string_lossy()).expect_err("a name for nothing");
        assert!(spaced.to_string().contains("needs another file name"), "{spaced}");
        let absent = RobotProfile::read("no/such.toml").expect_err("absent").to_string();
        assert!(absent.contains("cannot read the robot no/such.toml"), "{absent}");
    }

    #[test]
    fn robots_that_differ_are_told_apart_by_their_first_field() {
        let profile = parse(SAID).expect("a profile");
        assert_eq!(profile.difference(&profile.task()), None);
        let mut task = profile.task();
        // What a policy decides by itself is not the robot's.
        task.decision.hold_s = 1.0;
        assert_eq!(profile.difference(&task), None);
        task.lidar.range_max_m = 8.5;
        assert_eq!(profile.difference(&task).as_deref(), Some("lidar.range_max_m is 8.5, and 8 of mine"));
        let slow = Task { control_period_s: 0.2, ..profile.task() };
        assert!(profile.difference(&slow).is_some_and(|said| said.contains("control_period_s is 0.2")));
    }
}
