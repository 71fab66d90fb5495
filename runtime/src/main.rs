//! The robot's program: see `runtime --help`.

mod cli;

use anyhow::Result;
use clap::{CommandFactory, Parser};
use cli::{BenchArguments, CheckArguments, Cli, Command, ModelArguments, PeerArguments, RunArguments};
use nav_host::exit::Exit;
use nav_host::terminal::{say, tell};
use nav_model::alloc::CheckedAllocator;
use nav_model::model::Model;
use runtime::bench::{self, BenchOptions, NamedNetwork};
use runtime::bench_loop::{self, LoopBenchError, load, peer};
use runtime::model::ReadError;
use runtime::run::plan::End;

#[global_allocator]
static ALLOCATOR: CheckedAllocator = CheckedAllocator;

fn main() -> Exit {
    if let Some(exit) = nav_host::manual::printed(Cli::command()) {
        return exit;
    }
    let cli = Cli::parse();
    cli.log.apply();
    let result = match cli.command {
        None => run(cli.run),
        Some(Command::Run(arguments)) => run(arguments),
        Some(Command::Check(arguments)) => check(&arguments),
        Some(Command::Bench(arguments)) => measure(arguments),
        Some(Command::ProbeModel(arguments)) => {
            runtime::model::read_within_limits(&arguments.folder, &arguments.demands()).map(|()| Exit::Done)
        }
        Some(Command::LoopPeer(arguments)) => loop_peer(arguments),
        Some(Command::LoopHog { seconds }) => {
            load::hog(seconds);
            Ok(Exit::Done)
        }
    };
    Exit::of("runtime", result)
}

fn run(arguments: RunArguments) -> Result<Exit> {
    Ok(match runtime::run::run(&arguments.plan()?)? {
        End::Stopped(signal) | End::StoppedWaiting(signal) => Exit::Stopped(signal),
        End::Duration | End::PeerLeft => Exit::Done,
    })
}

fn check(arguments: &CheckArguments) -> Result<Exit> {
    let read = read_model(&arguments.model);
    if arguments.json {
        let report = nav_model::check::json(read.as_ref());
        say(serde_json::to_string_pretty(&report)?);
    } else if let Ok(model) = &read {
        nav_model::check::lines(model).into_iter().for_each(say);
    }
    read?;
    Ok(Exit::Done)
}

fn read_model(arguments: &ModelArguments) -> Result<Model, ReadError> {
    runtime::model::read(&arguments.folder, &arguments.demands())
}

fn measure(arguments: BenchArguments) -> Result<Exit> {
    let model = read_model(&arguments.model)?;
    if arguments.measure_loop {
        return match bench_loop::measure(&arguments.loop_plan()) {
            Err(error @ LoopBenchError::Stopped(signal)) => {
                tell(format_args!("runtime: {error}"));
                Ok(Exit::Stopped(signal))
            }
            measured => Ok(measured.map(|_| Exit::Done)?),
        };
    }
    let (td3, dqn) = model.into_networks();
    let mut networks = vec![NamedNetwork::new("td3", td3)];
    networks.extend(dqn.map(|dqn| NamedNetwork::new("dqn", dqn)));
    say(bench::networks(&mut networks, &BenchOptions::default())?);
    Ok(Exit::Done)
}

fn loop_peer(arguments: PeerArguments) -> Result<Exit> {
    let lidar = arguments.model.demands().read(&arguments.model.folder)?.manifest().task.lidar;
    let plan = peer::PeerPlan {
        ipc_root: arguments.ipc_root,
        rate_hz: arguments.rate,
        seconds: arguments.seconds,
        realtime: arguments.realtime,
    };
    say(serde_json::to_string(&peer::publish(&plan, &lidar)?)?);
    Ok(Exit::Done)
}
