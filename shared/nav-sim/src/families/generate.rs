//! From family, split, seed and the robot's size to a world that has a way from start to goal.

use super::dice::Dice;
use super::scene::{GOAL_CLEARANCE_M, Scene, set_ends};
use super::{DESIGN_RADIUS_M, Family, PATH_MAX_M, Split};
use crate::geodesic::GeodesicField;
use crate::world::World;
use nav_core::footprint::Footprint;
use nav_core::geometry::Point;
use nav_core::scale::REFERENCE_RADIUS_M;

/// How many starts are tried in one world.
const STARTS: usize = 30;

/// The world of a family, split and seed for the reference robot. The same arguments always give the same world.
pub fn generate(family: Family, split: Split, seed: u64) -> World {
    generate_with_field(family, split, seed, &Footprint::circle(REFERENCE_RADIUS_M)).0
}

/// The seed of the simulation in the world of a family, split and seed: what the robot's disturbances and its people
/// draw from. It differs between families and splits, so that what validation draws is not what the test draws.
pub fn simulation_seed(family: Family, split: Split, seed: u64) -> u64 {
    // No world takes so many attempts, so that no world is drawn from these numbers.
    Dice::new([family as u64, split as u64, seed, u64::MAX]).seed()
}

/// Like [`generate`] in the size of a robot: every gap is the same multiple of it as it is for the reference robot. With the distances to the goal for that robot.
pub fn generate_with_field(
    family: Family,
    split: Split,
    seed: u64,
    footprint: &Footprint,
) -> (World, GeodesicField) {
    let (mut world, field) = generate_reference(family, split, seed);
    if *footprint == Footprint::circle(REFERENCE_RADIUS_M) {
        return (world, field);
    }
    world.grow(family.world_length(footprint));
    let field = GeodesicField::new(&world, footprint);
    (world, field)
}

fn generate_reference(family: Family, split: Split, seed: u64) -> (World, GeodesicField) {
    (0..)
        .find_map(|attempt| {
            let mut dice = Dice::new([family as u64, split as u64, seed, attempt]);
            let mut world = family.draft(&mut dice, split)?;
            world.name = format!("{family}/{split}/{seed}");
            let field = checked(family, &mut dice, &mut world)?;
            Some((world, field))
        })
        .expect("the attempts never end")
}

/// The field of a world whose start and goal are free and joined by a path of reasonable length. Where only the
/// length is wrong, other starts are tried.
fn checked(family: Family, dice: &mut Dice, world: &mut World) -> Option<GeodesicField> {
    let scene = Scene::of(world);
    let goal_m = scene.clearance_m(world.goal);
    if goal_m < GOAL_CLEARANCE_M || scene.clearance_m(world.start.position()) < GOAL_CLEARANCE_M {
        return None;
    }
    let field = GeodesicField::with_clearance(world, world.goal, goal_m, DESIGN_RADIUS_M);
    let is_fine = |start: Point| {
        let straight_m = (world.goal - start).norm();
        field
            .distance_m(start)
            .is_some_and(|path_m| path_m <= PATH_MAX_M && path_m >= family.detour_min() * straight_m)
    };
    if is_fine(world.start.position()) {
        return Some(field);
    }
    let apart_m = family.free_start_m()?;
    let start = (0..STARTS).find_map(|_| {
        let start = scene.free_point(dice, world.bounds.min, world.bounds.max)?;
        ((world.goal - start).norm() >= apart_m && is_fine(start)).then_some(start)
    })?;
    let goal = world.goal;
    set_ends(dice, world, start, goal);
    Some(field)
}
