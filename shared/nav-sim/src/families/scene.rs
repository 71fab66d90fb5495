//! Placing things in a world that is being made.

use super::DESIGN_RADIUS_M;
use super::dice::Dice;
use crate::geodesic::is_leg_free;
use crate::obstacles::Obstacles;
use crate::world::{Bounds, Disc, Polygon, Segment, World};
use nav_core::geometry::{Point, Pose};

/// Start and goal keep at least this much off every obstacle, m of the reference robot, as all lengths here.
pub(super) const GOAL_CLEARANCE_M: f32 = DESIGN_RADIUS_M + 0.15;
/// Clearances beyond this are not told apart, m.
const CLEARANCE_CAP_M: f32 = 2.0;
/// How often a placement is tried before the whole draft is given up.
const TRIES: usize = 60;

/// An empty square of `side_m` whose lower left corner is the origin.
pub(super) fn square(side_m: f32) -> World {
    World {
        name: String::new(),
        bounds: Bounds { min: Point::origin(), max: Point::new(side_m, side_m) },
        discs: Vec::new(),
        segments: Vec::new(),
        polygons: Vec::new(),
        people: Vec::new(),
        start: Pose::default(),
        goal: Point::origin(),
    }
}

/// A wall between two points.
pub(super) fn wall(a: Point, b: Point) -> Segment {
    Segment { a, b }
}

/// A solid with the given corners.
pub(super) fn solid(corners: &[Point]) -> Polygon {
    Polygon { vertices: corners.to_vec() }
}

/// A straight wall from `a` to `b` with gaps, each from and to a share of its length, in order.
pub(super) fn wall_with_gaps(a: Point, b: Point, gaps: &[(f32, f32)]) -> Vec<Segment> {
    let starts = std::iter::once(0.0).chain(gaps.iter().map(|gap| gap.1));
    let ends = gaps.iter().map(|gap| gap.0).chain(std::iter::once(1.0));
    starts
        .zip(ends)
        .filter(|(from, to)| to - from > 1e-4)
        .map(|(from, to)| wall(a + (b - a) * from, a + (b - a) * to))
        .collect()
}

/// Adds up to `count` discs that keep `gap_m` off every obstacle and off the listed (point, distance) pairs.
pub(super) fn add_discs(
    dice: &mut Dice,
    world: &mut World,
    count: usize,
    radius_m: std::ops::RangeInclusive<f32>,
    gap_m: f32,
    keep_off: &[(Point, f32)],
) {
    let scene = Scene::of(world);
    let old = world.discs.len();
    for _ in 0..TRIES * count {
        if world.discs.len() - old == count {
            break;
        }
        let radius_m = dice.within(radius_m.clone());
        let center = dice.point(world.bounds.min, world.bounds.max, radius_m);
        let room_m = world.discs[old..]
            .iter()
            .map(|disc| (disc.center - center).norm() - disc.radius_m)
            .fold(scene.clearance_m(center), f32::min);
        let is_off =
            keep_off.iter().all(|(point, distance_m)| (point - center).norm() >= distance_m + radius_m);
        if room_m >= radius_m + gap_m && is_off {
            world.discs.push(Disc { center, radius_m });
        }
    }
}

/// Places start and goal anywhere free, at least `apart_m` from each other; the robot looks anywhere.
pub(super) fn place_ends(dice: &mut Dice, world: &mut World, apart_m: f32) -> Option<()> {
    let scene = Scene::of(world);
    let (min, max) = (world.bounds.min, world.bounds.max);
    (0..TRIES).find_map(|_| {
        let start = scene.free_point(dice, min, max)?;
        let goal = scene.free_point(dice, min, max)?;
        ((goal - start).norm() >= apart_m).then(|| set_ends(dice, world, start, goal))
    })
}

/// Sets start and goal; the robot looks anywhere.
pub(super) fn set_ends(dice: &mut Dice, world: &mut World, start: Point, goal: Point) {
    world.start = Pose::new(start.x, start.y, dice.angle());
    world.goal = goal;
}

/// One of the eight ways to lay a square on itself.
pub(super) struct Turn {
    side_m: f32,
    quarter_turns: usize,
    is_mirrored: bool,
}

impl Turn {
    /// Any of them, for a square of a side, m.
    pub(super) fn drawn(dice: &mut Dice, side_m: f32) -> Self {
        Self { side_m, quarter_turns: dice.count(0..=3), is_mirrored: dice.chance(0.5) }
    }

    /// Where a point comes to lie.
    pub(super) fn place(&self, x: f32, y: f32) -> Point {
        let y = if self.is_mirrored { self.side_m - y } else { y };
        (0..self.quarter_turns).fold(Point::new(x, y), |point, _| Point::new(self.side_m - point.y, point.x))
    }

    /// A solid rectangle, from one corner to the other.
    pub(super) fn block(&self, (left, bottom): (f32, f32), (right, top): (f32, f32)) -> Polygon {
        let corners = [(left, bottom), (right, bottom), (right, top), (left, top)];
        solid(&corners.map(|(x, y)| self.place(x, y)))
    }
}

/// The static obstacles of a draft.
pub(super) struct Scene(Obstacles);

impl Scene {
    /// The obstacles that a world has now.
    pub(super) fn of(world: &World) -> Self {
        Self(Obstacles::new(world))
    }

    /// Distance to the nearest obstacle, m; negative inside one.
    pub(super) fn clearance_m(&self, point: Point) -> f32 {
        self.0.distance_m(point, CLEARANCE_CAP_M)
    }

    /// A point of a rectangle with room for start or goal.
    pub(super) fn free_point(&self, dice: &mut Dice, min: Point, max: Point) -> Option<Point> {
        (0..TRIES)
            .map(|_| dice.point(min, max, 0.0))
            .find(|&point| self.clearance_m(point) >= GOAL_CLEARANCE_M)
    }

    /// Whether a disc of `radius_m` can go straight from `a` to `b`.
    pub(super) fn is_leg_free(&self, a: Point, b: Point, radius_m: f32) -> bool {
        is_leg_free(&self.0, a, b, radius_m)
    }
}
