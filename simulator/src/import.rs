//! `simulator import`: a list of cylinders becomes a folder of world files.

use anyhow::{Context, Result, bail, ensure};
use clap::Args;
use nav_core::footprint::Footprint;
use nav_core::geometry::{Point, Pose};
use nav_host::terminal::{debug, say, warn};
use nav_sim::cylinders::{Surroundings, read};
use nav_sim::world_file::{check, save};
use std::path::{Path, PathBuf};

use crate::cli::numbers;

/// What to import, and where to.
#[derive(Debug, Args)]
#[command(after_help = "\
Example, with the worlds of the BARN challenge as a list:
  simulator import barn.csv --start -2,3,1.5708 --goal -2,13 --out worlds/barn
The list's first line names its columns: world (letters, digits, - and _), x_m, y_m and radius_m; others are left out.
Exit status: 0 when every world was written, 1 when one was left out or on an error.")]
pub(crate) struct Import {
    /// A list of cylinders: CSV with a row for each
    #[arg(value_name = "FILE.csv")]
    list: PathBuf,
    /// Write each world into this folder, as FILE_WORLD.toml
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Start pose in every world: x,y in metres and yaw in radians
    #[arg(long, value_name = "X,Y,YAW", value_parser = numbers::<3>, allow_hyphen_values = true)]
    start: [f32; 3],
    /// Goal in every world: x,y in metres
    #[arg(long, value_name = "X,Y", value_parser = numbers::<2>, allow_hyphen_values = true)]
    goal: [f32; 2],
    /// From cylinders, start and goal to the wall round each world
    #[arg(long, value_name = "METRES", default_value_t = 1.0)]
    margin: f32,
    /// Leave out worlds in which a robot of this radius has no way to the goal
    #[arg(long, value_name = "METRES", default_value_t = 0.2)]
    robot_radius: f32,
}

impl Import {
    /// Reads the list, then writes each world that a robot can use.
    pub(crate) fn run(&self) -> Result<()> {
        ensure!((0.0..=1000.0).contains(&self.margin), "--margin must lie between 0 and 1000 m");
        ensure!(
            self.robot_radius > 0.0 && self.robot_radius <= 10.0,
            "--robot-radius must lie between 0 and 10 m"
        );
        let [x_m, y_m, yaw_rad] = self.start;
        let surroundings = Surroundings {
            start: Pose::new(x_m, y_m, yaw_rad),
            goal: Point::from(self.goal),
            margin_m: self.margin,
        };
        let worlds = read(&self.list, &surroundings)?;
        make_empty(&self.out)?;
        let mut left_out = 0;
        for world in &worlds {
            match check(world, &Footprint::circle(self.robot_radius)) {
                Ok(()) => {
                    let path = self.out.join(format!("{}.toml", world.name));
                    save(&path, world)?;
                    debug(format_args!("{}: {} cylinders", path.display(), world.discs.len()));
                }
                Err(problem) => {
                    left_out += 1;
                    warn(format_args!("simulator: {} is left out: {problem}", world.name));
                }
            }
        }
        let written = worlds.len() - left_out;
        say(format_args!("{written} worlds in {}", self.out.display()));
        if left_out > 0 {
            bail!("{left_out} of {} worlds were left out", worlds.len());
        }
        Ok(())
    }
}

/// Makes a folder, which must not hold worlds of another list: they would be read as one with these.
fn make_empty(folder: &Path) -> Result<()> {
    let unusable = || format!("--out: the folder {} cannot be used", folder.display());
    std::fs::create_dir_all(folder).with_context(unusable)?;
    for entry in std::fs::read_dir(folder).with_context(unusable)? {
        let path = entry.with_context(unusable)?.path();
        ensure!(
            path.extension().is_none_or(|extension| extension != "toml"),
            "--out: {} lies there already; choose an empty folder",
            path.display()
        );
    }
    Ok(())
}
