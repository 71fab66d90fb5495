//! Simulator and runtime as two processes in lock-step over shared memory, for one family of worlds.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use serde_json::Value;

use crate::process::Process;
use crate::shell::{root, say};

/// What both processes do.
pub(crate) struct Drive<'a> {
    /// Folder of the built programs.
    pub programs: &'a Path,
    /// Folder of the model.
    pub model: &'a Path,
    /// Family of worlds, as the simulator calls it.
    pub family: &'a str,
    /// Worlds, from seed 0 on.
    pub worlds: u32,
    /// How the robot differs from a perfect one, as the simulator calls it.
    pub disturbance: &'a str,
    /// Where report, logs and pictures go.
    pub out: &'a Path,
}

/// How a policy did in a family.
pub(crate) struct Score {
    /// Who drove, and how.
    pub policy: String,
    /// Where.
    pub family: String,
    /// Share of episodes that reached the goal, 0 to 1.
    pub success: f64,
    /// Share of episodes that hit something, 0 to 1.
    pub collision: f64,
}

impl Drive<'_> {
    /// Drives all worlds and reads the simulator's report.
    ///
    /// # Errors
    /// When a program cannot be started or fails; the sentence names its log.
    pub(crate) fn run(&self) -> Result<Score> {
        let robot = format!("demo-{}", std::process::id());
        let report = self.out.join(format!("{}.json", self.family));
        let mut simulator = self.program("simulator");
        simulator
            .args(["--family", self.family, "--split", "test", "--seed", "0", "--pace", "lockstep"])
            .args(["--episodes", &self.worlds.to_string(), "--disturbance", self.disturbance])
            .args(["--robot", &robot, "--model"])
            .arg(self.model)
            .arg("--report")
            .arg(&report)
            .arg("--draw")
            .arg(self.out.join(self.family));
        let mut runtime = self.program("runtime");
        runtime.args(["run", "--pace", "scan", "--robot", &robot, "--model"]).arg(self.model);
        let mut simulator = Process::start(simulator, self.log("simulator"))?;
        let mut runtime = Process::start(runtime, self.log("runtime"))?;
        self.wait_for_both(&mut simulator, &mut runtime)?;
        self.read_report(&report)
    }

    fn program(&self, name: &str) -> Command {
        let mut command = Command::new(self.programs.join(name));
        command.current_dir(root());
        command
    }

    fn log(&self, program: &str) -> PathBuf {
        self.out.join(format!("{}-{program}.log", self.family))
    }

    /// Waits until the last episode has ended; the runtime leaves when the simulator has.
    fn wait_for_both(&self, simulator: &mut Process, runtime: &mut Process) -> Result<()> {
        let started = Instant::now();
        let mut told = started;
        loop {
            if let Some(status) = simulator.ended()? {
                simulator.require_success(status)?;
                let status = runtime.wait_for(Duration::from_secs(10))?;
                return status.map_or(Ok(()), |status| runtime.require_success(status));
            }
            if let Some(status) = runtime.ended()? {
                // It ends first only when something is wrong; the simulator then says what it saw.
                if let Some(status) = simulator.wait_for(Duration::from_secs(5))? {
                    simulator.require_success(status)?;
                }
                return runtime.require_success(status);
            }
            if told.elapsed() > Duration::from_secs(10) {
                told = Instant::now();
                say(&format!("  {}: {} s", self.family, started.elapsed().as_secs()));
            }
            thread::sleep(Duration::from_millis(20));
        }
    }

    fn read_report(&self, path: &Path) -> Result<Score> {
        let text =
            fs::read_to_string(path).with_context(|| format!("the simulator left no {}", path.display()))?;
        let report: Value =
            serde_json::from_str(&text).with_context(|| format!("{} is no JSON", path.display()))?;
        let number = |name: &str| {
            let value = report["summary"][name].as_f64();
            value.with_context(|| format!("{} has no number summary.{name}", path.display()))
        };
        Ok(Score {
            policy: "hybrid".to_owned(),
            family: self.family.to_owned(),
            success: number("success_rate")?,
            collision: number("collision_rate")?,
        })
    }
}
