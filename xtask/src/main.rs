//! Project automation, started as `cargo xtask <task>`; needs only cargo, gcc and python3 with pip.

mod demo;
mod robots;
mod study;
mod training;
mod two_processes;
mod process;
mod lanes;
mod runs;

mod test;
mod bench;
mod soak;

mod libtorch;
mod wheel;
mod onnxruntime;
mod python;
mod browser;

mod manual;
mod programs;
mod shell;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, Parser, Subcommand};

/// Sets up, shows, tests and measures hybridnav.
#[derive(Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask", arg_required_else_help = true)]
struct Cli {
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand)]
enum Task {
    /// Train, export and drive on worlds never trained on, then print a table (about twenty minutes the first time)
    Demo(demo::Options),
    /// Train, judge, export and drive every robot that has a profile, and write tables, cards and pictures (hours; started
    /// again, it goes on)
    Robots(robots::Options),
    /// Train, drive and judge the methods of a study, and write its report (--quick: a quarter of an hour; else days; started
    /// again, it goes on)
    Study(study::Options),
    /// Check everything: format, lints, doc tests, tests; installs what that needs
    Test,
    /// Measure the simulation and the robot's networks
    Bench,
    /// Build, repeat the attacks that take long (kills, rogue writers, mutated models, floods, full memory) with another seed
    /// each time, then print a table; needs cargo-nextest and a machine on which `cargo xtask test` ran
    Soak {
        /// Go on for so long after the build; every attack comes once at least
        #[arg(long, default_value_t = 10)]
        minutes: u32,
    },
    /// Set up libtorch (CPU only) in .libtorch/ for the trainer; a second run does nothing
    Libtorch {
        /// Take the pinned torch wheel from this file instead of downloading it
        #[arg(long, value_name = "FILE")]
        wheel: Option<PathBuf>,
    },
    /// Set up ONNX Runtime in .tools/onnxruntime/ for the check of an export
    Onnxruntime,
    /// Set up a Python environment in .tools/python/ for tests that ask onnx and TensorBoard
    Python,
    /// Write manual pages and shell completions of the programs into a folder
    Man {
        /// The folder: man pages go to man1/ in it, completions to bash/, zsh/ and fish/
        #[arg(long, value_name = "DIR", default_value = "out/manual")]
        out: PathBuf,
    },
    /// Build and run the trainer (what `cargo trainer` does)
    #[command(disable_help_flag = true)]
    Trainer(Passed),
    /// Build and run the runtime (what `cargo runtime` does)
    #[command(disable_help_flag = true)]
    Runtime(Passed),
    /// Build and run the simulator (what `cargo simulator` does)
    #[command(disable_help_flag = true)]
    Simulator(Passed),
}

/// Arguments handed on as they are.
#[derive(Args)]
struct Passed {
    /// Arguments of the program, as in `train --profile quick`
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    args: Vec<String>,
}

fn main() -> ExitCode {
    let outcome = match Cli::parse().task {
        Task::Demo(options) => demo::run(&options),
        Task::Robots(options) => robots::run(&options),
        Task::Study(options) => study::run(&options),
        Task::Test => test::run(),
        Task::Bench => bench::run(),
        Task::Soak { minutes } => soak::run(minutes),
        Task::Libtorch { wheel } => libtorch::set_up(wheel.as_deref()),
        Task::Onnxruntime => onnxruntime::set_up(),
        Task::Python => python::set_up(),
        Task::Man { out } => manual::write(&out),
        Task::Trainer(passed) => programs::become_program("trainer", &passed.args),
        Task::Runtime(passed) => programs::become_program("runtime", &passed.args),
        Task::Simulator(passed) => programs::become_program("simulator", &passed.args),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}
