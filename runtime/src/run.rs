//! Driving: from checked model and open topics to the last zero command.
//!
//! | part | what it does |
//! |---|---|
//! | [`plan`] | the loop's words: pace, ends, errors |
//! | [`ports`] | the runtime's side of the topics |
//! | [`grid`] | absolute deadlines, in phase with the scans |
//! | [`rest`] | from the last command to zero |
//! | [`mod@drive`] | the loop: wait, read, tick, publish; nothing in it allocates |
//! | [`realtime`] | locked memory, real-time priority, a core of its own |
//! | [`rate`] | whether scans come as often as in training |
//! | [`tally`] | what is measured, in memory of fixed size |
//! | [`facts`] | what helps to find a mistake: first messages, decisions |
//! | [`live`] | a line a second, printed by another thread from atomics |
//! | [`report`] | the end, for people and as JSON |

pub mod plan;
pub mod ports;
pub mod grid;
pub mod rest;
pub mod drive;
pub mod realtime;
pub mod rate;
pub mod tally;
pub mod facts;
pub mod live;
pub mod report;

use crate::model::{self, Demands, ReadError};
use drive::drive;
use live::Live;
use nav_core::controller::ShapeError;
use nav_core::task::ShieldMode;
use nav_core::tick::Tick;
use nav_host::files;
use nav_host::stop::{Second, Stop};
use nav_host::terminal::{debug, inform, say, warn};
use nav_ipc::{IpcConfig, IpcError, RobotName};
use plan::{DriveError, DrivePlan, End};
use ports::Ports;
use realtime::RealTime;
use report::Report;
use std::path::PathBuf;
use std::sync::Arc;
use tally::Tally;

/// What will run, checked.
#[derive(Clone, Debug)]
pub struct RunPlan {
    /// The model's folder.
    pub model: PathBuf,
    /// What the robot's owner demands of it.
    pub demands: Demands,
    /// The robot's name.
    pub robot: RobotName,
    /// Where the shared files live.
    pub ipc: IpcConfig,
    /// How the loop behaves.
    pub drive: DrivePlan,
    /// A finite range from which on the lidar's driver means that nothing was hit, m.
    pub no_return_m: Option<f32>,
    /// The safety gate, where it is not to be as the manifest says.
    pub shield: Option<ShieldMode>,
    /// Goals older than this are stale.
    pub goal_heartbeat: Option<std::time::Duration>,
    /// Real-time measures to take, if any.
    pub realtime: RealTime,
    /// Where the JSON report goes.
    pub report: Option<PathBuf>,
    /// Whether to print a line a second.
    pub show_live: bool,
}

/// Why a run failed. Each is one sentence that says what to do.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The model.
    #[error(transparent)]
    Model(#[from] ReadError),
    /// A network of another shape.
    #[error(transparent)]
    Shape(#[from] ShapeError),
    /// The topics.
    #[error(transparent)]
    Ipc(#[from] IpcError),
    /// The loop.
    #[error(transparent)]
    Drive(#[from] DriveError),
    /// Signals cannot be taken over.
    #[error("signals cannot be taken over ({0}): this runtime could not be stopped safely")]
    Signals(std::io::Error),
    /// The report.
    #[error("--report: {} cannot be written", path.display())]
    Report {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
}

/// Loads, opens, drives and reports. Prints what a person at the terminal wants to know.
///
/// # Errors
/// Anything that keeps the robot from being driven. The last command is zero then too, if shared memory still carries it.
pub fn run(plan: &RunPlan) -> Result<End, RunError> {
    let model = model::read(&plan.model, &plan.demands)?;
    if let Some(path) = &plan.report {
        // Known now and not after the drive.
        files::check_writable(path).map_err(|source| RunError::Report { path: path.clone(), source })?;
    }
    inform(nav_model::check::headline(&model));
    let mut controller = model.into_controller()?;
    if let Some(mode) = plan.shield {
        controller.set_shield(mode);
    }
    let shield = controller.task().shield;
    match shield {
        ShieldMode::On => inform("the safety gate (shield) is on"),
        ShieldMode::Off => {
            warn("the safety gate (shield) is OFF: what the policy wishes leaves for the base")
        }
    }
    if let Some(no_return_m) = plan.no_return_m {
        controller.set_no_return_m(no_return_m);
    }
    let limit_ns = plan.goal_heartbeat.map(|limit| u64::try_from(limit.as_nanos()).unwrap_or(u64::MAX));
    controller.set_goal_age_limit_ns(limit_ns);
    let mut ports = Ports::open(&plan.robot, &plan.ipc)?;
    inform(format_args!("topics of robot `{}` are open, waiting for scans", plan.robot));
    let stop = Stop::listen(Second::IsIgnored).map_err(RunError::Signals)?;
    let live = Arc::new(Live::default());
    let printer = live::Printer::start(live.clone(), plan.show_live);
    let granted = plan.realtime.enter();
    granted.words.into_iter().for_each(inform);
    granted.refused.into_iter().for_each(warn);
    debug(realtime::scheduling());
    let mut tally = Tally::new(controller.task().control_period_ns());
    let result = drive(&mut controller, &mut ports, &plan.drive, &stop, &live, &mut tally);
    drop(printer);
    let ended = match &result {
        Ok(end) => end.to_string(),
        Err(error) => error.to_string(),
    };
    let report = Report::new(&tally, &plan.drive, plan.robot.as_str(), shield, ended);
    let written = plan.report.as_ref().map_or(Ok(()), |path| {
        report.write(path).map_err(|source| RunError::Report { path: path.clone(), source })
    });
    say(&report);
    // Why the drive ended matters more than a report that could not be written.
    let end = result?;
    written?;
    Ok(end)
}
