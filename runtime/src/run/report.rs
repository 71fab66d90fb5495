//! The end of a run, for people and as JSON.

use super::plan::{DrivePlan, Pace};
use super::tally::Tally;
use crate::latency::Percentiles;
use nav_core::messages::{RunState, fault};
use nav_core::task::ShieldMode;
use serde::Serialize;
use std::path::Path;

/// What a run came to.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Version of this program.
    pub runtime_version: &'static str,
    /// Name of the robot.
    pub robot: String,
    /// How time passed.
    pub pace: Pace,
    /// Why the run ended, as a sentence.
    pub ended: String,
    /// From arming to the end, s.
    pub duration_s: f64,
    /// Control period, s.
    pub period_s: f64,
    /// Ticks done.
    pub ticks: u64,
    /// Ticks that ended after the next deadline.
    pub overruns: u64,
    /// Whole periods skipped because of them.
    pub skipped_periods: u64,
    /// Ticks that decided on a subgoal.
    pub decisions: u64,
    /// Goals received.
    pub goals: u64,
    /// Goals reached, or less than a step away when the next one came or the scans ended.
    pub goals_reached: u64,
    /// Driven as the odometry saw it, m.
    pub distance_m: f64,
    /// Allocations and releases in the loop after arming; peers that joined or left not counted.
    pub allocations: u64,
    /// See `allocations`.
    pub frees: u64,
    /// Whether this program counts them at all.
    pub allocations_counted: bool,
    /// Times that a peer joined or left after arming.
    pub reconnects: u64,
    /// Allocations that these took.
    pub reconnect_allocations: u64,
    /// From wake-up to the published command.
    pub tick: Percentiles,
    /// The controller alone.
    pub controller: Percentiles,
    /// From the scan's stamp to the published command.
    pub scan_to_command: Percentiles,
    /// Scans that another one replaced before they were read; clock pace only, as is `scan_to_command`.
    pub scans_replaced: u64,
    /// How late the loop woke up when no scan started the tick.
    pub wake_late: Percentiles,
    /// Difference between one period and the next.
    pub jitter: Percentiles,
    /// The safety gate, and what it did.
    pub shield: ShieldReport,
    /// Ticks in each state.
    pub states: States,
    /// Ticks with each fault that occurred.
    pub faults: Vec<FaultCount>,
    /// What exactly was wrong, once for each kind, with the value that was expected and the one that came.
    pub causes: Vec<String>,
}

/// What the safety gate did.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ShieldReport {
    /// Whether it was on.
    pub mode: ShieldMode,
    /// Ticks in which what was wished is not safe because of somebody who moves.
    pub person_ticks: u64,
    /// Ticks in which what was wished is not safe because of something that is too near to stop.
    pub obstacle_ticks: u64,
    /// Ticks in which none of the commands that were tried was safe; they count above, too.
    pub forced_ticks: u64,
}

/// Ticks in each state.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct States {
    /// Commanding zero: no goal, or input missing.
    pub ready: u64,
    /// Driving.
    pub driving: u64,
    /// At the goal.
    pub reached: u64,
    /// Held by a fault.
    pub stopped: u64,
}

/// Ticks with a fault.
#[derive(Clone, Debug, Serialize)]
pub struct FaultCount {
    /// Its name.
    pub fault: String,
    /// How many ticks.
    pub ticks: u64,
}

impl Report {
    /// Of a run that ended.
    pub fn new(tally: &Tally, plan: &DrivePlan, robot: &str, shield: ShieldMode, ended: String) -> Self {
        let state = |state: RunState| tally.states[state as usize];
        let armed_ns = if tally.armed_ns == 0 { tally.ended_ns } else { tally.armed_ns };
        let faults = tally.faults.iter().enumerate().filter(|(_, ticks)| **ticks > 0);
        Self {
            runtime_version: env!("CARGO_PKG_VERSION"),
            robot: robot.to_owned(),
            pace: plan.pace,
            ended,
            duration_s: tally.ended_ns.saturating_sub(armed_ns) as f64 / 1e9,
            period_s: plan.period_ns.unwrap_or(tally.period_ns) as f64 / 1e9,
            ticks: tally.ticks,
            overruns: tally.overruns,
            skipped_periods: tally.skipped_periods,
            decisions: tally.decisions,
            goals: tally.goals,
            goals_reached: tally.goals_reached,
            distance_m: tally.distance_m,
            allocations: tally.heap.allocations,
            frees: tally.heap.frees,
            allocations_counted: nav_model::alloc::is_installed(),
            reconnects: tally.reconnects,
            reconnect_allocations: tally.reconnect_heap.allocations,
            tick: tally.tick.percentiles(),
            controller: tally.controller.percentiles(),
            scan_to_command: tally.scan_to_command.percentiles(),
            scans_replaced: tally.scans_replaced,
            wake_late: tally.wake_late.percentiles(),
            jitter: tally.jitter.percentiles(),
            shield: ShieldReport {
                mode: shield,
                person_ticks: tally.shield.persons,
                obstacle_ticks: tally.shield.obstacles,
                forced_ticks: tally.shield.forced,
            },
            states: States {
                ready: state(RunState::Ready),
                driving: state(RunState::Driving),
                reached: state(RunState::Reached),
                stopped: state(RunState::Stopped),
            },
            faults: faults
                .map(|(bit, ticks)| FaultCount { fault: fault::NAMES[bit].to_owned(), ticks: *ticks })
                .collect(),
            causes: tally.causes.iter().map(ToString::to_string).collect(),
        }
    }

    /// Writes the file whole or not at all.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(&self, path: &Path) -> std::io::Result<()> {
        write_json(path, self)
    }
}

/// Writes a JSON file whole or not at all.
///
/// # Errors
/// The file cannot be written.
pub fn write_json(path: &Path, content: &impl Serialize) -> std::io::Result<()> {
    if let Some(folder) = path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
        std::fs::create_dir_all(folder)?;
    }
    nav_host::files::replace(path, serde_json::to_string_pretty(content)? + "\n")
}

impl std::fmt::Display for Report {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        writeln!(f, "ended: {}", self.ended)?;
        writeln!(
            f,
            "{} ticks in {:.1} s, {} overruns ({} periods skipped), {} scans replaced by newer ones, {} decisions",
            self.ticks,
            self.duration_s,
            self.overruns,
            self.skipped_periods,
            self.scans_replaced,
            self.decisions
        )?;
        writeln!(f, "{} goals, {} reached, {:.1} m driven", self.goals, self.goals_reached, self.distance_m)?;
        let heap = if self.allocations_counted { "" } else { " (not counted: no counting allocator)" };
        writeln!(
            f,
            "{} allocations in the loop{heap}; {} peers joined or left",
            self.allocations, self.reconnects
        )?;
        let ShieldReport { mode, person_ticks, obstacle_ticks, forced_ticks } = self.shield;
        match mode {
            ShieldMode::On => writeln!(
                f,
                "shield on: wish not safe in {person_ticks} ticks for people, {obstacle_ticks} for obstacles; no safe way in {forced_ticks}"
            )?,
            ShieldMode::Off => writeln!(f, "shield off")?,
        }
        for fault in &self.faults {
            writeln!(f, "{} ticks with {}", fault.ticks, fault.fault)?;
        }
        for cause in &self.causes {
            writeln!(f, "  {cause}")?;
        }
        writeln!(f, "{:<34} {:>9} {:>9} {:>9} {:>9}", "us", "p50", "p99", "p99.9", "max")?;
        let rows = [
            ("wake-up to command", &self.tick),
            ("of that, controller and networks", &self.controller),
            ("scan to command", &self.scan_to_command),
            ("wake-up late", &self.wake_late),
            ("period to period", &self.jitter),
        ];
        let filled: Vec<String> =
            rows.iter().filter(|(_, p)| p.count > 0).map(|(name, p)| row(name, p)).collect();
        f.write_str(&filled.join("\n"))
    }
}

/// A line of a table of percentiles, us.
pub fn row(name: &str, percentiles: &Percentiles) -> String {
    let us = |ns: u64| ns as f64 / 1e3;
    let Percentiles { p50_ns, p99_ns, p999_ns, max_ns, .. } = *percentiles;
    format!("{name:<34} {:>9.1} {:>9.1} {:>9.1} {:>9.1}", us(p50_ns), us(p99_ns), us(p999_ns), us(max_ns))
}
