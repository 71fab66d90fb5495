//! Dead ends in the shape of a U between start and goal.

use super::dice::Dice;
use super::scene::{add_discs, set_ends, square, wall};
use crate::world::World;
use nav_core::geometry::{Point, Pose};
use std::ops::RangeInclusive;

/// Left free round the U, so that the robot can pass on either side, m.
const WAY_ROUND_M: f32 = 1.0;

/// The shape of a dead end, m.
pub(super) struct Shape {
    arena_m: f32,
    width_m: RangeInclusive<f32>,
    depth_m: RangeInclusive<f32>,
    /// Between the lips, where there are any.
    mouth_m: Option<f32>,
    /// The start lies this far before the mouth at most.
    before_m: f32,
    disc_max: usize,
}

pub(super) const U_TRAP: Shape = Shape {
    arena_m: 14.0,
    width_m: 2.5..=5.0,
    depth_m: 2.0..=4.5,
    mouth_m: None,
    before_m: 0.8,
    disc_max: 6,
};
pub(super) const DEEP_U: Shape = Shape {
    arena_m: 20.0,
    width_m: 2.5..=5.0,
    depth_m: 6.0..=9.0,
    mouth_m: None,
    before_m: 0.8,
    disc_max: 8,
};
pub(super) const HOOK: Shape = Shape {
    arena_m: 14.0,
    width_m: 2.8..=5.0,
    depth_m: 2.5..=4.5,
    mouth_m: Some(1.4),
    // Behind the lips.
    before_m: -0.5,
    disc_max: 4,
};

/// A dead end somewhere in the arena, turned anywhere; local x points from the mouth to the back wall.
pub(super) fn draft(dice: &mut Dice, shape: &Shape) -> Option<World> {
    let mut world = square(shape.arena_m);
    let (half_m, depth_m) = (0.5 * dice.within(shape.width_m.clone()), dice.within(shape.depth_m.clone()));
    let side_m = half_m - 0.5;
    let start = Point::new(dice.within(-shape.before_m..=depth_m - 0.5), dice.within(-side_m..=side_m));
    let goal = Point::new(depth_m + dice.within(1.2..=2.5), dice.within(-0.6 * half_m..=0.6 * half_m));
    let corners = [(0.0, -half_m), (depth_m, -half_m), (depth_m, half_m), (0.0, half_m)];
    let corners = corners.map(|(x, y)| Point::new(x, y));

    let center = dice.point(world.bounds.min, world.bounds.max, WAY_ROUND_M);
    let mouth = Pose::new(center.x, center.y, dice.angle());
    let place = |local: Point| mouth.parent_from_local(local);
    let fits = |local: Point, room_m: f32| {
        let at = place(local);
        at.x.min(at.y) >= room_m && at.x.max(at.y) <= shape.arena_m - room_m
    };
    if !corners.iter().all(|&corner| fits(corner, WAY_ROUND_M)) || !fits(goal, 0.6) || !fits(start, 0.5) {
        return None;
    }
    world.segments.extend(corners.windows(2).map(|pair| wall(place(pair[0]), place(pair[1]))));
    if let Some(mouth_m) = shape.mouth_m {
        let low = dice.within(-half_m..=half_m - mouth_m);
        for (from, to) in [(-half_m, low), (low + mouth_m, half_m)] {
            if to - from > 0.05 {
                world.segments.push(wall(place(Point::new(0.0, from)), place(Point::new(0.0, to))));
            }
        }
    }
    let (start, goal) = (place(start), place(goal));
    let count = dice.count(2..=shape.disc_max);
    add_discs(dice, &mut world, count, 0.2..=0.45, 0.7, &[(start, 0.6), (goal, 0.6)]);
    set_ends(dice, &mut world, start, goal);
    Some(world)
}
