//! What will run, checked: paths read, names and numbers valid.

use anyhow::{Context, Result, ensure};
use nav_core::manifest::{MANIFEST_FILE, Manifest};
use nav_core::task::Task;
use nav_env::limits::Limits;
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
        let task = match &arguments.model {
            Some(folder) => task_of(folder)?,
            None => Task::default(),
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
    let manifest: Manifest = serde_json::from_str(&text).with_context(|| {
        format!("{} is no manifest of this version: export the model again", path.display())
    })?;
    manifest.validate().with_context(|| format!("{} cannot be used", path.display()))?;
    Ok(manifest.task)
}
