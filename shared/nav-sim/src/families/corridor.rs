//! Two halls joined by a corridor in which people come towards each other; and, in [`doorway`], two rooms and the one
//! door between them.

use super::dice::Dice;
use super::pedestrians::{add_companion, add_standing, add_walking, group_size};
use super::scene::{Turn, set_ends, square};
use crate::world::{Stop, World};
use nav_core::geometry::Point;

/// The part of a scene that everybody must pass, along x, and the rooms on both sides of it.
struct Narrow {
    side_m: f32,
    /// Where it begins and ends, m.
    from_m: f32,
    to_m: f32,
    /// Its middle and width, m.
    y_m: f32,
    width_m: f32,
    turn: Turn,
}

/// A corridor of 2.4-3.4 m by 9 m between two halls.
pub(super) fn corridor(dice: &mut Dice) -> Option<World> {
    let side_m = 16.0;
    let narrow = Narrow {
        side_m,
        from_m: 3.5,
        to_m: 12.5,
        y_m: dice.within(4.0..=12.0),
        width_m: dice.within(2.4..=3.4),
        turn: Turn::drawn(dice, side_m),
    };
    let mut world = narrow.world(dice);
    // Two in conversation at the wall.
    if dice.chance(0.4) {
        let wall_m = (0.5 * narrow.width_m - 0.42) * if dice.chance(0.5) { 1.0 } else { -1.0 };
        let x_m = dice.within(6.0..=10.0);
        let (middle, end) = (narrow.place(x_m, wall_m), narrow.place(x_m + 1.0, wall_m));
        let along = end - middle;
        add_standing(dice, &mut world, 2, middle, libm::atan2f(along.y, along.x));
    }
    narrow.populate(dice, &mut world, 3..=6, 0.25)?;
    Some(world)
}

/// Two rooms and a door of 1.3-1.8 m between them; some stop in it.
pub(super) fn doorway(dice: &mut Dice) -> Option<World> {
    let side_m = 12.0;
    let narrow = Narrow {
        side_m,
        from_m: 5.9,
        to_m: 6.1,
        y_m: dice.within(2.5..=9.5),
        width_m: dice.within(1.3..=1.8),
        turn: Turn::drawn(dice, side_m),
    };
    let mut world = narrow.world(dice);
    narrow.populate(dice, &mut world, 3..=5, 0.4)?;
    Some(world)
}

impl Narrow {
    /// A point by its x and its distance from the middle line.
    fn place(&self, x_m: f32, off_m: f32) -> Point {
        self.turn.place(x_m, self.y_m + off_m)
    }

    /// Walls, start and goal.
    fn world(&self, dice: &mut Dice) -> World {
        let mut world = square(self.side_m);
        let half_m = 0.5 * self.width_m;
        let (below, above) = (self.y_m - half_m, self.y_m + half_m);
        world.polygons.push(self.turn.block((self.from_m, 0.0), (self.to_m, below)));
        world.polygons.push(self.turn.block((self.from_m, above), (self.to_m, self.side_m)));
        let start = self.place(dice.within(0.6..=2.2), dice.within(-2.0..=2.0));
        let goal = self.place(self.side_m - dice.within(0.6..=2.2), dice.within(-2.0..=2.0));
        set_ends(dice, &mut world, start, goal);
        world
    }

    /// Groups that go there and back, of whom a share of the single ones stop half-way; a group that stands in one of the
    /// rooms; now and then somebody who keeps the robot company.
    fn populate(
        &self,
        dice: &mut Dice,
        world: &mut World,
        groups: std::ops::RangeInclusive<usize>,
        stopping: f64,
    ) -> Option<()> {
        if dice.chance(0.5) {
            let size = dice.count(2..=5);
            let x_m = if dice.chance(0.5) { 0.5 * self.from_m } else { 0.5 * (self.to_m + self.side_m) };
            let off_m = dice.within(2.2..=4.0) * if self.y_m > 0.5 * self.side_m { -1.0 } else { 1.0 };
            let (middle, angle_rad) = (self.place(x_m, off_m), dice.angle());
            add_standing(dice, world, size, middle, angle_rad);
        }
        for _ in 0..dice.count(groups) {
            let size = group_size(dice);
            let stops = size == 1 && dice.chance(stopping);
            let first = world.people.len();
            add_walking(dice, world, size, |dice| self.round(dice))?;
            if stops {
                let half_way = self.half_way(&world.people[first].waypoints);
                let seconds = [2.0, 8.0];
                world.people[first].stop = Some(Stop { waypoint: half_way, seconds, turns_round: 0.3 });
            }
        }
        if dice.chance(0.15) {
            add_companion(dice, world);
        }
        Some(())
    }

    /// There on the right, back on the left of it; most keep to the right of their own way.
    fn round(&self, dice: &mut Dice) -> Vec<Point> {
        let side = if dice.chance(0.8) { -1.0 } else { 1.0 };
        let room_m = 0.5 * self.width_m - 0.4;
        let mut lane = |sign: f32| sign * side * room_m * dice.within(0.2..=1.0);
        let (there_m, back_m) = (lane(1.0), lane(-1.0));
        let far = |dice: &mut Dice, from: f32, to: f32| {
            let y_m = self.y_m + dice.within(-3.5..=3.5);
            let clear_m = y_m.clamp(0.7, self.side_m - 0.7);
            (dice.within(from + 0.7..=to - 1.0), clear_m - self.y_m)
        };
        let (near, beyond) = (far(dice, 0.0, self.from_m), far(dice, self.to_m + 0.3, self.side_m + 0.3));
        let (before_m, after_m) = (self.from_m - 0.6, self.to_m + 0.6);
        let middle_m = 0.5 * (self.from_m + self.to_m);
        [
            near,
            (before_m, there_m),
            (middle_m, there_m),
            (after_m, there_m),
            beyond,
            (after_m, back_m),
            (middle_m, back_m),
            (before_m, back_m),
        ]
        .map(|(x_m, off_m)| self.place(x_m, off_m))
        .to_vec()
    }

    /// The first of the waypoints in the middle of it.
    fn half_way(&self, waypoints: &[Point]) -> usize {
        let middle = self.place(0.5 * (self.from_m + self.to_m), 0.0);
        let distance = |index: &usize| (waypoints[*index] - middle).norm();
        (0..waypoints.len()).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(0)
    }
}
