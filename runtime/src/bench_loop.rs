//! `runtime bench --loop`: how well the loop keeps time between two processes, on a limited number of cores.
//!
//! Isolates: the real loop with the real controller in this process, answering a peer process that publishes
//! scans at a fixed rate, idle and with every core loaded, with ordinary and with real-time priority. Not
//! measured: lidar drivers and motor controllers. Figures belong to the machine that is named beside them.

mod child;
pub mod limit;
pub mod load;
pub mod peer;
mod words;

use crate::latency::Percentiles;
use crate::model::Demands;
use crate::run::drive::drive;
use crate::run::live::Live;
use crate::run::plan::{DriveError, DrivePlan, End, Pace};
use crate::run::ports::Ports;
use crate::run::realtime::RealTime;
use crate::run::report::write_json;
use crate::run::tally::Tally;
use limit::Limit;
use load::Hogs;
use nav_core::controller::ShapeError;
use nav_host::cpu::Cpu;
use nav_host::files::check_writable;
use nav_host::stop::{Second, Signal, Stop};
use nav_host::terminal::say;
use nav_ipc::{IpcConfig, IpcError, RobotName};
use nav_model::model::ModelError;
use peer::Peer;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::time::Duration;
use words::{print_phase, print_ratios};

/// Priority of the loop where it is granted.
const PRIORITY: u8 = 50;
/// The robot's name during the measurement.
pub const ROBOT: &str = "bench-loop";

/// What to measure.
#[derive(Clone, Debug)]
pub struct LoopBenchPlan {
    /// The model's folder.
    pub model: PathBuf,
    /// What the robot's owner demands of it.
    pub demands: Demands,
    /// Length of each of the four phases.
    pub phase: Duration,
    /// Scans a second.
    pub rate_hz: f64,
    /// Cores that loop, peer and load share.
    pub cores: usize,
    /// Where the JSON goes.
    pub out: Option<PathBuf>,
}

/// Why it could not be measured.
#[derive(Debug, thiserror::Error)]
pub enum LoopBenchError {
    /// The model.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// A network of another shape.
    #[error(transparent)]
    Shape(#[from] ShapeError),
    /// The topics.
    #[error(transparent)]
    Ipc(#[from] IpcError),
    /// The loop.
    #[error(transparent)]
    Drive(#[from] DriveError),
    /// Processes, files or limits.
    #[error("{what}")]
    System {
        /// What failed, and what to do.
        what: String,
        /// Why.
        source: std::io::Error,
    },
    /// Asked by a signal.
    #[error("the measurement was interrupted")]
    Stopped(Signal),
    /// The peer's answer.
    #[error("the measuring peer answered nonsense ({0}): run the bench again")]
    Peer(String),
}

/// Attaches what failed to an error of the system.
fn system(what: impl Into<String>) -> impl FnOnce(std::io::Error) -> LoopBenchError {
    let what = what.into();
    |source| LoopBenchError::System { what, source }
}

/// All phases, and where they were measured.
#[derive(Clone, Debug, Serialize)]
pub struct LoopBench {
    /// Processor, cores and kernel.
    pub machine: String,
    /// Load average of the last minute before the measurement: other programs disturb it.
    pub load_average: f64,
    /// How the cores were limited, in words.
    pub limit: String,
    /// Scans a second.
    pub rate_hz: f64,
    /// Length of a phase, s.
    pub phase_s: f64,
    /// The phases.
    pub phases: Vec<Phase>,
}

/// One phase.
#[derive(Clone, Debug, Serialize)]
pub struct Phase {
    /// Whether cores were kept busy.
    pub loaded: bool,
    /// By how many processes.
    pub hogs: usize,
    /// Whether real-time priority was asked for.
    pub realtime: bool,
    /// Whether it was granted.
    pub realtime_granted: bool,
    /// What was granted, in words.
    pub granted: Vec<String>,
    /// Ticks.
    pub ticks: u64,
    /// Ticks that ended after the next deadline.
    pub overruns: u64,
    /// Allocations in the loop.
    pub allocations: u64,
    /// From the scan's stamp to the published command.
    pub scan_to_command: Percentiles,
    /// Scans that another one replaced before the loop read them.
    pub scans_replaced: u64,
    /// From the scan's stamp to the command in the peer's hands, however late.
    pub round_trip: Percentiles,
    /// Scans between the first and the last answer that the peer saw no answer to.
    pub round_trips_missing: u64,
    /// From wake-up to the published command.
    pub tick: Percentiles,
    /// The controller alone.
    pub controller: Percentiles,
    /// How late the loop woke up at a deadline.
    pub wake_late: Percentiles,
    /// Difference between one period and the next.
    pub jitter: Percentiles,
}

/// Measures and prints; writes JSON if asked to.
///
/// # Errors
/// [`LoopBenchError`].
pub fn measure(plan: &LoopBenchPlan) -> Result<LoopBench, LoopBenchError> {
    if let Some(path) = &plan.out {
        // Known now and not after the measurement.
        check_writable(path).map_err(system(format!("--out: {} cannot be written", path.display())))?;
    }
    let load_average = load_average();
    let stop = Stop::listen(Second::IsIgnored).map_err(system("signals cannot be taken over"))?;
    let limit = Limit::enter(plan.cores).map_err(system("the cores cannot be limited"))?;
    say(machine());
    say(format_args!("limit: {}", limit.words()));
    if load_average > 0.3 {
        say(format_args!("load average before: {load_average:.2}; other programs disturb this measurement"));
    }
    say(format_args!("{:.0} scans a second, {:.1} s a phase; us", plan.rate_hz, plan.phase.as_secs_f64()));
    let folder = Scratch::new()?;
    let mut phases = Vec::new();
    for (loaded, realtime) in [(false, false), (true, false), (false, true), (true, true)] {
        let hogs = if loaded {
            Some(Hogs::start(plan.cores, plan.phase).map_err(system("the load cannot start"))?)
        } else {
            None
        };
        let phase = measure_phase(plan, &folder.0, (loaded, realtime), &stop)?;
        drop(hogs);
        print_phase(&phase);
        phases.push(phase);
    }
    print_ratios(&phases);
    let bench = LoopBench {
        machine: machine(),
        load_average,
        limit: limit.words().to_owned(),
        rate_hz: plan.rate_hz,
        phase_s: plan.phase.as_secs_f64(),
        phases,
    };
    if let Some(path) = &plan.out {
        write_json(path, &bench).map_err(system(format!("--out: {} cannot be written", path.display())))?;
    }
    Ok(bench)
}

/// In a thread of its own, which takes its priority with it.
fn measure_phase(
    plan: &LoopBenchPlan,
    folder: &Path,
    kind: (bool, bool),
    stop: &Stop,
) -> Result<Phase, LoopBenchError> {
    let phase = std::thread::scope(|scope| scope.spawn(|| measure_here(plan, folder, kind, stop)).join());
    phase.unwrap_or_else(|panic| std::panic::resume_unwind(panic))
}

/// `kind`: whether cores are kept busy, and whether to ask for real-time priority.
fn measure_here(
    plan: &LoopBenchPlan,
    folder: &Path,
    (loaded, realtime): (bool, bool),
    stop: &Stop,
) -> Result<Phase, LoopBenchError> {
    let mut controller = plan.demands.read(&plan.model)?.into_controller()?;
    let config = IpcConfig::in_folder(folder)?;
    let mut ports = Ports::open(&RobotName::new(ROBOT)?, &config)?;
    let peer = Peer::start(folder, plan, realtime)?;
    let granted = RealTime { priority: realtime.then_some(PRIORITY), core: None }.enter();
    let period_ns = (1e9 / plan.rate_hz) as u64;
    let drive_plan = DrivePlan {
        pace: Pace::Clock,
        duration: Some(plan.phase),
        idle_exit: Some(Duration::from_secs(10)),
        exit_with_peer: false,
        assert_no_alloc: false,
        period_ns: Some(period_ns),
    };
    let mut tally = Tally::new(period_ns);
    let end = drive(&mut controller, &mut ports, &drive_plan, stop, &Live::default(), &mut tally)?;
    if let End::Stopped(signal) | End::StoppedWaiting(signal) = end {
        return Err(LoopBenchError::Stopped(signal));
    }
    // Ctrl-C reaches the peer too.
    let answers = peer.finish().map_err(|error| stop.signal().map_or(error, LoopBenchError::Stopped))?;
    Ok(Phase {
        loaded,
        hogs: if loaded { plan.cores } else { 0 },
        realtime,
        realtime_granted: granted.has_priority,
        granted: [granted.words, granted.refused].concat(),
        ticks: tally.ticks,
        overruns: tally.overruns,
        allocations: tally.heap.allocations,
        scan_to_command: tally.scan_to_command.percentiles(),
        scans_replaced: tally.scans_replaced,
        round_trip: answers.round_trip,
        round_trips_missing: answers.unanswered,
        tick: tally.tick.percentiles(),
        controller: tally.controller.percentiles(),
        wake_late: tally.wake_late.percentiles(),
        jitter: tally.jitter.percentiles(),
    })
}

/// A folder of shared files that goes away.
#[derive(Debug)]
struct Scratch(PathBuf);

impl Scratch {
    fn new() -> Result<Self, LoopBenchError> {
        // Not the user's own temporary folder: sockets need a short path.
        let scratch = Self(PathBuf::from(format!("/tmp/nav-loop-{}", std::process::id())));
        IpcConfig::in_folder(&scratch.0)?;
        Ok(scratch)
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        if let Ok(config) = IpcConfig::in_folder(&self.0) {
            config.remove_all();
        }
    }
}

/// Processor, cores and kernel, for the record.
fn machine() -> String {
    let Cpu { name, cores } = Cpu::of_this_machine();
    let kernel = std::fs::read_to_string("/proc/sys/kernel/osrelease").unwrap_or_default();
    format!("{name}, {cores} cores, Linux {}", kernel.trim())
}

fn load_average() -> f64 {
    std::fs::read_to_string("/proc/loadavg")
        .ok()
        .and_then(|text| text.split(' ').next().and_then(|number| number.parse().ok()))
        .unwrap_or(0.0)
}
