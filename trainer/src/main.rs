//! The `trainer` program.

use clap::Parser;
use std::process::ExitCode;
use trainer::cli::{Cli, Command};
use trainer::commands;

fn main() -> ExitCode {
    let cli = Cli::parse();
    let result = match &cli.command {
        Command::Train(args) => commands::train(args),
        Command::Export(args) => commands::export(args),
        Command::Evaluate(args) => trainer::evaluate::evaluate(args).map(|()| ExitCode::SUCCESS),
    };
    result.unwrap_or_else(|error| {
        eprintln!("error: {error:#}");
        ExitCode::FAILURE
    })
}
