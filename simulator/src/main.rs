//! A simulated robot behind the robot's own topics: `nav-sim` where a driver would be.

mod cli;
mod import;
mod plan;
mod worlds;

mod episodes;
mod link;
mod driver;
mod signals;

mod view;
mod picture;
mod report;

use clap::Parser;
use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments = cli::Arguments::parse();
    if let Some(cli::Instead::Import(import)) = &arguments.instead {
        return match import.run() {
            Ok(()) => ExitCode::SUCCESS,
            Err(error) => failed(&error),
        };
    }
    match plan::Plan::check(arguments).and_then(|plan| episodes::run(&plan)) {
        Ok(end) => end.exit_code(),
        Err(error) => failed(&error),
    }
}

fn failed(error: &anyhow::Error) -> ExitCode {
    eprintln!("simulator: {error:#}");
    ExitCode::FAILURE
}
