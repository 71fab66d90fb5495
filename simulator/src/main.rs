//! A simulated robot behind the robot's own topics: `nav-sim` where a driver would be.

mod cli;
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
    match plan::Plan::check(arguments).and_then(|plan| episodes::run(&plan)) {
        Ok(end) => end.exit_code(),
        Err(error) => {
            eprintln!("simulator: {error:#}");
            ExitCode::FAILURE
        }
    }
}
