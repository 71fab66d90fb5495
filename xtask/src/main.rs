//! Project automation, started as `cargo xtask <task>`; needs only cargo, gcc and python3 with pip.

mod libtorch;
mod shell;
mod wheel;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Parser, Subcommand};

/// Sets up, tests, shows and measures hybridnav.
#[derive(Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask", arg_required_else_help = true)]
struct Cli {
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand)]
enum Task {
    /// Set up libtorch (CPU only) in `.libtorch/` for the trainer; a second run does nothing
    Libtorch {
        /// Take the pinned torch wheel from this file instead of downloading it
        #[arg(long, value_name = "FILE")]
        wheel: Option<PathBuf>,
    },
    /// Check that libtorch is there, then run the trainer (what `cargo trainer` does)
    #[command(disable_help_flag = true)]
    Trainer {
        /// Arguments of the trainer, as in `train --profile quick`
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        args: Vec<String>,
    },
}

fn main() -> ExitCode {
    let outcome = match Cli::parse().task {
        Task::Libtorch { wheel } => libtorch::set_up(wheel.as_deref()),
        Task::Trainer { args } => libtorch::run_trainer(&args),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}
