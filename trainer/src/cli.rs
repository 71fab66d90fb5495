//! The command line.

use clap::{Args, Parser, Subcommand, ValueEnum};
use nav_core::manifest::Algorithm;
use nav_sim::disturbance::DisturbanceName;
use nav_sim::families::{Family, Split};
use std::path::PathBuf;

use crate::config::Profile;

/// Trains, exports and evaluates navigation policies.
#[derive(Debug, Parser)]
#[command(
    name = "trainer",
    version,
    after_help = "The usual way:\n  trainer train        trains the hybrid (profile quick: a few minutes) into runs/\n  \
                  trainer export       writes the newest run as ONNX into models/\n  \
                  trainer evaluate     drives models/ on worlds that training never saw\n\
                  Exit status: 0 when done, 1 on an error, 2 when the command line makes no sense, 129, 130 or 143 after \
                  SIGHUP, Ctrl-C or SIGTERM."
)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Trains a policy; Ctrl-C saves it, --resume continues.
    Train(TrainArgs),
    /// Writes a trained policy as ONNX, with manifest, golden pairs and model card.
    Export(ExportArgs),
    /// Drives policies on held-out worlds and writes table, CSV, JSON and pictures.
    Evaluate(EvaluateArgs),
}

/// What is trained.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum AlgorithmArg {
    /// TD3, then DQN above it.
    Hybrid,
    /// TD3 alone, straight at the goal: the flat rival.
    Td3,
    /// DQN above the low level of a finished run (--low).
    Dqn,
}

impl AlgorithmArg {
    /// The kind of policy that comes of it.
    pub fn policy(self) -> Algorithm {
        match self {
            Self::Hybrid | Self::Dqn => Algorithm::Hybrid,
            Self::Td3 => Algorithm::Td3,
        }
    }
}

/// `trainer train`
#[derive(Debug, Args)]
pub struct TrainArgs {
    /// How much is spent [default: quick, or what --config says]
    #[arg(long, value_enum)]
    pub profile: Option<Profile>,
    /// What is trained [default: hybrid, or what --config says]
    #[arg(long, value_enum)]
    pub algorithm: Option<AlgorithmArg>,
    /// Every random number follows from this [default: 1, or what --config says]
    #[arg(long)]
    pub seed: Option<u64>,
    /// A TOML file with any fields of the configuration; --print-config shows them all
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// The folder of the run [default: the next number in runs/]
    #[arg(long, value_name = "FOLDER")]
    pub out: Option<PathBuf>,
    /// Continue an interrupted run exactly where it was [without a folder: the newest in runs/]
    #[arg(long, value_name = "FOLDER", num_args = 0..=1, conflicts_with_all = ["profile", "algorithm", "seed", "config", "out"])]
    pub resume: Option<Option<PathBuf>>,
    /// With --algorithm dqn: the finished run whose low level to use
    #[arg(long, value_name = "FOLDER", conflicts_with = "resume")]
    pub low: Option<PathBuf>,
    /// Print the whole configuration as TOML and stop
    #[arg(long)]
    pub print_config: bool,
}

/// `trainer export`
#[derive(Debug, Args)]
pub struct ExportArgs {
    /// The run to export [default: the newest finished run in runs/]
    #[arg(long, value_name = "FOLDER")]
    pub run: Option<PathBuf>,
    /// Where to write the model
    #[arg(long, value_name = "FOLDER", default_value = "models")]
    pub out: PathBuf,
}

/// A policy to evaluate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum PolicyName {
    /// The model: DQN above TD3.
    Hybrid,
    /// A flat TD3: --flat-model, or else the model's own TD3 driven straight at the goal.
    Td3,
    /// A* on the known static map, with a follower.
    Astar,
    /// Dijkstra on the known static map, with a follower.
    Dijkstra,
    /// A reactive rival without memory.
    Reactive,
}

/// `trainer evaluate`
#[derive(Debug, Args)]
pub struct EvaluateArgs {
    /// The exported model
    #[arg(long, value_name = "FOLDER", default_value = "models")]
    pub model: PathBuf,
    /// For the policy td3: an exported flat model, or the folder of a finished flat run [default: the model's own
    /// TD3, straight at the goal]
    #[arg(long, value_name = "FOLDER")]
    pub flat_model: Option<PathBuf>,
    /// What drives
    #[arg(long, value_enum, value_delimiter = ',', default_value = "hybrid,td3,astar,dijkstra,reactive")]
    pub policies: Vec<PolicyName>,
    /// Families of worlds
    #[arg(
        long,
        value_delimiter = ',',
        default_value = "clutter,boxes,u_trap,deep_u,hook,maze,rooms,crowd,stream"
    )]
    pub families: Vec<Family>,
    /// Worlds a family, seeds 0, 1, 2 and so on
    #[arg(long, default_value_t = 100)]
    pub worlds: u64,
    /// Which worlds: `test` was never looked at, `validation` chose the model
    #[arg(long, default_value = "test")]
    pub split: Split,
    /// How the robot differs from a perfect one: usual (noise, dropout, latency, lag, drift, and a localiser that
    /// corrects the goal each second), no_localiser (the drift stays), none (a perfect robot)
    #[arg(long, default_value_t)]
    pub disturbance: DisturbanceName,
    /// Threads
    #[arg(long, default_value_t = 2)]
    pub threads: usize,
    /// Episodes of each policy and family on the picture sheet; 0 draws none
    #[arg(long, default_value_t = 1)]
    pub pictures: usize,
    /// Where table, CSV, JSON and pictures go
    #[arg(long, value_name = "FOLDER", default_value = "out/evaluate")]
    pub out: PathBuf,
}
