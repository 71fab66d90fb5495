//! Open floors: discs, boxes, people.

use super::Split;
use super::dice::Dice;
use super::people::{self, Manners};
use super::scene::{Scene, add_discs, place_ends, solid, square};
use crate::world::World;
use nav_core::geometry::{Point, Pose};

pub(super) fn clutter(dice: &mut Dice) -> Option<World> {
    let mut world = square(14.0);
    let count = dice.count(15..=25);
    add_discs(dice, &mut world, count, 0.2..=0.6, 0.1, &[]);
    if world.discs.len() < 15 {
        return None;
    }
    place_ends(dice, &mut world, 6.0)?;
    Some(world)
}

/// The room of the source paper.
pub(super) fn boxes(dice: &mut Dice) -> Option<World> {
    let mut world = square(10.0);
    for _ in 0..200 {
        if world.polygons.len() == 4 {
            break;
        }
        let half_x = 0.5 * dice.within(0.6..=1.6);
        let half_y = 0.5 * dice.within(0.6..=1.6);
        let reach_m = libm::hypotf(half_x, half_y);
        let center = dice.point(world.bounds.min, world.bounds.max, reach_m + 0.2);
        if Scene::of(&world).clearance_m(center) < reach_m + 0.1 {
            continue;
        }
        let pose = Pose::new(center.x, center.y, dice.angle());
        let corners = [(-half_x, -half_y), (half_x, -half_y), (half_x, half_y), (-half_x, half_y)];
        world.polygons.push(solid(&corners.map(|(x, y)| pose.parent_from_local(Point::new(x, y)))));
    }
    place_ends(dice, &mut world, 4.0)?;
    (world.polygons.len() == 4).then_some(world)
}

pub(super) fn crowd(dice: &mut Dice, split: Split) -> Option<World> {
    let mut world = square(14.0);
    place_ends(dice, &mut world, 7.0)?;
    let manners = Manners::of(split);
    for _ in 0..dice.count(14..=24) {
        let mut person = manners.person(dice);
        let count = dice.count(2..=4);
        people::add(dice, &mut world, &mut person, people::START_DISTANCE_M, |dice| {
            (0..count).map(|_| dice.point(Point::origin(), Point::new(14.0, 14.0), 0.6)).collect()
        })?;
    }
    Some(world)
}
