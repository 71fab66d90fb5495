//! Training runs and evaluations as steps that go on where they were, whatever ended them: a kill, a power cut, a full disk.
//!
//! A program outlives a killed xtask and may still be at work when that is started again; then it is waited for.

use std::fs::{self, File, TryLockError};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus};
use std::thread;
use std::time::Duration;

use anyhow::{Context, Result, bail};

use crate::process::Process;
use crate::shell::root;

/// Time between two calls of `alive`.
const LOOK_PERIOD: Duration = Duration::from_secs(1);

/// Where the programs are, and where what they print goes.
pub(crate) struct Programs<'a> {
    /// Folder of the built programs.
    pub folder: &'a Path,
    /// Folder of logs.
    pub logs: &'a Path,
}

impl Programs<'_> {
    /// A program, ready for its arguments, one a core.
    pub(crate) fn program(&self, name: &str) -> Command {
        let mut command = Command::new(self.folder.join(name));
        command.current_dir(root()).env("OMP_NUM_THREADS", "1");
        command
    }

    /// The log of a step.
    pub(crate) fn log(&self, step: &str) -> PathBuf {
        self.logs.join(format!("{step}.log"))
    }

    /// Runs a program to its end and says how it ended; `alive` is called each second.
    ///
    /// # Errors
    /// A program that cannot be started.
    pub(crate) fn end_of(
        &self,
        command: Command,
        step: &str,
        mut alive: impl FnMut(),
    ) -> Result<(Process, ExitStatus)> {
        let mut process = Process::start(command, self.log(step))?;
        loop {
            if let Some(status) = process.wait_for(LOOK_PERIOD)? {
                return Ok((process, status));
            }
            alive();
        }
    }

    /// Runs a program that must end well.
    ///
    /// # Errors
    /// One that does not.
    pub(crate) fn must(&self, command: Command, step: &str, alive: impl FnMut()) -> Result<()> {
        let (process, status) = self.end_of(command, step, alive)?;
        process.require_success(status)
    }

    /// Trains in the folder `run`, or goes on there, until the run has ended, well or not; `begin` adds what the trainer is
    /// told of a new run.
    ///
    /// # Errors
    /// A trainer that ends otherwise.
    pub(crate) fn train(
        &self,
        run: &Path,
        begin: impl FnOnce(&mut Command),
        mut alive: impl FnMut(),
    ) -> Result<()> {
        wait_for_owner(&run.join("lock"), &mut alive)?;
        if has_ended(run) {
            return Ok(());
        }
        let mut train = self.program("trainer");
        train.arg("train");
        if run.join("config.toml").is_file() {
            train.arg("--resume").arg(run);
        } else {
            begin(&mut train);
            train.arg("--out").arg(run);
        }
        let (process, status) = self.end_of(train, "train", alive)?;
        // A run that ended without passing is a result, too; the trainer then ends with status 1.
        if has_ended(run) {
            return Ok(());
        }
        process.require_success(status)?;
        bail!("the trainer ended well but left no policy in {}", run.display());
    }

    /// Evaluates into the folder `out`, or goes on there; `arguments` adds what the trainer is told of policies and worlds.
    ///
    /// # Errors
    /// An evaluation that does not end well.
    pub(crate) fn evaluate(
        &self,
        out: &Path,
        arguments: impl FnOnce(&mut Command),
        step: &str,
        mut alive: impl FnMut(),
    ) -> Result<()> {
        wait_for_owner(&out.join("episodes.csv"), &mut alive)?;
        if out.join("summary.json").is_file() {
            return Ok(());
        }
        let mut evaluate = self.program("trainer");
        arguments(&mut evaluate);
        evaluate.arg("--out").arg(out);
        // Killed before its first row it holds nothing to go on with.
        if out.join("plan.json").is_file() && out.join("episodes.csv").is_file() {
            evaluate.arg("--resume");
        }
        self.must(evaluate, step, alive)
    }
}

/// Whether a run has come to its end: with a policy, or stopped for good.
fn has_ended(run: &Path) -> bool {
    run.join("policy.bin").is_file() || run.join("failed.txt").is_file()
}

/// Waits until nobody holds the lock on a file, if there is one.
fn wait_for_owner(path: &Path, alive: &mut dyn FnMut()) -> Result<()> {
    let Ok(file) = File::open(path) else { return Ok(()) };
    loop {
        match file.try_lock() {
            Ok(()) => return Ok(()),
            Err(TryLockError::WouldBlock) => {
                thread::sleep(LOOK_PERIOD);
                alive();
            }
            Err(TryLockError::Error(error)) => {
                return Err(error).with_context(|| format!("could not lock {}", path.display()));
            }
        }
    }
}

/// What stands between two parts of a text, the first time that it does.
pub(crate) fn said<'a>(text: &'a str, before: &str, after: &str) -> Option<&'a str> {
    let (_, rest) = text.split_once(before)?;
    rest.split_once(after).map(|(said, _)| said)
}

/// Writes a file whole, or not at all.
///
/// # Errors
/// A file that cannot be written.
pub(crate) fn write_whole(path: &Path, text: &str) -> Result<()> {
    let partial = path.with_extension("partial");
    let write = || fs::write(&partial, text).and_then(|()| fs::rename(&partial, path));
    write().with_context(|| format!("could not write {}", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_trainers_words_are_found() {
        // As `trainer train` and `trainer export` print them; their own tests hold them to it.
        let log = "[low level] ...\n\ntrained in 312 s: 409000 steps, 90000 updates\nfamily";
        assert_eq!(said(log, "trained in ", " s"), Some("312"));
        assert_eq!(said(log, "missed ", ";"), None);
    }
}
