//! The command line.

use clap::{Args, Parser, Subcommand, ValueEnum};
use nav_core::manifest::Algorithm;
use nav_core::task::ShieldMode;
use nav_env::other_lidar::OtherLidar;
use nav_host::terminal::LogArguments;
use nav_sim::disturbance::DisturbanceName;
use nav_sim::families::{Family, Split};
use std::path::PathBuf;

use crate::config::Profile;
use crate::evaluate::policies::PolicyArg;

/// Trains, exports and evaluates navigation policies.
#[derive(Debug, Parser)]
#[command(
    name = "trainer",
    version,
    after_help = "The usual way:\n  trainer train        trains the hybrid (profile quick: a few minutes) into runs/\n  \
                  trainer export       writes the newest run as ONNX into models/\n  \
                  trainer evaluate     drives models/ on worlds that training never saw\n\
                  When a run misses its gate (status 1; what was trained is kept):\n  \
                  trainer train --resume runs/1 --more 200000     trains it further\n  \
                  trainer gate runs/1 --config looser.toml        judges it by other thresholds ([gate])\n\
                  Exit status: 0 when done, 1 on an error, 2 when the command line makes no sense, 129, 130 or 143 after \
                  SIGHUP, Ctrl-C or SIGTERM."
)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
    /// How much to say.
    #[command(flatten)]
    pub log: LogArguments,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Trains a policy; Ctrl-C saves it, --resume continues.
    Train(TrainArgs),
    /// Lists the robots that are known by name, or says what is odd about one before it is trained for.
    #[command(subcommand)]
    Robot(RobotCommand),
    /// Judges a finished run anew, by other thresholds; what was said before is kept, and the model card tells both.
    Gate(GateArgs),
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
#[command(after_help = "\
Examples:
  trainer train                                      a hybrid with the profile quick, into runs/
  trainer train --robot turtlebot3_burger            for a robot by its name (`trainer robot list`) or its file
  trainer train --config mine.toml --seed 3 --attempts 1
  trainer train --resume                             goes on with what Ctrl-C or a pulled plug ended
  trainer train --resume runs/1 --more 200000        goes on with a run that has finished
Exit status: 0 when the gate was passed, 1 on an error or when it was missed (the run is kept, and what can be done is said), \
129, 130 or 143 after SIGHUP, Ctrl-C or SIGTERM.")]
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
    /// For which robot: the name of a profile, or a TOML file with the tables `robot` and `lidar`. All other defaults follow from it;
    /// fields that --config names win over the profile's [default: a disc of 0.2 m with 1 m/s, or what --config says]
    #[arg(long, value_name = "NAME|FILE")]
    pub robot: Option<String>,
    /// A TOML file with any fields of the configuration; --print-config shows them all
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// The folder of the run [default: the next number in runs/]
    #[arg(long, value_name = "FOLDER")]
    pub out: Option<PathBuf>,
    /// Continue an interrupted run exactly where it was [without a folder: the newest in runs/]
    #[arg(long, value_name = "FOLDER", num_args = 0..=1, conflicts_with_all = ["profile", "algorithm", "seed", "robot", "config", "out"])]
    pub resume: Option<Option<PathBuf>>,
    /// With --resume: trains a finished run for so many environment steps more and judges it again. Its stages share them as
    /// they shared those before: first the low level, then the high level above it
    #[arg(long, value_name = "STEPS", requires = "resume", value_parser = clap::value_parser!(u64).range(1..=10_000_000_000))]
    pub more: Option<u64>,
    /// Seeds to try, this one included, each in a folder of its own, as long as the gate is missed narrowly: no threshold by
    /// more than 5 percentage points, so that luck may be to blame
    #[arg(long, value_name = "N", default_value_t = 2, conflicts_with = "resume", value_parser = clap::value_parser!(u32).range(1..=20))]
    pub attempts: u32,
    /// With --algorithm dqn: the finished run whose low level to use
    #[arg(long, value_name = "FOLDER", conflicts_with = "resume")]
    pub low: Option<PathBuf>,
    /// Print the whole configuration as TOML, with the range of each number, and stop
    #[arg(long)]
    pub print_config: bool,
}

/// `trainer robot`
#[derive(Debug, Subcommand)]
pub enum RobotCommand {
    /// The robots that are known by name, a line each.
    List,
    /// What follows from a robot, and what is odd about it.
    #[command(after_help = "\
A FILE looks as those in robots/ do: [robot] with footprint, linear_max_mps and angular_max_radps at least, [lidar] with \
beam_count and range_max_m at least.
Exit status: 0 when it can be trained for, odd or not, 1 when it cannot.")]
    Check {
        /// The name of a profile, or a file [default: lists the names]
        #[arg(value_name = "NAME|FILE")]
        robot: Option<String>,
    },
}

/// `trainer gate`
#[derive(Debug, Args)]
#[command(after_help = "\
The validation worlds are driven again with the policy as it is. A file with nothing but the thresholds to change is enough:
  [gate]
  low_reach = 0.85
Exit status: 0 when the gate is passed, 1 when it is missed or on an error.")]
pub struct GateArgs {
    /// The finished run
    #[arg(value_name = "RUN")]
    pub run: PathBuf,
    /// A TOML file whose gate table counts instead of the run's own; anything else in it must be as in the run
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
}

/// `trainer export`
#[derive(Debug, Args)]
pub struct ExportArgs {
    /// The run to export; of one that missed its gate, the attempt after it that passed [default: the newest finished run
    /// in runs/]
    #[arg(long, value_name = "FOLDER")]
    pub run: Option<PathBuf>,
    /// Where to write the model
    #[arg(long, value_name = "FOLDER", default_value = "models")]
    pub out: PathBuf,
}

/// `trainer evaluate`
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  trainer evaluate                                 the model in models/, its own TD3 and every rival
  trainer evaluate --policy a=runs/1 --policy b=runs/2 --policy astar --families maze,rooms --worlds 500
  trainer evaluate --policy mine=models --policy reactive --world-files barn --time-limit 100 --goal-radius 1
  trainer evaluate --robot jackal --policy astar   what is possible for a robot before it is trained for
  trainer evaluate --resume                        goes on where Ctrl-C, a full disk or a pulled plug ended it
Exit status: 0 when all was driven, 1 on an error, 130 or 143 after Ctrl-C or SIGTERM.")]
pub struct EvaluateArgs {
    /// What drives, and what tables call it; any number of times. A POLICY is the folder of an exported model or of a
    /// finished run; flat:FOLDER is the low level of one alone, straight at the goal; informed:FOLDER and
    /// informed-flat:FOLDER are the same two with a safety gate that is told the true places and velocities of all
    /// people within the lidar's range, seen or not; astar and dijkstra know the static map, reactive the newest scan,
    /// and clairvoyant the future (informed and clairvoyant are no robots, but say what is possible; these need no
    /// LABEL; a folder of such a name is ./astar)
    #[arg(long = "policy", value_name = "[LABEL=]POLICY")]
    pub policies: Vec<PolicyArg>,
    /// Without --policy: the model that drives as `hybrid`, with its own low level as `td3`, beside every rival
    #[arg(long, value_name = "FOLDER", default_value = "models", conflicts_with = "policies")]
    pub model: PathBuf,
    /// Families of worlds [default: clutter, boxes, u_trap, deep_u, hook, maze, rooms, crowd, stream, corridor and doorway,
    /// or none with --world-files]
    #[arg(long, value_delimiter = ',')]
    pub families: Vec<Family>,
    /// Worlds a family, seeds 0, 1, 2 and so on
    #[arg(long, default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub worlds: u32,
    /// Which worlds: `test` was never looked at, `validation` chose the model
    #[arg(long, default_value = "test")]
    pub split: Split,
    /// Drive in every *.toml of this folder, too
    #[arg(long, value_name = "FOLDER")]
    pub world_files: Option<PathBuf>,
    /// How the robot differs from a perfect one: usual (noise, dropout, latency, lag, drift, and a localiser that
    /// corrects the goal each second), no_localiser (the drift stays), none (a perfect robot)
    #[arg(long, default_value_t)]
    pub disturbance: DisturbanceName,
    /// The robot that rivals drive where no trained policy says it: the name of a profile, or a file; a trained policy must
    /// be for the same
    #[arg(long, value_name = "NAME|FILE")]
    pub robot: Option<String>,
    /// Simulated seconds after which an episode is over [default: the policy's own, and 80 in mazes and deep traps]
    #[arg(long, value_name = "SECONDS")]
    pub time_limit: Option<f32>,
    /// The goal counts as reached when the robot's centre is this close, m [default: the policy's own]
    #[arg(long, value_name = "M")]
    pub goal_radius: Option<f32>,
    /// Another lidar than the trained one, BEAMSxMETRES, as in 360x12; the controller resamples its scans
    #[arg(long, value_name = "LIDAR")]
    pub lidar: Option<OtherLidar>,
    /// The safety gate between policy and base, on or off [default: as each policy's task says, on for rivals]
    #[arg(long, value_name = "on|off")]
    pub shield: Option<ShieldMode>,
    /// Threads; the rows do not depend on it
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u16).range(1..=64))]
    pub threads: u16,
    /// Episodes of each policy and family on the picture sheet; of ten times as many collisions the last seconds are
    /// drawn; 0 draws none
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u16).range(0..=100))]
    pub pictures: u16,
    /// Where rows, table, figures and pictures go
    #[arg(long, value_name = "FOLDER", default_value = "out/evaluate")]
    pub out: PathBuf,
    /// Go on with the interrupted evaluation in --out; the rest of the command must be as it was
    #[arg(long)]
    pub resume: bool,
}
