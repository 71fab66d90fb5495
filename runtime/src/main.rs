//! The robot's program: see `runtime --help`.

mod cli;

use clap::Parser;
use cli::{BenchArguments, Cli, Command, PeerArguments, RunArguments};
use nav_model::alloc::CheckedAllocator;
use nav_model::model::Model;
use runtime::bench::{self, BenchOptions, NamedNetwork};
use runtime::bench_loop::{self, LoopBenchError, load, peer};
use runtime::run::plan::End;
use runtime::run::stop::StopReason;
use runtime::terminal::say;
use std::process::ExitCode;

/// Exit status after Ctrl-C.
const INTERRUPTED: u8 = 130;

#[global_allocator]
static ALLOCATOR: CheckedAllocator = CheckedAllocator;

fn main() -> ExitCode {
    let cli = Cli::parse();
    let result = match cli.command {
        None => run(cli.run),
        Some(Command::Run(arguments)) => run(arguments),
        Some(Command::Check(arguments)) => check(&arguments),
        Some(Command::Bench(arguments)) => measure(arguments),
        Some(Command::LoopPeer(arguments)) => loop_peer(arguments),
        Some(Command::LoopHog { seconds }) => {
            load::hog(seconds);
            Ok(ExitCode::SUCCESS)
        }
    };
    result.unwrap_or_else(|error| {
        eprintln!("runtime: {error:#}");
        ExitCode::FAILURE
    })
}

fn run(arguments: RunArguments) -> anyhow::Result<ExitCode> {
    let end = runtime::run::run(&arguments.plan()?)?;
    Ok(match end {
        End::Stopped(StopReason::Interrupt) | End::StoppedWaiting(StopReason::Interrupt) => {
            ExitCode::from(INTERRUPTED)
        }
        _ => ExitCode::SUCCESS,
    })
}

fn check(arguments: &cli::ModelArguments) -> anyhow::Result<ExitCode> {
    for line in nav_model::check::check(&arguments.model)? {
        say(line);
    }
    Ok(ExitCode::SUCCESS)
}

fn measure(arguments: BenchArguments) -> anyhow::Result<ExitCode> {
    if arguments.measure_loop {
        return match bench_loop::measure(&arguments.loop_plan()) {
            Err(error @ LoopBenchError::Stopped(reason)) => {
                eprintln!("runtime: {error}");
                Ok(if reason == StopReason::Interrupt {
                    ExitCode::from(INTERRUPTED)
                } else {
                    ExitCode::SUCCESS
                })
            }
            measured => Ok(measured.map(|_| ExitCode::SUCCESS)?),
        };
    }
    let (td3, dqn) = Model::read(&arguments.model.model)?.into_networks();
    let mut networks = vec![NamedNetwork::new("td3", td3)];
    networks.extend(dqn.map(|dqn| NamedNetwork::new("dqn", dqn)));
    say(bench::networks(&mut networks, &BenchOptions::default())?);
    Ok(ExitCode::SUCCESS)
}

fn loop_peer(arguments: PeerArguments) -> anyhow::Result<ExitCode> {
    let lidar = Model::read(&arguments.model)?.manifest().task.lidar;
    let plan = peer::PeerPlan {
        ipc_root: arguments.ipc_root,
        model: arguments.model,
        rate_hz: arguments.rate,
        seconds: arguments.seconds,
        realtime: arguments.realtime,
    };
    println!("{}", serde_json::to_string(&peer::publish(&plan, &lidar)?)?);
    Ok(ExitCode::SUCCESS)
}
