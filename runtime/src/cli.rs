//! The command line, as typed, and what it comes to.

mod model;

pub(crate) use model::ModelArguments;

use anyhow::ensure;
use clap::{Args, Parser, Subcommand, ValueEnum};
use nav_core::task::ShieldMode;
use nav_host::terminal::LogArguments;
use nav_ipc::{IpcConfig, RobotName};
use runtime::bench_loop::LoopBenchPlan;
use runtime::run::RunPlan;
use runtime::run::plan::{DrivePlan, Pace};
use runtime::run::realtime::RealTime;
use std::path::PathBuf;
use std::time::Duration;

/// Drives a robot with a trained policy.
///
/// Reads scan, odom and goal and writes cmd_vel over shared memory. Checks the model first; nothing in the loop
/// allocates memory. Without a subcommand it runs.
#[derive(Debug, Parser)]
#[command(
    version,
    args_conflicts_with_subcommands = true,
    after_help = "\
Examples:
  runtime --model models/                          drive at the policy's rate until Ctrl-C
  runtime run --pace scan --model models/          answer each scan of a lock-step simulator
  runtime run --realtime --core 1 --model models/  with real-time priority on a core of its own
  runtime check --model models/                    say everything that is verified
  runtime bench --model models/ --loop             latency and jitter under a two-core limit
Exit status: 0 after --duration or when the simulator left; 1 on an error, which is one sentence; 2 when the command line
makes no sense; 129, 130 or 143 after SIGHUP, Ctrl-C or SIGTERM, once the robot stands."
)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Option<Command>,
    #[command(flatten)]
    pub(crate) run: RunArguments,
    #[command(flatten)]
    pub(crate) log: LogArguments,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Drive (what happens without a subcommand)
    Run(RunArguments),
    /// Verify a model and say everything that was verified
    Check(CheckArguments),
    /// Measure the networks, or the loop between two processes
    Bench(BenchArguments),
    #[command(hide = true, name = runtime::model::SUBCOMMAND)]
    ProbeModel(ModelArguments),
    #[command(hide = true, name = runtime::bench_loop::peer::SUBCOMMAND)]
    LoopPeer(PeerArguments),
    #[command(hide = true, name = runtime::bench_loop::load::SUBCOMMAND)]
    LoopHog {
        /// How long to be busy, s
        seconds: u64,
    },
}

#[derive(Debug, Args)]
pub(crate) struct CheckArguments {
    #[command(flatten)]
    pub(crate) model: ModelArguments,
    /// Say it as JSON, also when the model is refused
    #[arg(long)]
    pub(crate) json: bool,
}

/// When to tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum PaceChoice {
    /// At the policy's fixed rate, in phase with the scans
    Clock,
    /// Once for each scan, at its own time: lock-step with a simulator (not for a robot: without scans it sends
    /// nothing, and only the driver's own guard stops the base)
    Scan,
}

#[derive(Debug, Args)]
pub(crate) struct RunArguments {
    #[command(flatten)]
    pub(crate) model: ModelArguments,
    /// Name of the robot, part of every topic
    #[arg(long, default_value = "robot")]
    robot: String,
    /// When to tick
    #[arg(long, value_enum, default_value_t = PaceChoice::Clock)]
    pace: PaceChoice,
    /// End so many seconds after the first scan
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    duration: Option<Duration>,
    /// End with an error after so many seconds without a scan; 0 waits for ever (not with --pace scan)
    #[arg(long, value_name = "SECONDS", default_value = "30", value_parser = seconds_or_never)]
    idle_exit: Never,
    /// End when whoever publishes the scans leaves (always so with --pace scan)
    #[arg(long)]
    exit_with_peer: bool,
    /// A goal must be repeated: one older than so many seconds stops the robot [default: a goal sent once counts for ever]
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    goal_heartbeat: Option<Duration>,
    /// Ranges of so many metres or more mean that nothing was hit, where a driver writes a number instead of +inf
    #[arg(long, value_name = "METRES", value_parser = range_m)]
    no_return: Option<f32>,
    /// The safety gate between policy and base, on or off [default: as the model's manifest says]
    #[arg(long, value_name = "on|off")]
    shield: Option<ShieldMode>,
    /// Ask for locked memory and real-time priority [default priority: 50]
    #[arg(long, value_name = "PRIORITY", num_args = 0..=1, default_missing_value = "50", value_parser = clap::value_parser!(u8).range(1..=99))]
    realtime: Option<u8>,
    /// Run the loop on this core only
    #[arg(long, value_name = "CORE")]
    core: Option<usize>,
    /// Abort with a backtrace at the first allocation in the loop, instead of counting
    #[arg(long)]
    assert_no_alloc: bool,
    /// Write the final report as JSON
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    /// Do not print a line a second
    #[arg(long)]
    quiet: bool,
    /// Keep the shared files apart under this absolute path (the simulator needs the same)
    #[arg(long, value_name = "DIR")]
    ipc_root: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct BenchArguments {
    #[command(flatten)]
    pub(crate) model: ModelArguments,
    /// Measure the loop: jitter and scan-to-command latency between two processes, idle and loaded
    #[arg(long = "loop")]
    pub(crate) measure_loop: bool,
    /// Seconds for each of the loop's four phases
    #[arg(long, value_name = "SECONDS", default_value = "5", value_parser = seconds, requires = "measure_loop")]
    seconds: Duration,
    /// Scans a second
    #[arg(long, value_name = "HZ", default_value_t = 100.0, value_parser = rate, requires = "measure_loop")]
    rate: f64,
    /// Cores that loop, peer and load share
    #[arg(long, value_name = "COUNT", default_value_t = 2, value_parser = cores, requires = "measure_loop")]
    cpus: usize,
    /// Write the loop's figures as JSON
    #[arg(long, value_name = "FILE", requires = "measure_loop")]
    out: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct PeerArguments {
    #[arg(long)]
    pub(crate) ipc_root: PathBuf,
    #[command(flatten)]
    pub(crate) model: ModelArguments,
    #[arg(long)]
    pub(crate) rate: f64,
    #[arg(long)]
    pub(crate) seconds: f64,
    #[arg(long)]
    pub(crate) realtime: bool,
}

/// A duration, or never.
#[derive(Clone, Copy, Debug)]
struct Never(Option<Duration>);

impl RunArguments {
    /// What will run, checked.
    pub(crate) fn plan(self) -> anyhow::Result<RunPlan> {
        let pace = match self.pace {
            PaceChoice::Clock => Pace::Clock,
            PaceChoice::Scan => Pace::Scan,
        };
        // Without scans this pace commands nothing until it ends: a stop could replace an answer that a slow
        // simulator has yet to read.
        ensure!(
            pace == Pace::Clock || self.idle_exit.0.is_some(),
            "--idle-exit 0 cannot go with --pace scan, which stops the robot only when it ends: give --idle-exit a \
             number of seconds, or drive with --pace clock"
        );
        Ok(RunPlan {
            demands: self.model.demands(),
            model: self.model.folder,
            robot: RobotName::new(&self.robot)?,
            ipc: IpcConfig::from_option(self.ipc_root.as_deref())?,
            drive: DrivePlan {
                pace,
                duration: self.duration,
                idle_exit: self.idle_exit.0,
                exit_with_peer: self.exit_with_peer || pace == Pace::Scan,
                assert_no_alloc: self.assert_no_alloc,
                period_ns: None,
            },
            no_return_m: self.no_return,
            shield: self.shield,
            goal_heartbeat: self.goal_heartbeat,
            realtime: RealTime { priority: self.realtime, core: self.core },
            report: self.report,
            show_live: !self.quiet,
        })
    }
}

impl BenchArguments {
    /// What the loop bench measures.
    pub(crate) fn loop_plan(self) -> LoopBenchPlan {
        LoopBenchPlan {
            demands: self.model.demands(),
            model: self.model.folder,
            phase: self.seconds,
            rate_hz: self.rate,
            cores: self.cpus,
            out: self.out,
        }
    }
}

fn seconds(text: &str) -> Result<Duration, String> {
    let duration = text.parse().ok().and_then(|number| Duration::try_from_secs_f64(number).ok());
    duration
        .filter(|duration| !duration.is_zero())
        .ok_or_else(|| "give a positive number of seconds".to_owned())
}

fn seconds_or_never(text: &str) -> Result<Never, String> {
    if text.parse() == Ok(0.0) {
        Ok(Never(None))
    } else {
        seconds(text).map(|duration| Never(Some(duration)))
    }
}

fn range_m(text: &str) -> Result<f32, String> {
    let range_m = text.parse().ok().filter(|range_m| (0.1..=1e6).contains(range_m));
    range_m.ok_or_else(|| "give a range in metres, from 0.1 on".to_owned())
}

fn rate(text: &str) -> Result<f64, String> {
    let rate_hz = text.parse().ok().filter(|rate_hz| (1.0..=2000.0).contains(rate_hz));
    rate_hz.ok_or_else(|| "give a rate from 1 to 2000 Hz".to_owned())
}

fn cores(text: &str) -> Result<usize, String> {
    let cores = text.parse().ok().filter(|cores| (1..=64).contains(cores));
    cores.ok_or_else(|| "give 1 to 64 cores".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(line: &str) -> Result<Cli, clap::Error> {
        Cli::try_parse_from(line.split(' '))
    }

    #[test]
    fn run_is_what_happens_without_a_subcommand() {
        let cli = parse("runtime --model m --pace scan").expect("a fine line");
        assert!(cli.command.is_none());
        let plan = cli.run.plan().expect("a fine plan");
        assert_eq!((plan.model, plan.drive.pace), (PathBuf::from("m"), Pace::Scan));
        assert!(plan.drive.exit_with_peer);
        let cli = parse("runtime run --realtime --duration 1.5 --idle-exit 0").expect("a fine line");
        let Some(Command::Run(run)) = cli.command else { panic!("run was asked for") };
        let plan = run.plan().expect("a fine plan");
        assert_eq!(plan.realtime.priority, Some(50));
        assert_eq!(plan.drive.duration, Some(Duration::from_millis(1500)));
        assert_eq!(plan.drive.idle_exit, None);
        assert!(!plan.drive.exit_with_peer);
    }

    #[test]
    fn wrong_lines_are_refused() {
        for line in [
            "runtime --pace sometimes",
            "runtime run --duration 0",
            "runtime run --duration x",
            "runtime run --realtime 100",
            "runtime run --goal-heartbeat 0",
            "runtime run --no-return nan",
            "runtime bench --seconds 3",
            "runtime bench --loop --rate 0",
            "runtime fly",
        ] {
            assert!(parse(line).is_err(), "{line}");
        }
        for line in ["runtime run --robot a/b", "runtime run --pace scan --idle-exit 0"] {
            assert!(parse(line).expect("parsed").command.is_some_and(|command| match command {
                Command::Run(run) => run.plan().is_err(),
                _ => false,
            }));
        }
    }

    #[test]
    fn the_command_line_is_consistent() {
        use clap::CommandFactory;
        Cli::command().debug_assert();
    }
}
