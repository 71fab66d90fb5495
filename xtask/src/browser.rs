//! Chromium, for the test that looks at a study's report in a real browser.

use std::process::Command;

use anyhow::{Context, Result};

use crate::shell::{have, run_quiet, say, set_up_lock};

/// Names it goes by, as study/tests/browser.rs looks for them.
const NAMES: [&str; 4] = ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable"];

/// Installs it where that can be done unasked: as root on Debian. Elsewhere it says what is not looked at.
///
/// # Errors
/// An installation that fails.
pub(crate) fn set_up() -> Result<()> {
    if NAMES.iter().any(|name| have(name, &["--version"])) {
        say("Chromium for the look at reports is installed");
        return Ok(());
    }
    if !is_root() || !have("apt-get", &["--version"]) {
        say(
            "reports: not looked at in a browser, Chromium is not installed (on Debian: apt-get install chromium)",
        );
        return Ok(());
    }
    let _lock = set_up_lock()?;
    say("installing Chromium for the look at reports");
    let apt = |arguments: &[&str]| {
        let mut apt = Command::new("apt-get");
        apt.args(["-qq", "-o", "DPkg::Lock::Timeout=300"])
            .args(arguments)
            .env("DEBIAN_FRONTEND", "noninteractive");
        run_quiet(&mut apt, "apt-get", |since| say(&format!("  {} s", since.as_secs())))
    };
    apt(&["update"])
        .and_then(|_| apt(&["install", "--yes", "--no-install-recommends", "chromium"]))
        .context("Chromium was not installed")?;
    Ok(())
}

fn is_root() -> bool {
    Command::new("id").arg("-u").output().is_ok_and(|output| output.stdout.trim_ascii() == b"0")
}
