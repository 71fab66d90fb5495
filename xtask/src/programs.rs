//! Building and starting the three programs.
//!
//! `--workspace` while building one program: the features of shared dependencies are then the same
//! for every program, and none is built twice. It does not build the others: without the trainer,
//! nothing needs libtorch.

use std::os::unix::process::CommandExt;
use std::path::PathBuf;
use std::process::Command;

use anyhow::{Context, Result};

use crate::libtorch;
use crate::shell::{cargo, run_shown};

/// Builds programs, progress visible, and returns the folder they are in.
///
/// # Errors
/// When libtorch is missing and the trainer is among them, or the build fails.
pub(crate) fn build(names: &[&str]) -> Result<PathBuf> {
    if names.contains(&"trainer") {
        libtorch::require()?;
    }
    let mut command = cargo();
    command.args(["build", "--release", "--workspace"]);
    for name in names {
        command.args(["--bin", name]);
    }
    run_shown(&mut command, &format!("the build of {}", names.join(", ")))?;
    target_folder()
}

/// Builds a program and becomes it: signals, exit code and terminal are the program's own.
///
/// # Errors
/// When it cannot be built or started.
pub(crate) fn become_program(name: &str, args: &[String]) -> Result<()> {
    let folder = build(&[name])?;
    let mut command = Command::new(folder.join(name));
    command.args(args);
    Err(command.exec()).with_context(|| format!("could not start {}", folder.join(name).display()))
}

/// The folder of release builds, wherever the user keeps it.
pub(crate) fn target_folder() -> Result<PathBuf> {
    let mut metadata = cargo();
    metadata.args(["metadata", "--no-deps", "--format-version", "1", "--offline"]);
    let output = metadata.output().context("could not start cargo metadata")?;
    let metadata: serde_json::Value =
        serde_json::from_slice(&output.stdout).context("cargo metadata printed no JSON")?;
    let folder = metadata["target_directory"].as_str().context("cargo metadata names no target folder")?;
    Ok(PathBuf::from(folder).join("release"))
}
