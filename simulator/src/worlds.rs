//! Where worlds come from: a family, a map or a file.

use anyhow::{Result, ensure};
use nav_core::geometry::{Point, Pose};
use nav_core::task::{Robot, Task};
use nav_env::worlds::Place;
use nav_host::terminal::warn;
use nav_sim::families::{Family, Split};
use nav_sim::map_file::{Map, MapOptions};
use nav_sim::world::World;
use nav_sim::world_file;
use std::path::Path;
use std::sync::Arc;

use crate::cli::Arguments;

/// Where worlds come from.
#[derive(Clone, Debug)]
pub(crate) enum WorldSource {
    /// A generated one for each seed.
    Family(Family, Split),
    /// These, one after the other and then again, each with its name.
    Read(Vec<(String, Arc<World>)>),
}

impl WorldSource {
    /// Reads what the command line names.
    pub(crate) fn from_arguments(arguments: &Arguments, task: &Task) -> Result<Self> {
        if let (Some(map), Some([x_m, y_m, yaw_rad]), Some(goal)) =
            (&arguments.map, arguments.start, arguments.goal)
        {
            let options = MapOptions { footprint: task.robot.footprint, ..MapOptions::default() };
            let start = Pose::new(x_m, y_m, yaw_rad);
            let map = Map::load(map, &options)?;
            for warning in map.warnings() {
                warn(format_args!("simulator: warning: {warning}"));
            }
            let world = map.into_world(start, Point::new(goal[0], goal[1]))?;
            return Ok(Self::Read(vec![(world.name.clone(), Arc::new(world))]));
        }
        if let Some(path) = &arguments.world_file {
            let worlds = if path.is_dir() {
                world_file::read_folder(path, &task.robot.footprint)?
            } else {
                vec![(path.clone(), world_file::load(path, &task.robot.footprint)?)]
            };
            let name = |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            return Ok(Self::Read(
                worlds.into_iter().map(|(path, world)| (name(&path), Arc::new(world))).collect(),
            ));
        }
        Ok(Self::Family(arguments.family, arguments.split))
    }

    /// How long its episodes must be allowed to take, s.
    pub(crate) fn episode_s(&self, robot: &Robot) -> f32 {
        match self {
            Self::Family(family, _) => family.episode_s(robot),
            Self::Read(_) => 0.0,
        }
    }

    /// Episodes unless somebody asks for another number.
    pub(crate) fn episodes(&self) -> u32 {
        match self {
            Self::Family(..) => 1,
            Self::Read(worlds) => worlds.len() as u32,
        }
    }

    /// The world of an episode, counted from 0, and a seed, with a way from start to goal.
    pub(crate) fn place(&self, episode: u32, seed: u64, task: &Task) -> Result<Place> {
        let footprint = &task.robot.footprint;
        let place = match self {
            &Self::Family(family, split) => Place::generated(family, split, seed, footprint),
            Self::Read(worlds) => {
                let (name, world) = &worlds[episode as usize % worlds.len()];
                Place::read(name, world.clone(), seed, footprint)
            }
        };
        ensure!(
            place.geodesic_m().is_some(),
            "in {} a robot of {footprint} has no way from start to goal: choose other ones",
            place.world.name
        );
        Ok(place)
    }
}
