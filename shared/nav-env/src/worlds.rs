//! The worlds of a run: made once, shared by all robots, with their shortest ways.

use nav_core::footprint::Footprint;
use nav_core::task::Robot;
use nav_sim::families::{Family, Split, generate_with_field, simulation_seed};
use nav_sim::geodesic::GeodesicField;
use nav_sim::world::World;
use std::fmt;
use std::ops::Range;
use std::sync::Arc;

/// Where a world comes from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Scene {
    /// Generated.
    Family(Family, Split),
    /// From a file or a map, by its name.
    File(Arc<str>),
}

impl Scene {
    /// The family, of a generated world.
    pub fn family(&self) -> Option<Family> {
        match self {
            Self::Family(family, _) => Some(*family),
            Self::File(_) => None,
        }
    }

    /// How long an episode must be allowed to take, s.
    pub fn episode_s(&self, robot: &Robot) -> f32 {
        self.family().map_or(0.0, |family| family.episode_s(robot))
    }
}

impl fmt::Display for Scene {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Family(family, _) => family.fmt(f),
            Self::File(name) => f.pad(name),
        }
    }
}

/// A world and the shortest ways to its goal.
#[derive(Clone, Debug)]
pub struct Place {
    /// Where the world comes from.
    pub scene: Scene,
    /// Its seed within family and split; of a world from a file, that of the simulation.
    pub seed: u64,
    /// The seed of the simulation that judges a policy in it.
    pub simulation_seed: u64,
    /// The world.
    pub world: Arc<World>,
    /// Distances to the goal for the footprint.
    pub field: Arc<GeodesicField>,
}

impl Place {
    /// The generated world of a family, split and seed, in the size of a robot.
    pub fn generated(family: Family, split: Split, seed: u64, footprint: &Footprint) -> Self {
        let (world, field) = generate_with_field(family, split, seed, footprint);
        Self {
            scene: Scene::Family(family, split),
            seed,
            simulation_seed: simulation_seed(family, split, seed),
            world: Arc::new(world),
            field: Arc::new(field),
        }
    }

    /// A world that was read, for a robot; `seed` is the simulation's.
    pub fn read(name: &str, world: Arc<World>, seed: u64, footprint: &Footprint) -> Self {
        let field = Arc::new(GeodesicField::new(&world, footprint));
        Self { scene: Scene::File(name.into()), seed, simulation_seed: seed, world, field }
    }

    /// Shortest way from the start to the goal, m; `None` where the map has none.
    pub fn geodesic_m(&self) -> Option<f32> {
        self.field.path_length_m(self.world.start.position()).filter(|length_m| length_m.is_finite())
    }
}

/// Generates the worlds of these seeds of each family on two threads, or on this one where the system gives no other.
pub fn generate_places(
    families: &[Family],
    split: Split,
    seeds: Range<u64>,
    footprint: &Footprint,
) -> Vec<Place> {
    let wanted: Vec<_> =
        families.iter().flat_map(|&family| seeds.clone().map(move |seed| (family, seed))).collect();
    let make = |&(family, seed): &(Family, u64)| Place::generated(family, split, seed, footprint);
    let (front, back) = wanted.split_at(wanted.len() / 2);
    let make_back = || back.iter().map(make).collect::<Vec<_>>();
    std::thread::scope(|scope| {
        let other = std::thread::Builder::new().spawn_scoped(scope, make_back);
        let mut places: Vec<_> = front.iter().map(make).collect();
        places.extend(match other {
            Ok(other) => other.join().expect("world generation does not panic"),
            // A machine that has no thread to spare only takes longer.
            Err(_) => make_back(),
        });
        places
    })
}
