//! The worlds of a run: generated once, shared by all robots, with their shortest ways.

use nav_sim::families::{DESIGN_RADIUS_M, Family, Split, generate_with_field, simulation_seed};
use nav_sim::geodesic::GeodesicField;
use nav_sim::world::World;
use std::ops::Range;
use std::sync::Arc;

/// A world and the shortest ways to its goal.
#[derive(Clone, Debug)]
pub struct Place {
    /// Its family.
    pub family: Family,
    /// Its seed within family and split.
    pub seed: u64,
    /// The seed of the simulation that judges a policy in it.
    pub simulation_seed: u64,
    /// The world.
    pub world: Arc<World>,
    /// Distances to the goal for the footprint.
    pub field: Arc<GeodesicField>,
}

/// Generates the worlds of these seeds of each family on two threads.
pub fn generate_places(
    families: &[Family],
    split: Split,
    seeds: Range<u64>,
    robot_radius_m: f32,
) -> Vec<Place> {
    let wanted: Vec<_> =
        families.iter().flat_map(|&family| seeds.clone().map(move |seed| (family, seed))).collect();
    let make = |&(family, seed): &(Family, u64)| {
        let (world, field) = generate_with_field(family, split, seed);
        let fits = (robot_radius_m - DESIGN_RADIUS_M).abs() < 1e-6;
        let field = if fits { field } else { GeodesicField::new(&world, robot_radius_m) };
        let simulation_seed = simulation_seed(family, split, seed);
        Place { family, seed, simulation_seed, world: Arc::new(world), field: Arc::new(field) }
    };
    let (front, back) = wanted.split_at(wanted.len() / 2);
    std::thread::scope(|scope| {
        let other = scope.spawn(|| back.iter().map(make).collect::<Vec<_>>());
        let mut places: Vec<_> = front.iter().map(make).collect();
        places.extend(other.join().expect("world generation does not panic"));
        places
    })
}
