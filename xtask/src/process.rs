//! Programs that log into files.

use std::fs::{self, File};
use std::path::PathBuf;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};

/// A process that ends with this one, unless that is killed.
pub(crate) struct Process {
    child: Child,
    log: PathBuf,
}

impl Process {
    /// Starts a program; all that it prints goes into the file `log`.
    ///
    /// # Errors
    /// A log or a process that cannot be made.
    pub(crate) fn start(mut command: Command, log: PathBuf) -> Result<Self> {
        let file = File::create(&log).with_context(|| format!("could not create {}", log.display()))?;
        let errors = file.try_clone()?;
        let program = command.get_program().to_owned();
        let child = command.stdin(Stdio::null()).stdout(file).stderr(errors).spawn();
        let child = child.with_context(|| format!("could not start {}", program.display()))?;
        Ok(Self { child, log })
    }

    /// Its status, if it has ended.
    ///
    /// # Errors
    /// When the system does not say.
    pub(crate) fn ended(&mut self) -> Result<Option<ExitStatus>> {
        self.child.try_wait().context("could not look after a process")
    }

    /// Its status, if it ends within `longest`.
    ///
    /// # Errors
    /// As [`Self::ended`].
    pub(crate) fn wait_for(&mut self, longest: Duration) -> Result<Option<ExitStatus>> {
        let started = Instant::now();
        while started.elapsed() < longest {
            if let Some(status) = self.ended()? {
                return Ok(Some(status));
            }
            thread::sleep(Duration::from_millis(10));
        }
        Ok(None)
    }

    /// Waits for its end.
    ///
    /// # Errors
    /// As [`Self::ended`].
    pub(crate) fn wait(&mut self) -> Result<ExitStatus> {
        self.child.wait().context("could not look after a process")
    }

    /// Makes a failure an error: the last line that it printed, and where the rest is.
    ///
    /// # Errors
    /// A status that is not success.
    pub(crate) fn require_success(&self, status: ExitStatus) -> Result<()> {
        if status.success() {
            return Ok(());
        }
        let text = fs::read_to_string(&self.log).unwrap_or_default();
        let last = text.lines().rev().find(|line| !line.trim().is_empty()).unwrap_or("it printed nothing");
        bail!("{last} ({status}; all it said is in {})", self.log.display());
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // It may have ended already; then there is nothing to kill, which is as good.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
