//! Narrow places: walls with gaps, pillars, bent corridors, small mazes.

use super::dice::Dice;
use super::maze;
use super::scene::{add_discs, place_ends, set_ends, solid, square, wall};
use crate::world::{Bounds, World};
use nav_core::geometry::{Point, Vector};
use std::f32::consts::FRAC_PI_2;

/// The narrowest gap in a wall and the narrowest corridor, m; pillars may stand closer.
const NARROWEST_M: f32 = 0.72;

pub(super) fn draft(dice: &mut Dice) -> Option<World> {
    match dice.count(0..=3) {
        0 => gaps(dice),
        1 => pillars(dice),
        2 => bend(dice),
        _ => {
            let cell_m = dice.within(0.8..=1.2);
            let shape = maze::Shape { cells: dice.count(5..=7), cell_m, braided: 0.3, apart_m: 3.1 };
            maze::draft(dice, &shape)
        }
    }
}

/// Two or three thick, slanted walls across the arena, each with one or two gaps.
fn gaps(dice: &mut Dice) -> Option<World> {
    const SIDE_M: f32 = 8.0;
    let mut world = square(SIDE_M);
    let walls = dice.count(2..=3);
    let is_upright = dice.chance(0.5);
    let place = |across: f32, along: f32| {
        if is_upright { Point::new(across, along) } else { Point::new(along, across) }
    };
    for index in 1..=walls {
        let middle_m = SIDE_M * index as f32 / (walls + 1) as f32 + dice.within(-0.15..=0.15);
        let slant = dice.within(-0.12..=0.12);
        let half_m = 0.5 * dice.within(0.1..=0.5);
        let mut cuts = vec![0.0];
        let mut from_m = dice.within(0.0..=0.55 * SIDE_M);
        for _ in 0..dice.count(1..=2) {
            let to_m = from_m + dice.within(NARROWEST_M..=1.1);
            if to_m < SIDE_M {
                cuts.extend([from_m, to_m]);
            }
            from_m = to_m + dice.within(0.8..=2.0);
        }
        cuts.push(SIDE_M);
        for piece in cuts.chunks_exact(2).filter(|piece| piece[1] - piece[0] > 0.05) {
            let across = |along_m: f32| middle_m + slant * (along_m - 0.5 * SIDE_M);
            world.polygons.push(solid(&[
                place(across(piece[0]) - half_m, piece[0]),
                place(across(piece[0]) + half_m, piece[0]),
                place(across(piece[1]) + half_m, piece[1]),
                place(across(piece[1]) - half_m, piece[1]),
            ]));
        }
    }
    place_ends(dice, &mut world, 3.5)?;
    Some(world)
}

/// Round pillars, as many as fit with a gap the robot just passes.
fn pillars(dice: &mut Dice) -> Option<World> {
    let mut world = square(6.0);
    let gap_m = dice.within(0.6..=0.8);
    let largest_m = dice.within(0.2..=0.5);
    add_discs(dice, &mut world, 30, 0.12..=largest_m, gap_m, &[]);
    place_ends(dice, &mut world, 3.5)?;
    Some(world)
}

/// A corridor with three to five bends.
fn bend(dice: &mut Dice) -> Option<World> {
    let width_m = dice.within(NARROWEST_M..=1.2);
    // Headings stay within a half turn, so that the corridor cannot meet itself.
    let turned = dice.angle();
    let mut heading = dice.within(-0.8 * FRAC_PI_2..=0.8 * FRAC_PI_2);
    let mut joints = vec![Point::origin()];
    for _ in 0..dice.count(3..=5) {
        let direction = Vector::new(libm::cosf(turned + heading), libm::sinf(turned + heading));
        joints.push(joints[joints.len() - 1] + direction * (dice.within(0.8..=1.8) + width_m));
        let bend = dice.within(0.6..=1.6) * if heading > 0.0 { -1.0 } else { 1.0 };
        heading = (heading + bend).clamp(-0.9 * FRAC_PI_2, 0.9 * FRAC_PI_2);
    }
    let sides = [0.5, -0.5].map(|share| offset(&joints, share * width_m));
    let (min, max) = sides
        .iter()
        .flatten()
        .fold((joints[0], joints[0]), |(min, max), point| (min.inf(point), max.sup(point)));
    let shift = Vector::repeat(0.8) - min.coords;
    let mut world = square(1.0);
    world.bounds = Bounds { min: Point::origin(), max: max + shift + Vector::repeat(0.8) };
    for side in &sides {
        world.segments.extend(side.windows(2).map(|pair| wall(pair[0] + shift, pair[1] + shift)));
    }
    if dice.chance(0.5) {
        world.segments.push(wall(sides[0][0] + shift, sides[1][0] + shift));
    }
    let last = joints.len() - 1;
    let inwards = |from: Point, to: Point| from + (to - from).normalize() * 0.45 + shift;
    let (start, goal) = (inwards(joints[0], joints[1]), inwards(joints[last], joints[last - 1]));
    let (start, goal) = if dice.chance(0.5) { (start, goal) } else { (goal, start) };
    set_ends(dice, &mut world, start, goal);
    ((goal - start).norm() > 3.0).then_some(world)
}

/// The line beside a polyline, to its left for a positive distance, with mitred corners.
fn offset(joints: &[Point], distance_m: f32) -> Vec<Point> {
    let normals: Vec<Vector> = joints
        .windows(2)
        .map(|pair| {
            let along = (pair[1] - pair[0]).normalize();
            Vector::new(-along.y, along.x)
        })
        .collect();
    joints
        .iter()
        .enumerate()
        .map(|(index, joint)| {
            let before = normals[index.saturating_sub(1)];
            let after = normals[index.min(normals.len() - 1)];
            let mitre = before + after;
            joint + mitre * (2.0 * distance_m / mitre.norm_squared())
        })
        .collect()
}
