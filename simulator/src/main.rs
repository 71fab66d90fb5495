//! A simulated robot behind the robot's own topics: `nav-sim` where a driver would be.

mod cli;
mod import;
mod plan;
mod worlds;

mod episodes;
mod link;

mod follow;
mod view;
mod picture;
mod report;

use clap::{CommandFactory, Parser};
use nav_host::exit::Exit;

fn main() -> Exit {
    if let Some(exit) = nav_host::manual::printed(cli::Arguments::command()) {
        return exit;
    }
    let arguments = cli::Arguments::parse();
    arguments.log.apply();
    if let Some(cli::Instead::Import(import)) = &arguments.instead {
        return Exit::of("simulator", import.run().map(|()| Exit::Done));
    }
    Exit::of("simulator", plan::Plan::check(arguments).and_then(|plan| episodes::run(&plan)))
}
