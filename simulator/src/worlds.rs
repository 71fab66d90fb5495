//! Where worlds come from: a family, a map or a file.

use anyhow::{Context, Result, bail, ensure};
use nav_core::geometry::{Point, Pose};
use nav_core::task::Task;
use nav_sim::families::{DESIGN_RADIUS_M, Family, Split, generate, simulation_seed};
use nav_sim::geodesic::GeodesicField;
use nav_sim::map_file::{Map, MapOptions};
use nav_sim::world::World;
use nav_sim::world_file;
use std::sync::Arc;

use crate::cli::Arguments;

/// Where worlds come from.
#[derive(Clone, Debug)]
pub(crate) enum WorldSource {
    /// A generated one for each seed.
    Family(Family, Split),
    /// The same one each time.
    Fixed(Arc<World>),
}

/// A world, the seed of what disturbs the robot in it, and the length of its shortest path, m.
#[derive(Clone, Debug)]
pub(crate) struct Place {
    pub(crate) world: Arc<World>,
    pub(crate) simulation_seed: u64,
    pub(crate) geodesic_m: f32,
    pub(crate) euclidean_m: f32,
}

impl WorldSource {
    /// Reads what the command line names.
    pub(crate) fn from_arguments(arguments: &Arguments, task: &Task) -> Result<Self> {
        if let (Some(map), Some([x_m, y_m, yaw_rad]), Some(goal)) =
            (&arguments.map, arguments.start, arguments.goal)
        {
            let options = MapOptions { robot_radius_m: task.robot.radius_m, ..MapOptions::default() };
            let start = Pose::new(x_m, y_m, yaw_rad);
            let map = Map::load(map, &options)?;
            for warning in map.warnings() {
                eprintln!("simulator: warning: {warning}");
            }
            let world = map.into_world(start, Point::new(goal[0], goal[1]))?;
            return Ok(Self::Fixed(Arc::new(world)));
        }
        if let Some(path) = &arguments.world_file {
            return Ok(Self::Fixed(Arc::new(world_file::load(path, task.robot.radius_m)?)));
        }
        ensure!(
            task.robot.radius_m <= DESIGN_RADIUS_M + 1e-6,
            "the scene families have ways for a robot of radius {DESIGN_RADIUS_M} m at most, and --model has one of \
             {} m: drive it on a --map or in a --world-file",
            task.robot.radius_m
        );
        Ok(Self::Family(arguments.family, arguments.split))
    }

    /// How long its episodes may take at least, steps of 0.1 s.
    pub(crate) fn episode_steps(&self) -> u32 {
        match self {
            Self::Family(family, _) => family.episode_steps(),
            Self::Fixed(_) => 0,
        }
    }

    /// The world of a seed, with a way from start to goal.
    pub(crate) fn place(&self, seed: u64, task: &Task) -> Result<Place> {
        let (world, simulation_seed) = match self {
            &Self::Family(family, split) => {
                (Arc::new(generate(family, split, seed)), simulation_seed(family, split, seed))
            }
            Self::Fixed(world) => (world.clone(), seed),
        };
        let start = world.start.position();
        let field = GeodesicField::new(&world, task.robot.radius_m);
        let geodesic_m = field.path_length_m(start).with_context(|| {
            format!(
                "in {} a robot of radius {} m has no way from start to goal: choose other ones",
                world.name, task.robot.radius_m
            )
        })?;
        if !geodesic_m.is_finite() {
            bail!("in {} the way to the goal has no length: choose another goal", world.name);
        }
        let euclidean_m = (world.goal - start).norm();
        Ok(Place { world, simulation_seed, geodesic_m, euclidean_m })
    }
}
