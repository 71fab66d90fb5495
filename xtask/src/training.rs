//! The demo's training: the hybrid, and beside it on the other core a flat TD3 to compare with.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::Result;

use crate::process::Process;
use crate::shell::{remove_folder, root, run_shown, say};

/// What to train, and where it goes.
pub(crate) struct Training<'a> {
    /// Folder of the built programs.
    pub programs: &'a Path,
    /// Seed of both runs; none for the trainer's own.
    pub seed: Option<u64>,
    /// Where the hybrid is exported to.
    pub model: &'a Path,
    /// Where the flat run's log goes.
    pub out: &'a Path,
}

impl Training<'_> {
    /// Trains both and exports the hybrid; the folder of the flat run.
    ///
    /// # Errors
    /// A run that fails, or a hybrid that missed its gate.
    pub(crate) fn run(&self) -> Result<PathBuf> {
        let (hybrid, flat) = (root().join("runs/demo"), root().join("runs/demo-flat"));
        remove_folder(&hybrid)?;
        remove_folder(&flat)?;
        let log = self.out.join("flat-train.log");
        say(&format!("  a flat TD3 is trained beside it; its progress is in {}", short(&log)));
        let mut beside = Process::start(self.train("td3", &flat), log)?;
        run_shown(&mut self.train("hybrid", &hybrid), "trainer train")?;
        let mut export = trainer(self.programs);
        export.arg("export").arg("--run").arg(hybrid).arg("--out").arg(self.model);
        run_shown(&mut export, "trainer export")?;
        if beside.ended()?.is_none() {
            say("  waiting for the flat TD3");
        }
        let status = beside.wait()?;
        // A rival that trained to its end need not be good enough to be exported: then the trainer ends with status 1.
        if !flat.join("policy.bin").is_file() {
            beside.require_success(status)?;
        }
        Ok(flat)
    }

    fn train(&self, algorithm: &str, run: &Path) -> Command {
        let mut train = trainer(self.programs);
        // The folder that was named is the one that is used.
        train
            .args(["train", "--profile", "quick", "--attempts", "1", "--algorithm", algorithm, "--out"])
            .arg(run);
        if let Some(seed) = self.seed {
            train.args(["--seed", &seed.to_string()]);
        }
        train
    }
}

/// The trainer, ready for its arguments.
pub(crate) fn trainer(programs: &Path) -> Command {
    let mut command = Command::new(programs.join("trainer"));
    command.current_dir(root());
    command
}

/// A path as the user types it at the workspace's root.
pub(crate) fn short(path: &Path) -> String {
    path.strip_prefix(root()).unwrap_or(path).display().to_string()
}
