//! The whole chain on a fresh clone: train, export, then simulator and runtime as two processes over
//! shared memory, on worlds that training never saw.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use clap::Args;
use serde_json::Value;

use crate::shell::{remove_folder, root, run_shown, say};
use crate::{libtorch, onnxruntime, programs};

/// What the demo does.
#[derive(Args)]
pub(crate) struct Options {
    /// Drive with this exported model (as `models`) instead of training one
    #[arg(long, value_name = "FOLDER")]
    model: Option<PathBuf>,
    /// Episodes a family
    #[arg(long, default_value_t = 50)]
    episodes: u32,
    /// World families to drive in
    #[arg(long, value_delimiter = ',', default_value = "clutter,u_trap,rooms,crowd")]
    families: Vec<String>,
    /// Seed of the training run
    #[arg(long, default_value_t = 0)]
    seed: u64,
}

/// One row of the table.
struct Row {
    family: String,
    episodes: u64,
    success: f64,
    collision: f64,
    time_s: f64,
}

/// Runs the demo.
///
/// # Errors
/// The first step that fails, named.
pub(crate) fn run(options: &Options) -> Result<()> {
    let started = Instant::now();
    let out = root().join("out/demo");
    let run = root().join("runs/demo");
    let model = match &options.model {
        // Relative to where the user stands.
        Some(folder) => std::path::absolute(folder)?,
        None => out.join("models"),
    };
    if let Some(folder) = &options.model
        && !folder.join("manifest.json").exists()
    {
        bail!(
            "{} holds no manifest.json; --model needs a folder made by `cargo trainer export`",
            folder.display()
        );
    }
    libtorch::set_up(None)?;
    onnxruntime::set_up()?;
    say("1/4 build");
    let programs = programs::build(&["trainer", "runtime", "simulator"])?;
    let program = |name: &str| {
        let mut command = Command::new(programs.join(name));
        command.current_dir(root());
        command
    };
    remove_folder(&out)?;
    fs::create_dir_all(&out).with_context(|| format!("could not create {}", out.display()))?;
    if options.model.is_none() {
        say("2/4 training (profile quick, about six minutes on two cores)");
        remove_folder(&run)?;
        let mut train = program("trainer");
        train.args(["train", "--profile", "quick", "--seed", &options.seed.to_string(), "--out"]).arg(&run);
        run_shown(&mut train, "trainer train")?;
        say("3/4 export");
        let mut export = program("trainer");
        run_shown(export.args(["export", "--run"]).arg(&run).arg("--out").arg(&model), "trainer export")?;
    } else {
        say(&format!("2/4 and 3/4: no training, driving with {}", model.display()));
    }
    say("4/4 simulator and runtime as two processes, held-out worlds");
    let mut rows = Vec::new();
    for family in &options.families {
        let row = drive(&program, family, options.episodes, &model, &out)?;
        say(&format!("  {family}: {} of {} reached the goal", row.success, row.episodes));
        rows.push(row);
    }
    say("the same worlds in-process, with other policies beside");
    let mut evaluate = program("trainer");
    evaluate
        .args(["evaluate", "--policies", "hybrid,td3,astar,reactive", "--families"])
        .arg(options.families.join(","))
        .args(["--episodes", &options.episodes.to_string(), "--model"])
        .arg(&model)
        .arg("--out")
        .arg(out.join("evaluate"));
    run_shown(&mut evaluate, "trainer evaluate")?;
    print_table(&rows);
    say(&format!("pictures and reports: {}", out.display()));
    say(&format!(
        "done in {} min {:02} s",
        started.elapsed().as_secs() / 60,
        started.elapsed().as_secs() % 60
    ));
    Ok(())
}

/// Drives one family through the two processes and reads the simulator's report.
fn drive(
    program: &impl Fn(&str) -> Command,
    family: &str,
    episodes: u32,
    model: &Path,
    out: &Path,
) -> Result<Row> {
    let robot = format!("demo-{}", std::process::id());
    let report = out.join(format!("{family}.json"));
    let log = |name: &str| -> Result<(PathBuf, File)> {
        let path = out.join(format!("{family}-{name}.log"));
        let file = File::create(&path).with_context(|| format!("could not create {}", path.display()))?;
        Ok((path, file))
    };
    let (simulator_log, file) = log("simulator")?;
    let mut simulator = program("simulator");
    simulator
        .args(["--family", family, "--split", "test", "--seed", "0", "--pace", "lockstep"])
        .args(["--episodes", &episodes.to_string(), "--robot", &robot])
        .arg("--report")
        .arg(&report)
        .arg("--draw")
        .arg(out);
    let mut simulator = Running::start(simulator, "simulator", file)?;
    let (runtime_log, file) = log("runtime")?;
    let mut runtime = program("runtime");
    runtime.args(["run", "--pace", "scan", "--robot", &robot, "--model"]).arg(model);
    let mut runtime = Running::start(runtime, "runtime", file)?;
    let started = Instant::now();
    let mut told = started;
    let status = loop {
        if let Some(status) = simulator.0.try_wait()? {
            break status;
        }
        if let Some(status) = runtime.0.try_wait()? {
            // The runtime may leave first when the last episode has ended; the simulator follows.
            thread::sleep(Duration::from_secs(2));
            match simulator.0.try_wait()? {
                Some(status) => break status,
                None => bail!("the runtime stopped ({status}) in {family}; see {}", runtime_log.display()),
            }
        }
        if told.elapsed() > Duration::from_secs(5) {
            told = Instant::now();
            say(&format!("  {family}: {} s", started.elapsed().as_secs()));
        }
        thread::sleep(Duration::from_millis(20));
    };
    runtime.interrupt();
    if !status.success() {
        bail!("the simulator failed ({status}) in {family}; see {}", simulator_log.display());
    }
    read_report(family, &report)
}

/// A process that does not outlive the demo.
struct Running(Child);

impl Running {
    fn start(mut command: Command, what: &str, log: File) -> Result<Self> {
        let errors = log.try_clone()?;
        let child = command.stdin(Stdio::null()).stdout(log).stderr(errors).spawn();
        Ok(Self(child.with_context(|| format!("could not start the {what}"))?))
    }

    /// Asks the process to end as Ctrl-C would, and gives it five seconds.
    fn interrupt(&mut self) {
        let asked = Command::new("kill").args(["-INT", &self.0.id().to_string()]).status();
        if asked.is_ok_and(|status| status.success()) {
            let started = Instant::now();
            while started.elapsed() < Duration::from_secs(5) {
                if !matches!(self.0.try_wait(), Ok(None)) {
                    return;
                }
                thread::sleep(Duration::from_millis(10));
            }
        }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        if matches!(self.0.try_wait(), Ok(None)) {
            self.interrupt();
            // It may have ended meanwhile; then both say so, which is as good.
            let _ = self.0.kill();
            let _ = self.0.wait();
        }
    }
}

fn read_report(family: &str, path: &Path) -> Result<Row> {
    let text =
        fs::read_to_string(path).with_context(|| format!("the simulator left no {}", path.display()))?;
    let report: Value =
        serde_json::from_str(&text).with_context(|| format!("{} is no JSON", path.display()))?;
    let number = |name: &str| {
        report["summary"][name]
            .as_f64()
            .with_context(|| format!("{} has no number summary.{name}", path.display()))
    };
    Ok(Row {
        family: family.to_owned(),
        episodes: report["summary"]["episodes"].as_u64().unwrap_or_default(),
        success: number("success_rate")?,
        collision: number("collision_rate")?,
        time_s: number("mean_time_s")?,
    })
}

fn print_table(rows: &[Row]) {
    println!(
        "\n{:<12} {:>8} {:>10} {:>12} {:>10}",
        "family", "episodes", "success %", "collision %", "time s"
    );
    for row in rows {
        println!(
            "{:<12} {:>8} {:>10.1} {:>12.1} {:>10.1}",
            row.family,
            row.episodes,
            row.success * 100.0,
            row.collision * 100.0,
            row.time_s
        );
    }
    println!();
}
