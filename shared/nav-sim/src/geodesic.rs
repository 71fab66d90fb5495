//! Shortest distances to a goal round the static obstacles: path check, reward shaping, SPL, reference planners.
//!
//! The obstacles, inflated by the footprint and [`PATH_MARGIN_M`], are drawn onto a grid of half its radius. The
//! eikonal equation |∇d| = 1 is then solved on the free cells (Sethian 1996), so that distances are those of
//! any-angle paths, not of staircases. They come out up to 3 % too long in open space and 4 % round corners;
//! a path from [`GeodesicField::path`] is within 2 % of the shortest, and its length is what to score against.
//!
//! A world of more than 820 m square gets larger cells: there, narrow ways may be taken for closed.

mod raster;
mod march;

use crate::obstacles::Obstacles;
use crate::world::World;
use nav_core::footprint::Footprint;
use nav_core::geometry::Point;
use nav_core::scale::REFERENCE_RADIUS_M;
use raster::{Class, Raster};

/// Kept between a footprint and every static obstacle on a path, m of the reference robot ([`nav_core::scale`]).
pub const PATH_MARGIN_M: f32 = 0.05;
/// Cells round the goal within this distance (and nothing in between) get their exact distance, m of the reference
/// robot.
const EXACT_MAX_M: f32 = 1.5;
/// How often a path is straightened before the last time; even, because each turns it round.
const STRAIGHTENINGS: usize = 4;
/// [`is_leg_free`] looks this far ahead at a time, m.
const LEG_STEP_MAX_M: f32 = 2.0;

/// The distance to one goal from everywhere in a world, for one footprint. A rectangle is taken for a disc of half its width,
/// which passes wherever it can: no way is shorter, and one that is found here may lead round a bend that is too tight for it.
#[derive(Clone, Debug)]
pub struct GeodesicField {
    goal: Point,
    raster: Raster,
    /// Of every cell, m; infinite where no path leads to the goal.
    distances_m: Vec<f32>,
    /// Within this distance of the goal nothing stands between a point and the goal, m.
    exact_m: f32,
}

impl GeodesicField {
    /// The field of a world's goal. People are ignored.
    pub fn new(world: &World, footprint: &Footprint) -> Self {
        Self::towards(world, world.goal, footprint)
    }

    /// The field of any goal in a world.
    pub fn towards(world: &World, goal: Point, footprint: &Footprint) -> Self {
        let robot_radius_m = footprint.half_width_m();
        let exact_max_m = EXACT_MAX_M * (robot_radius_m / REFERENCE_RADIUS_M);
        let clearance_m = Obstacles::new(world).distance_m(goal, exact_max_m);
        Self::with_clearance(world, goal, clearance_m, robot_radius_m)
    }

    /// The field of a goal whose distance to the nearest obstacle is known.
    pub(crate) fn with_clearance(world: &World, goal: Point, clearance_m: f32, robot_radius_m: f32) -> Self {
        let length = robot_radius_m / REFERENCE_RADIUS_M;
        let raster = Raster::new(world, robot_radius_m, PATH_MARGIN_M * length);
        let exact_m = clearance_m.clamp(0.0, EXACT_MAX_M * length);
        let seeds = raster
            .cells_near(goal, exact_m)
            .filter(|&(cell, _)| raster.class(cell) == Class::Free)
            .collect::<Vec<_>>();
        let distances_m = march::distances_m(&raster, &seeds);
        Self { goal, raster, distances_m, exact_m }
    }

    /// In a world so large that its cells are larger than elsewhere: ways narrower than this may be taken for closed, m.
    pub(crate) fn surely_seen_m(&self) -> Option<f32> {
        self.raster.surely_seen_m()
    }

    /// Length of the shortest path from a point to the goal, m. `None` where there is none: inside an obstacle,
    /// or where the footprint and its margin do not pass. Between grid points the value is interpolated.
    pub fn distance_m(&self, from: Point) -> Option<f32> {
        let straight_m = (from - self.goal).norm();
        if straight_m < self.exact_m && self.exact_m > self.raster.cell_m {
            return Some(straight_m);
        }
        let (mut sum_m, mut weights) = (0.0, 0.0);
        for (cell, weight) in self.raster.corners(from)? {
            let distance_m = self.distances_m[cell];
            if distance_m.is_finite() {
                sum_m += weight * distance_m;
                weights += weight;
            }
        }
        (weights > 1e-3).then(|| (sum_m / weights).max(straight_m))
    }

    /// Waypoints of a shortest path, from `from` to the goal, both included; straight lines join them.
    pub fn path(&self, from: Point) -> Option<Vec<Point>> {
        let corners = self.raster.corners(from)?;
        let (mut cell, _) = corners
            .into_iter()
            .filter(|&(cell, _)| self.distances_m[cell].is_finite())
            .max_by(|a, b| a.1.total_cmp(&b.1))?;
        let mut steps = vec![from];
        while (self.raster.center(cell) - self.goal).norm() > self.exact_m {
            steps.push(self.raster.center(cell));
            let Some(next) = self.downhill(cell) else { break };
            cell = next;
        }
        steps.push(self.goal);
        // One pass leaves detours to where the steps happened to lead; from both ends by turns they vanish.
        for _ in 0..STRAIGHTENINGS {
            steps = self.straightened(&steps);
            steps.reverse();
            steps = self.subdivided(&steps);
        }
        Some(self.straightened(&steps))
    }

    /// The same line with points no farther apart than a cell.
    fn subdivided(&self, path: &[Point]) -> Vec<Point> {
        let mut steps = vec![path[0]];
        for pair in path.windows(2) {
            let pieces = ((pair[1] - pair[0]).norm() / self.raster.cell_m).ceil().max(1.0);
            let piece = (pair[1] - pair[0]) / pieces;
            steps.extend((0..pieces as usize).rev().map(|left| pair[1] - piece * left as f32));
        }
        steps
    }

    /// Length of [`Self::path`], m: slower than [`Self::distance_m`] and closer to the truth.
    pub fn path_length_m(&self, from: Point) -> Option<f32> {
        Some(self.path(from)?.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum())
    }

    /// The neighbour nearest to the goal, if it is nearer than the cell itself.
    fn downhill(&self, cell: usize) -> Option<usize> {
        let next = self
            .raster
            .neighbours(cell)
            .into_iter()
            .filter(|&(next, sides)| {
                let class = self.raster.class(next);
                self.distances_m[next].is_finite()
                    && class >= self.raster.class(cell)
                    && sides.into_iter().all(|side| self.raster.class(side) >= class.min(Class::Near))
            })
            .map(|(next, _)| next)
            .min_by(|&a, &b| self.distances_m[a].total_cmp(&self.distances_m[b]))?;
        (self.distances_m[next] < self.distances_m[cell]).then_some(next)
    }

    /// Drops every waypoint that the one before can see past.
    fn straightened(&self, steps: &[Point]) -> Vec<Point> {
        let mut path = vec![steps[0]];
        let mut at = 0;
        while at + 1 < steps.len() {
            let far = (at + 2..steps.len()).take_while(|&to| self.is_straight(steps[at], steps[to])).last();
            at = far.unwrap_or(at + 1);
            path.push(steps[at]);
        }
        path
    }

    fn is_straight(&self, from: Point, to: Point) -> bool {
        let samples = (2.0 * (to - from).norm() / self.raster.cell_m).ceil().max(1.0);
        (1..=samples as usize).all(|sample| {
            let at = from + (to - from) * (sample as f32 / samples);
            (at - self.goal).norm() <= self.exact_m
                || self.raster.cell(at).is_some_and(|cell| self.raster.class(cell) == Class::Free)
        })
    }
}

/// Whether a disc can go straight from `a` to `b`.
pub(crate) fn is_leg_free(obstacles: &Obstacles, a: Point, b: Point, radius_m: f32) -> bool {
    let length_m = (b - a).norm();
    let mut gone_m = 0.0;
    loop {
        let at = if length_m > 0.0 { a + (b - a) * (gone_m / length_m) } else { a };
        let room_m = obstacles.distance_m(at, radius_m + LEG_STEP_MAX_M) - radius_m;
        if room_m < 0.0 {
            return false;
        }
        if gone_m >= length_m {
            return true;
        }
        // Nothing can be nearer than the clearance; a millimetre keeps a graze from taking for ever.
        gone_m = (gone_m + room_m.max(1e-3)).min(length_m);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::{Bounds, Segment};
    use nav_core::geometry::Pose;
    use proptest::prelude::*;

    const ROBOT: Footprint = Footprint::circle(0.2);

    fn room(side_m: f32, segments: Vec<Segment>, goal: Point) -> World {
        World {
            name: "test".into(),
            bounds: Bounds { min: Point::origin(), max: Point::new(side_m, side_m) },
            discs: Vec::new(),
            segments,
            polygons: Vec::new(),
            people: Vec::new(),
            start: Pose::new(1.0, 1.0, 0.0),
            goal,
        }
    }

    fn wall(ax: f32, ay: f32, bx: f32, by: f32) -> Segment {
        Segment { a: Point::new(ax, ay), b: Point::new(bx, by) }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn open_space_is_within_three_percent_of_straight(
            (x, y) in (0.4..13.6_f32, 0.4..13.6_f32),
            (goal_x, goal_y) in (0.4..13.6_f32, 0.4..13.6_f32),
        ) {
            let (from, goal) = (Point::new(x, y), Point::new(goal_x, goal_y));
            let field = GeodesicField::new(&room(14.0, Vec::new(), goal), &ROBOT);
            let straight_m = (from - goal).norm();
            let found_m = field.distance_m(from).expect("nothing stands in the way");
            prop_assert!(found_m >= straight_m && found_m <= 1.03 * straight_m + 0.01, "{found_m} {straight_m}");
            let path_m = field.path_length_m(from).expect("nothing stands in the way");
            prop_assert!(path_m <= 1.01 * straight_m + 0.02, "{path_m} {straight_m}");
        }

        #[test]
        fn round_a_wall_is_the_way_over_its_tip(x in 1.0..5.0_f32, y in 1.0..5.0_f32, tip in 7.0..11.0_f32) {
            let (from, goal) = (Point::new(x, y), Point::new(12.0, y));
            let field = GeodesicField::new(&room(14.0, vec![wall(7.0, 0.0, 7.0, tip)], goal), &ROBOT);
            // Tangents to the circle of 0.25 m round the tip, and the arc between them.
            let tip = Point::new(7.0, tip);
            let (first, last) = (from - tip, goal - tip);
            let tangents_rad = (0.25 / first.norm()).acos() + (0.25 / last.norm()).acos();
            let arc_rad = std::f32::consts::TAU - first.angle(&last) - tangents_rad;
            let true_m = (first.norm_squared() - 0.0625).sqrt() + (last.norm_squared() - 0.0625).sqrt() + 0.25 * arc_rad;
            let found_m = field.distance_m(from).expect("there is a way round");
            prop_assert!((found_m / true_m - 1.0).abs() < 0.04, "{found_m} {true_m}");
            let path_m = field.path_length_m(from).expect("there is a way round");
            prop_assert!((path_m / true_m - 1.0).abs() < 0.02, "{path_m} {true_m}");
        }
    }

    #[test]
    fn gaps_pass_only_a_footprint_with_its_margin() {
        let goal = Point::new(12.0, 7.0);
        for (gap_m, passes) in [(0.42, false), (0.7, true)] {
            let (low, high) = (7.0 - 0.5 * gap_m, 7.0 + 0.5 * gap_m);
            let walls = vec![wall(7.0, 0.0, 7.0, low), wall(7.0, high, 7.0, 14.0)];
            let field = GeodesicField::new(&room(14.0, walls, goal), &ROBOT);
            assert_eq!(field.distance_m(Point::new(2.0, 2.0)).is_some(), passes, "{gap_m}");
            assert_eq!(field.path(Point::new(2.0, 2.0)).is_some(), passes, "{gap_m}");
        }
    }

    /// A large world with a way along its lower side, in which a wall has a door.
    fn with_door(side_m: f32, door_m: f32) -> World {
        let x = 0.5 * side_m;
        let walls = vec![
            wall(0.0, 16.0, side_m, 16.0),
            wall(x, 0.0, x, 8.0 - 0.5 * door_m),
            wall(x, 8.0 + 0.5 * door_m, x, 16.0),
            wall(x - 20.0, 0.0, x - 20.0, 16.0),
            wall(x + 20.0, 0.0, x + 20.0, 16.0),
        ];
        room(side_m, walls, Point::new(x + 3.0, 8.0))
    }

    #[test]
    fn a_door_of_a_large_world_is_found() {
        let field = GeodesicField::new(&with_door(410.0, 0.8), &ROBOT);
        assert_eq!(field.surely_seen_m(), None);
        let found_m = field.distance_m(Point::new(202.0, 8.0)).expect("the door is wide enough");
        assert!((found_m - 6.0).abs() < 0.2, "{found_m}");
    }

    #[test]
    fn a_world_that_is_too_large_for_its_doors_says_so() {
        let field = GeodesicField::new(&with_door(1700.0, 0.56), &ROBOT);
        assert_eq!(field.distance_m(Point::new(847.0, 8.0)), None);
        assert!(field.surely_seen_m().is_some_and(|width_m| width_m > 0.56), "{:?}", field.surely_seen_m());
    }

    #[test]
    fn a_robot_against_a_wall_still_has_a_distance() {
        let field =
            GeodesicField::new(&room(14.0, vec![wall(7.0, 0.0, 7.0, 10.0)], Point::new(12.0, 2.0)), &ROBOT);
        let far = field.distance_m(Point::new(6.79, 2.0)).expect("beside the wall");
        let near = field.distance_m(Point::new(7.21, 2.0)).expect("beside the wall");
        assert!(far > 15.0 && near < 5.5, "{far} {near}");
    }
}
