//! Nine rooms with doors.

use super::dice::Dice;
use super::scene::{add_discs, place_ends, square, wall_with_gaps};
use crate::world::World;
use nav_core::geometry::Point;

const SIDE_M: f32 = 14.0;
const ROOMS: usize = 3;
/// Doors beyond those that join all rooms, as a chance for each remaining wall.
const MORE_DOORS: f64 = 0.4;

pub(super) fn draft(dice: &mut Dice) -> Option<World> {
    let mut world = square(SIDE_M);
    // Lines between the columns and between the rows, arena edges included.
    let [across, up] = [(); 2].map(|()| {
        let jitter = [dice.within(-0.6..=0.6), dice.within(-0.6..=0.6)];
        [0.0, SIDE_M / 3.0 + jitter[0], 2.0 * SIDE_M / 3.0 + jitter[1], SIDE_M]
    });
    let doors = doors(dice);
    let mut door_centers = Vec::new();
    for line in 1..ROOMS {
        for is_vertical in [true, false] {
            let (lines, cuts) = if is_vertical { (&across, &up) } else { (&up, &across) };
            let point = |along: f32| {
                if is_vertical { Point::new(lines[line], along) } else { Point::new(along, lines[line]) }
            };
            let mut gaps = Vec::new();
            for along in (0..ROOMS).filter(|&along| doors.contains(&(is_vertical, line, along))) {
                let half_m = 0.5 * dice.within(1.0..=1.4);
                let center_m = dice.within(cuts[along] + half_m + 0.4..=cuts[along + 1] - half_m - 0.4);
                gaps.push(((center_m - half_m) / SIDE_M, (center_m + half_m) / SIDE_M));
                door_centers.push((point(center_m), 1.2));
            }
            world.segments.extend(wall_with_gaps(point(0.0), point(SIDE_M), &gaps));
        }
    }
    let count = dice.count(0..=7);
    add_discs(dice, &mut world, count, 0.2..=0.45, 0.6, &door_centers);
    place_ends(dice, &mut world, 5.5)?;
    Some(world)
}

/// The walls (vertical or not, line, place along it) that have a door: all rooms are joined.
fn doors(dice: &mut Dice) -> Vec<(bool, usize, usize)> {
    let mut walls: Vec<(bool, usize, usize)> = [true, false]
        .into_iter()
        .flat_map(|is_vertical| {
            (1..ROOMS).flat_map(move |line| (0..ROOMS).map(move |along| (is_vertical, line, along)))
        })
        .collect();
    dice.shuffle(&mut walls);
    // Kruskal: a wall gets a door when it parts two groups of rooms.
    let mut groups: Vec<usize> = (0..ROOMS * ROOMS).collect();
    walls.retain(|&(is_vertical, line, along)| {
        let room = |line: usize| if is_vertical { along * ROOMS + line } else { line * ROOMS + along };
        let (from, to) = (groups[room(line - 1)], groups[room(line)]);
        groups.iter_mut().filter(|group| **group == from).for_each(|group| *group = to);
        from != to || dice.chance(MORE_DOORS)
    });
    walls
}
