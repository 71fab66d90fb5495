//! Which commit a run was made with.

use std::process::Command;

/// The commit that the checkout which this program was built in is at now, `-dirty` when sources have changed
/// since; `unknown` where the checkout or git is gone. Build before a run, so that it is the run's own.
pub fn commit() -> String {
    let git = |arguments: &[&str]| {
        // Only asks: where git cannot write its index (a full disk, say), the answer is the same.
        let ask = ["--no-optional-locks", "-C", env!("CARGO_MANIFEST_DIR")];
        let output = Command::new("git").args(ask).args(arguments).output().ok()?;
        output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
    };
    let Some(commit) = git(&["rev-parse", "--short=12", "HEAD"]) else { return "unknown".to_owned() };
    let sources = ["status", "--porcelain", "--untracked-files=no", "--", "*.rs", "*.toml"];
    let is_clean = git(&sources).is_some_and(|changes| changes.is_empty());
    if is_clean { commit } else { format!("{commit}-dirty") }
}
