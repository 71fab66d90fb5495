//! A Python environment in `.tools/python/` for tests that ask other people's programs: `onnx.checker`
//! about an export, TensorBoard about event files.

use std::fs;
use std::process::Command;

use anyhow::{Context, Result};

use crate::shell::{remove_folder, run_quiet, say, set_up_lock, tools};
use crate::wheel::pip;

/// What the environment holds; pip picks the newest that this machine's Python can run.
const PACKAGES: [&str; 4] = ["onnx>=1.16,<2", "numpy>=1.26,<3", "tensorboard>=2.16,<3", "iceoryx2==0.10.0"];

/// Sets `.tools/python/bin/python3` up unless it is there.
///
/// # Errors
/// One sentence when python3 or pip is missing or the installation fails.
pub(crate) fn set_up() -> Result<()> {
    let _lock = set_up_lock()?;
    let folder = tools().join("python");
    let mark = folder.join("complete");
    let stamp = PACKAGES.join("\n");
    if fs::read_to_string(&mark).is_ok_and(|found| found == stamp) {
        say("the Python environment for cross-checks is ready in .tools/python/");
        return Ok(());
    }
    say("installing onnx, numpy, tensorboard and iceoryx2 in .tools/python/ for cross-checks");
    remove_folder(&folder)?;
    let pip = pip()?;
    // Debian's python3 makes environments without pip even where python3-venv is missing.
    let mut venv = Command::new("python3");
    run_quiet(
        venv.args(["-m", "venv", "--without-pip"]).arg(&folder),
        "making a Python environment",
        |_| (),
    )?;
    let mut ask = Command::new(folder.join("bin/python3"));
    ask.args(["-c", "import sysconfig; print(sysconfig.get_path('purelib'))"]);
    let packages = run_quiet(&mut ask, "asking where Python packages lie", |_| ())?;
    let mut install = pip;
    // By folder: `--python` would ask for a pip of 2022 or later.
    install
        .args(["install", "--quiet", "--only-binary=:all:", "--no-warn-script-location", "--target"])
        .arg(packages.trim())
        .args(["--progress-bar", "off", "--disable-pip-version-check"])
        .args(PACKAGES);
    run_quiet(&mut install, "installing the Python packages", |since| {
        say(&format!("  {} s", since.as_secs()))
    })?;
    fs::write(mark, stamp).context("could not mark the Python environment complete")?;
    Ok(())
}
