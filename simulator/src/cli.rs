//! The command line, as typed.

use clap::{Parser, Subcommand, ValueEnum};
use nav_host::terminal::LogArguments;
use nav_sim::disturbance::DisturbanceName;
use nav_sim::families::{Family, Split};
use std::path::PathBuf;

use crate::import::Import;

/// How simulated time passes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Pace {
    /// One step each control period of the clock, whether or not a command came.
    Realtime,
    /// One step for each answered scan, as fast as it goes; the same seed gives the same bits.
    Lockstep,
}

/// What to look at while it runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum ViewChoice {
    /// Nothing but a line an episode.
    None,
    /// A map in the terminal.
    Terminal,
}

/// What to do instead of simulating a robot.
#[derive(Debug, Subcommand)]
pub(crate) enum Instead {
    /// Turn a list of cylinders (CSV) into a folder of world files
    Import(Import),
}

/// A simulated robot behind the robot's own topics.
///
/// Publishes scan, odom and goal, drives by cmd_vel, and reports how each episode ended. Start the runtime beside it,
/// in any order, with the same --robot.
#[derive(Debug, Parser)]
#[command(
    version,
    args_conflicts_with_subcommands = true,
    after_help = "\
Examples:
  simulator --world maze --view terminal         one held-out maze in real time, shown in the terminal
  simulator --family u_trap --episodes 20 --pace lockstep --report out/u_trap.json
  simulator --robot-profile turtlebot3_burger    that robot, for a driver to be tried against, without a model
  simulator --map office/map.yaml --start 1,2,0 --goal 8.5,3
  simulator --world-file barn --pace lockstep --time-limit 100 --goal-radius 1 --report out/barn.json
Exit status: 0 when all episodes were driven, 1 on an error (no runtime, wrong map), 2 when the command line makes no
sense, 129, 130 or 143 after SIGHUP, Ctrl-C or SIGTERM."
)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    pub(crate) instead: Option<Instead>,
    #[command(flatten)]
    pub(crate) log: LogArguments,
    /// Scene family to generate worlds from: clutter, boxes, u_trap, deep_u, hook, maze, maze_tight, rooms, crowd, stream, tight, corridor, doorway
    #[arg(long, visible_alias = "world", default_value = "clutter", conflicts_with_all = ["map", "world_file"])]
    pub(crate) family: Family,
    /// Which worlds of the family: train, validation or test (never seen in training)
    #[arg(long, default_value = "test", conflicts_with_all = ["map", "world_file"])]
    pub(crate) split: Split,
    /// Seed of the first episode's world, and with it of what disturbs the robot; each further episode adds one
    #[arg(long, default_value_t = 0)]
    pub(crate) seed: u64,
    /// Episodes in a row [default: 1, or one in each file of a folder]
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) episodes: Option<u32>,
    /// Drive on a ROS map_server map (map.yaml beside its image)
    #[arg(long, value_name = "FILE", requires_all = ["start", "goal"], conflicts_with = "world_file")]
    pub(crate) map: Option<PathBuf>,
    /// Start pose on the map: x,y in metres and yaw in radians
    #[arg(long, value_name = "X,Y,YAW", requires = "map", value_parser = numbers::<3>, allow_hyphen_values = true)]
    pub(crate) start: Option<[f32; 3]>,
    /// Goal on the map: x,y in metres
    #[arg(long, value_name = "X,Y", requires = "map", value_parser = numbers::<2>, allow_hyphen_values = true)]
    pub(crate) goal: Option<[f32; 2]>,
    /// Drive in a world described in TOML, or in every *.toml of a folder, one after the other
    #[arg(long, value_name = "FILE OR FOLDER")]
    pub(crate) world_file: Option<PathBuf>,
    /// Simulated seconds after which an episode is over [default: the model's own, and 80 in mazes and deep traps]
    #[arg(long, value_name = "SECONDS")]
    pub(crate) time_limit: Option<f32>,
    /// The goal counts as reached when the robot's centre is this close, m [default: the model's own]
    #[arg(long, value_name = "M")]
    pub(crate) goal_radius: Option<f32>,
    /// Take robot, lidar and timing from this model's manifest instead of the defaults
    #[arg(long, value_name = "DIR")]
    pub(crate) model: Option<PathBuf>,
    /// Simulate this robot: the name of a profile (an unknown one lists them all), or a TOML file with the tables `robot` and `lidar`.
    /// Beside --model it must be the robot that the model was trained for
    #[arg(long, value_name = "NAME|FILE")]
    pub(crate) robot_profile: Option<String>,
    /// How time passes
    #[arg(long, value_enum, default_value_t = Pace::Realtime)]
    pub(crate) pace: Pace,
    /// How the robot differs from a perfect one: usual (noise, dropout, latency, lag, drift, and a localiser that
    /// corrects the goal each second), no_localiser (the drift stays), none (a perfect robot)
    #[arg(long, default_value_t)]
    pub(crate) disturbance: DisturbanceName,
    /// Name of the robot, part of every topic
    #[arg(long, default_value = "robot")]
    pub(crate) robot: String,
    /// Write a JSON report of all episodes
    #[arg(long, value_name = "FILE")]
    pub(crate) report: Option<PathBuf>,
    /// Put the true pose after each step into the report
    #[arg(long, requires = "report")]
    pub(crate) poses: bool,
    /// Draw each episode into this folder, and the last seconds before a collision
    #[arg(long, value_name = "DIR")]
    pub(crate) draw: Option<PathBuf>,
    /// What to show while it runs
    #[arg(long, value_enum, default_value_t = ViewChoice::None)]
    pub(crate) view: ViewChoice,
    /// Seconds to wait for the runtime before the first command
    #[arg(long, value_name = "SECONDS", default_value_t = 30.0)]
    pub(crate) wait: f64,
    /// Seconds without a command after which the runtime counts as gone [default: 2 in lock-step, 10 in real time]
    #[arg(long, value_name = "SECONDS")]
    pub(crate) silence: Option<f64>,
    /// Keep the shared files apart under this absolute path (the runtime needs the same)
    #[arg(long, value_name = "DIR")]
    pub(crate) ipc_root: Option<PathBuf>,
}

/// `N` finite numbers with commas between.
pub(crate) fn numbers<const N: usize>(text: &str) -> Result<[f32; N], String> {
    let parsed: Result<Vec<f32>, _> = text.split(',').map(|part| part.trim().parse()).collect();
    match parsed.map(<[f32; N]>::try_from) {
        Ok(Ok(numbers)) if numbers.iter().all(|number| number.is_finite()) => Ok(numbers),
        _ => Err(format!("give {N} numbers with commas between, such as {}", ["1.5"; N].join(","))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_counted_and_finite() {
        assert_eq!(numbers::<3>("1, -2.5,0"), Ok([1.0, -2.5, 0.0]));
        for bad in ["1,2", "1,2,3,4", "1,2,x", "1,2,nan", ""] {
            assert!(numbers::<3>(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn the_command_line_is_consistent() {
        use clap::CommandFactory;
        Arguments::command().debug_assert();
        assert!(Arguments::try_parse_from(["simulator", "--world", "maze"]).is_ok());
        assert!(Arguments::try_parse_from(["simulator", "--map", "m.yaml"]).is_err(), "no start, no goal");
        assert!(Arguments::try_parse_from(["simulator", "--episodes", "0"]).is_err());
        let import = "import list.csv --out worlds --start -2,3,1.5 --goal -2,13";
        let parsed = |line: &str| Arguments::try_parse_from(line.split(' '));
        assert!(matches!(parsed(&format!("simulator {import}")), Ok(Arguments { instead: Some(_), .. })));
        assert!(parsed(&format!("simulator --seed 3 {import}")).is_err(), "an import has no seed");
    }
}
