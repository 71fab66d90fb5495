//! What will run, checked: paths read, names and numbers valid.

use anyhow::{Context, Result, bail, ensure};
use nav_core::manifest::{MANIFEST_FILE, MANIFEST_FORMAT, Manifest, ManifestError};
use nav_core::task::Task;
use nav_env::limits::Limits;
use nav_env::robot_profile::RobotProfile;
use nav_host::files::check_writable;
use nav_ipc::{IpcConfig, RobotName};
use nav_sim::disturbance::Disturbance;
use std::path::{Path, PathBuf};
use std::time::Duration;

use crate::cli::{Arguments, Pace, ViewChoice};
use crate::report;
use crate::worlds::WorldSource;

/// All that the command line asks for. Nothing in it can fail for being badly typed any more.
#[derive(Debug)]
pub(crate) struct Plan {
    pub(crate) source: WorldSource,
    pub(crate) task: Task,
    pub(crate) disturbance: Disturbance,
    pub(crate) seed: u64,
    pub(crate) episodes: u32,
    pub(crate) pace: Pace,
    pub(crate) robot: RobotName,
    pub(crate) ipc: IpcConfig,
    pub(crate) report: Option<PathBuf>,
    pub(crate) with_poses: bool,
    pub(crate) draw: Option<PathBuf>,
    pub(crate) show_map: bool,
    pub(crate) wait: Duration,
    pub(crate) silence: Duration,
}

impl Plan {
    /// Checks everything that can be wrong before anything is opened.
    pub(crate) fn check(arguments: Arguments) -> Result<Self> {
        let robot = arguments.robot_profile.as_deref().map(RobotProfile::read).transpose()?;
        let task = match &arguments.model {
            Some(folder) => {
                let task = task_of(folder)?;
                if let Some(difference) = robot.and_then(|robot| robot.difference(&task)) {
                    bail!(
                        "the model {} was trained for another robot than --robot-profile says: {difference}; leave out one \
                         of the two",
                        folder.display()
                    );
                }
                task
            }
            None => robot.map_or_else(Task::default, |robot| robot.task()),
        };
        let source = WorldSource::from_arguments(&arguments, &task)?;
        let limits = Limits { time_limit_s: arguments.time_limit, goal_radius_m: arguments.goal_radius };
        limits.validate().map_err(anyhow::Error::msg)?;
        let task = limits.task(&task, source.episode_s(&task.robot));
        let seconds = |flag: &str, value: f64| {
            Duration::try_from_secs_f64(value)
                .ok()
                .filter(|duration| !duration.is_zero())
                .with_context(|| format!("{flag} must be a positive number of seconds"))
        };
        let silence = arguments.silence.unwrap_or(match arguments.pace {
            Pace::Lockstep => 2.0,
            Pace::Realtime => 10.0,
        });
        if let Some(path) = &arguments.report {
            // Known now and not after the drive.
            check_writable(path).with_context(|| report::unwritable(path))?;
        }
        if let Some(folder) = &arguments.draw {
            ensure!(!folder.as_os_str().is_empty(), "--draw needs a path");
            std::fs::create_dir_all(folder)
                .with_context(|| format!("--draw: the folder {} cannot be made", folder.display()))?;
        }
        let plan = Self {
            episodes: arguments.episodes.unwrap_or_else(|| source.episodes()),
            source,
            disturbance: arguments.disturbance.disturbance(&task.robot),
            task,
            seed: arguments.seed,
            pace: arguments.pace,
            robot: RobotName::new(&arguments.robot)?,
            ipc: IpcConfig::from_option(arguments.ipc_root.as_deref())?,
            report: arguments.report,
            with_poses: arguments.poses,
            draw: arguments.draw,
            show_map: arguments.view == ViewChoice::Terminal,
            wait: seconds("--wait", arguments.wait)?,
            silence: seconds("--silence", silence)?,
        };
        // A world without a way to the goal is better known now than after the runtime has come.
        plan.source.place(0, plan.seed, &plan.task)?;
        Ok(plan)
    }
}

/// The task that a model was trained for.
fn task_of(folder: &Path) -> Result<Task> {
    let path = folder.join(MANIFEST_FILE);
    let text = std::fs::read_to_string(&path).with_context(|| {
        format!("{} cannot be read: give --model a folder with a manifest", path.display())
    })?;
    let cannot = || format!("{} cannot be used", path.display());
    let said: serde_json::Value = serde_json::from_str(&text)
        .with_context(|| format!("{} is no JSON: export the model again", path.display()))?;
    // Of another format it may have other fields, and that is what to say.
    let format = said.get("format").and_then(serde_json::Value::as_u64);
    if let Some(format) = format.filter(|format| *format != u64::from(MANIFEST_FORMAT)) {
        let by = said.get("trainer_version").and_then(serde_json::Value::as_str).unwrap_or("unknown");
        let format = ManifestError::Format(u32::try_from(format).unwrap_or(u32::MAX));
        return Err(format).with_context(|| format!("{} (by trainer {by})", cannot()));
    }
    let manifest: Manifest = serde_json::from_value(said)
        .with_context(|| format!("{}: export the model again with this version's trainer", cannot()))?;
    manifest.validate().with_context(cannot)?;
    Ok(manifest.task)
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    const MODEL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../models");

    fn check(arguments: &[&str]) -> Result<Task, String> {
        let arguments = Arguments::parse_from([&["simulator"], arguments].concat());
        Plan::check(arguments).map(|plan| plan.task).map_err(|error| format!("{error:#}"))
    }

    #[test]
    fn a_profile_is_the_robot_and_a_model_must_be_for_it() {
        let jackal = RobotProfile::read("jackal").expect("built in").task();
        assert_eq!(check(&["--robot-profile", "jackal"]), Ok(jackal));
        let unknown = check(&["--robot-profile", "jakal"]).expect_err("unknown");
        assert!(unknown.contains("turtlebot4"), "{unknown}");

        let other = check(&["--robot-profile", "jackal", "--model", MODEL]).expect_err("another robot");
        assert!(other.contains("was trained for another robot") && other.contains("of jackal"), "{other}");
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("own.toml");
        let own = "[robot]\nfootprint.circle.radius_m = 0.2\nlinear_max_mps = 1.0\nangular_max_radps = 1.0\n\
                   [lidar]\nbeam_count = 72\nrange_max_m = 5.0\n";
        std::fs::write(&path, own).expect("written");
        let path = path.to_str().expect("a plain path");
        let of_model = check(&["--model", MODEL]);
        assert!(of_model.is_ok(), "{of_model:?}");
        assert_eq!(
            check(&["--robot-profile", path, "--model", MODEL]),
            of_model,
            "what the model says besides"
        );
    }

    #[test]
    fn a_manifest_of_another_version_says_which_and_what_to_do() {
        let folder = tempfile::tempdir().expect("a folder");
        let model = folder.path().to_str().expect("a plain path");
        let refused = |text: &str| {
            std::fs::write(folder.path().join(MANIFEST_FILE), text).expect("written");
            check(&["--model", model]).expect_err("refused")
        };
        let old =
            refused("{\"format\": 1, \"trainer_version\": \"0.0.9\", \"task\": {\"episode_steps\": 500}}");
        for part in ["by trainer 0.0.9", "format 1", "export the run again with this version's trainer"] {
            assert!(old.contains(part), "{part}: {old}");
        }
        let lacks = refused(&format!("{{\"format\": {MANIFEST_FORMAT}}}"));
        assert!(lacks.contains("missing field") && lacks.contains("export the model again"), "{lacks}");
        assert!(refused("{").contains("is no JSON"));
    }
}
