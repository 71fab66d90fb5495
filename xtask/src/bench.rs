//! Measurements, kept as text in `out/bench/` beside what the terminal shows.

use std::fs::{self, File};
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Command, Stdio};

use anyhow::{Context, Result, bail};

use crate::shell::{cargo, root, say};
use crate::{onnxruntime, programs};

/// Runs the benches of the simulation and of the robot's networks.
///
/// # Errors
/// When a bench cannot be built, or fails.
pub(crate) fn run() -> Result<()> {
    onnxruntime::set_up()?;
    let folder = root().join("out/bench");
    fs::create_dir_all(&folder).with_context(|| format!("could not create {}", folder.display()))?;
    let simulation = folder.join("nav-sim.txt");
    say("environment steps a second (cargo bench of nav-sim)");
    let mut bench = cargo();
    bench.args(["bench", "--workspace", "--bench", "*", "--exclude", "trainer"]);
    keep(&mut bench, "the benches", &simulation)?;
    let networks = folder.join("runtime.txt");
    say("the shipped networks in three engines (runtime bench)");
    let runtime = programs::build(&["runtime"])?.join("runtime");
    let mut bench = Command::new(runtime);
    bench.current_dir(root()).args(["bench", "--model", "models"]);
    keep(&mut bench, "runtime bench", &networks)?;
    say(&format!("results: {} and {}", simulation.display(), networks.display()));
    Ok(())
}

/// Runs a program, showing what it prints and keeping it in `file`.
fn keep(command: &mut Command, what: &str, file: &Path) -> Result<()> {
    let mut copy = File::create(file).with_context(|| format!("could not create {}", file.display()))?;
    let mut child =
        command.stdout(Stdio::piped()).spawn().with_context(|| format!("could not start {what}"))?;
    if let Some(output) = child.stdout.take() {
        for line in BufReader::new(output).lines() {
            let line = line?;
            println!("{line}");
            writeln!(copy, "{line}")?;
        }
    }
    let status = child.wait()?;
    if !status.success() {
        bail!("{what} failed ({status}); its own output above says why");
    }
    Ok(())
}
