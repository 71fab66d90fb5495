//! Measurements, kept as text in `out/bench/` beside what the terminal shows.

use std::fs::{self, File};
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Command, Stdio};

use anyhow::{Context, Result, bail};

use crate::shell::{cargo, print_line, root, run_shown, say};
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
    say("environment steps and worlds a second (cargo bench of nav-sim)");
    let mut bench = cargo();
    bench.args(["bench", "--workspace", "--bench", "env", "--bench", "worlds"]);
    keep(&mut bench, "the benches of nav-sim", &simulation)?;
    let networks = folder.join("networks.txt");
    say("the shipped networks in three engines (runtime bench)");
    let mut bench = cargo();
    // Only this measurement has ONNX Runtime in the runtime; the robot's binary is built again below.
    bench.args([
        "build",
        "--release",
        "--workspace",
        "--bin",
        "runtime",
        "--features",
        "runtime/onnxruntime",
    ]);
    run_shown(&mut bench, "the build of runtime with ONNX Runtime")?;
    let measured = run_runtime(&["bench", "--model", "models"], &networks);
    programs::build(&["runtime"])?;
    measured?;
    let control_loop = folder.join("loop.txt");
    say("the loop between two processes on two cores (runtime bench --loop)");
    run_runtime(&["bench", "--model", "models", "--loop"], &control_loop)?;
    say(&format!("results are in {}", folder.display()));
    Ok(())
}

fn run_runtime(args: &[&str], file: &Path) -> Result<()> {
    let mut runtime = Command::new(programs::target_folder()?.join("runtime"));
    runtime.current_dir(root()).args(args);
    keep(&mut runtime, "runtime bench", file)
}

/// Runs a program, showing what it prints and keeping it in `file`.
fn keep(command: &mut Command, what: &str, file: &Path) -> Result<()> {
    let mut copy = File::create(file).with_context(|| format!("could not create {}", file.display()))?;
    let mut child =
        command.stdout(Stdio::piped()).spawn().with_context(|| format!("could not start {what}"))?;
    if let Some(output) = child.stdout.take() {
        for line in BufReader::new(output).lines() {
            let line = line?;
            print_line(&line);
            writeln!(copy, "{line}")?;
        }
    }
    let status = child.wait()?;
    if !status.success() {
        bail!("{what} failed ({status}); its own output above says why");
    }
    Ok(())
}
