//! The `trainer` program.

use clap::{CommandFactory, Parser};
use nav_host::exit::Exit;
use trainer::cli::{Cli, Command};
use trainer::commands;

fn main() -> Exit {
    if let Some(exit) = nav_host::manual::printed(Cli::command()) {
        return exit;
    }
    let cli = Cli::parse();
    cli.log.apply();
    let result = match &cli.command {
        Command::Train(args) => commands::train(args),
        Command::Robot(command) => commands::robot::robot(command),
        Command::Gate(args) => commands::gate::gate(args),
        Command::Export(args) => commands::export(args),
        Command::Evaluate(args) => trainer::evaluate::evaluate(args),
    };
    Exit::of("trainer", result)
}
