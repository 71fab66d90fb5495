//! The upper bound: a planner that knows the static map, with a follower. It does not know the people.
//!
//! The path lies in the map's frame and is followed by the localised pose: odometry, corrected as far as a localiser
//! says. Metres of the constants are those of the reference robot ([`nav_core::scale`]).

use nav_core::geometry::{Point, Pose};
use nav_core::messages::CmdVel;
use nav_core::scale::Scale;
use nav_core::shield::{MARGIN_M, Shield};
use nav_core::task::{ShieldMode, Task};
use nav_core::tick::{Inputs, Tick, TickStatus};
use nav_env::robot::Driver;
use nav_env::worlds::Place;
use nav_sim::obstacles::Obstacles;
use nav_sim::world::World;
use pathfinding::directed::{astar::astar, dijkstra::dijkstra};
use std::sync::Arc;

use crate::follow::Follower;

/// Side of a planning cell, m.
const CELL_M: f32 = 0.1;
/// Kept to obstacles beyond the circle that the robot turns in where there is room, m.
const COMFORT_M: f32 = 0.2;
/// The follower aims this far ahead on the path at most, m: nearer where the straight way there cuts a corner.
const LOOKAHEAD_M: f32 = 0.9;
/// Beside the footprint, m: nearer is blocked. A rectangle needs half of its width, and to turn more than that.
const BESIDE_M: f32 = 0.02;
/// Off things that a corner may be cut by, m beyond what blocks a cell: room for the safety gate, which stops the robot
/// before it touches.
const CUT_M: f32 = 0.12;
/// Cost of a straight step where there is room, and what is added next to things.
const COST: (u32, f32) = (10, 40.0);
/// The same where the safety gate keeps a small robot from going ([`CLOSE_M`]): only where there is no other way.
const SQUEEZED: u32 = 500;

/// Nearer than this the safety gate may take a thing to be in the way, m: its own margin, and three standard deviations of a
/// usual lidar's noise. It is not less for a small robot, whose worlds have narrower gaps.
const CLOSE_M: f32 = MARGIN_M + 0.09;

/// Which search finds the path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Search {
    /// A* with the octile distance.
    AStar,
    /// Dijkstra's algorithm.
    Dijkstra,
}

/// Plans once an episode, then follows.
pub struct KnownMapPlanner {
    search: Search,
    task: Task,
    follower: Follower,
    /// What is left of the path, map frame.
    path: Vec<Point>,
    grid: Option<Grid>,
    world: Option<Arc<World>>,
    map_from_odom: Pose,
}

impl KnownMapPlanner {
    /// A planner for a task.
    pub fn new(search: Search, task: &Task) -> Self {
        Self {
            search,
            task: *task,
            follower: Follower::new(task),
            path: Vec::new(),
            grid: None,
            world: None,
            map_from_odom: Pose::default(),
        }
    }

    /// What to drive at, `odom` frame.
    fn target(&mut self) -> Point {
        let position = self.map_from_odom.parent_from_local(self.follower.navigator.pose().position());
        let nearest = |path: &[Point]| {
            let distance = |index: &usize| (path[*index] - position).norm();
            (0..path.len()).min_by(|a, b| distance(a).total_cmp(&distance(b)))
        };
        // What lies behind is never aimed at again.
        if let Some(index) = nearest(&self.path[..self.path.len().min(30)]) {
            self.path.drain(..index);
        }
        let ahead = self.grid.as_ref().and_then(|grid| grid.aim(position, &self.path));
        ahead.map_or_else(
            || self.follower.navigator.goal(),
            |point| self.map_from_odom.local_from_parent(point),
        )
    }
}

impl Driver for KnownMapPlanner {
    fn begin(&mut self, place: &Place) {
        self.world = Some(place.world.clone());
    }

    fn localise(&mut self, map_from_odom: Pose) {
        self.map_from_odom = map_from_odom;
    }

    fn shield(&self) -> Option<&Shield> {
        self.follower.shield()
    }
}

impl Tick for KnownMapPlanner {
    fn tick(&mut self, now_ns: u64, inputs: Inputs<'_>) -> (CmdVel, TickStatus) {
        self.follower.observe(&inputs);
        if let Some(world) = self.world.take() {
            let grid = Grid::new(&world, &self.task);
            self.path = grid.path(self.search, world.start.position(), world.goal);
            self.grid = Some(grid);
        }
        let target = self.target();
        self.follower.towards(now_ns, &inputs, target)
    }

    fn task(&self) -> &Task {
        &self.task
    }
}

/// Costs of the cells of a world.
struct Grid {
    scale: Scale,
    /// From half of the robot's width to the circle that it turns in, m.
    corner_m: f32,
    /// Kept to obstacles where there is room, beyond half of its width, m.
    comfort_m: f32,
    cell_m: f32,
    origin: Point,
    columns: i32,
    rows: i32,
    /// 0 blocked, else the cost of a straight step through the cell.
    cost: Vec<u32>,
}

type Cell = (i32, i32);

/// Room for the safety gate and for a lidar that errs, m: not smaller for a small robot.
fn at_least(scale: &Scale, reference_m: f32) -> f32 {
    scale.m(reference_m).max(reference_m)
}

/// Up to five times as dear within the comfort distance.
fn cost_at(free_m: f32, comfort_m: f32) -> u32 {
    let near = (1.0 - free_m / comfort_m).clamp(0.0, 1.0);
    COST.0 + (COST.1 * near) as u32
}

impl Grid {
    fn new(world: &World, task: &Task) -> Self {
        let obstacles = Obstacles::new(world);
        let size = world.bounds.max - world.bounds.min;
        let scale = task.scale();
        let footprint = &task.robot.footprint;
        let corner_m = footprint.circumradius_m() - footprint.half_width_m();
        let (cell_m, comfort_m) = (scale.m(CELL_M), at_least(&scale, COMFORT_M) + corner_m);
        let (columns, rows) = ((size.x / cell_m).ceil() as i32, (size.y / cell_m).ceil() as i32);
        let origin = world.bounds.min;
        let mut grid = Self { scale, corner_m, comfort_m, cell_m, origin, columns, rows, cost: Vec::new() };
        let squeeze_m = match task.shield {
            ShieldMode::On => at_least(&scale, CLOSE_M) - scale.m(CLOSE_M),
            ShieldMode::Off => 0.0,
        };
        let radius_m = footprint.half_width_m() + scale.m(BESIDE_M) + squeeze_m;
        for row in 0..rows {
            for column in 0..columns {
                let free_m =
                    obstacles.distance_m(grid.center((column, row)), radius_m + comfort_m) - radius_m;
                grid.cost.push(match free_m {
                    _ if free_m >= 0.0 => cost_at(free_m, comfort_m),
                    _ if free_m >= -squeeze_m => SQUEEZED,
                    _ => 0,
                });
            }
        }
        grid
    }

    fn center(&self, cell: Cell) -> Point {
        Point::new(
            self.origin.x + (cell.0 as f32 + 0.5) * self.cell_m,
            self.origin.y + (cell.1 as f32 + 0.5) * self.cell_m,
        )
    }

    fn cell(&self, point: Point) -> Cell {
        let at = (point - self.origin) / self.cell_m;
        (at.x.floor() as i32, at.y.floor() as i32)
    }

    fn cost(&self, cell: Cell) -> u32 {
        let inside = (0..self.columns).contains(&cell.0) && (0..self.rows).contains(&cell.1);
        if inside { self.cost[(cell.1 * self.columns + cell.0) as usize] } else { 0 }
    }

    /// The farthest point of a path within [`LOOKAHEAD_M`] to which the straight way from a place leads nowhere nearer to
    /// things than the path does or [`CUT_M`] allows; none at its end.
    fn aim(&self, from: Point, path: &[Point]) -> Option<Point> {
        let dear = |point: Point| match self.cost(self.cell(point)) {
            0 => u32::MAX,
            cost => cost,
        };
        let cut_m = at_least(&self.scale, CUT_M) + self.corner_m;
        let mut dearest = dear(from).max(cost_at(cut_m, self.comfort_m));
        let mut aim = None;
        for &point in path {
            let way = point - from;
            dearest = dearest.max(dear(point));
            let steps = (way.norm() / (0.5 * self.cell_m)).ceil().max(1.0);
            let cuts_a_corner =
                (1..steps as u32).any(|step| dear(from + way * (step as f32 / steps)) > dearest);
            if aim.is_some() && (cuts_a_corner || way.norm() > self.scale.m(LOOKAHEAD_M)) {
                return aim;
            }
            aim = Some(point);
        }
        // The goal lies within reach.
        None
    }

    fn neighbours(&self, cell: Cell) -> Vec<(Cell, u32)> {
        let mut found = Vec::with_capacity(8);
        for (dx, dy) in [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)] {
            let next = (cell.0 + dx, cell.1 + dy);
            let cost = self.cost(next);
            if cost > 0 {
                found.push((next, if dx != 0 && dy != 0 { cost * 14 } else { cost * 10 }));
            }
        }
        found
    }

    /// Cell centres from start to goal; empty when there is no path.
    fn path(&self, search: Search, start: Point, goal: Point) -> Vec<Point> {
        let (start, goal) = (self.cell(start), self.cell(goal));
        let octile = |cell: &Cell| {
            let (dx, dy) = (cell.0.abs_diff(goal.0), cell.1.abs_diff(goal.1));
            100 * dx.max(dy) + 40 * dx.min(dy)
        };
        let found = match search {
            Search::AStar => astar(&start, |cell| self.neighbours(*cell), octile, |cell| *cell == goal),
            Search::Dijkstra => dijkstra(&start, |cell| self.neighbours(*cell), |cell| *cell == goal),
        };
        found.map_or_else(Vec::new, |(cells, _)| cells.into_iter().map(|cell| self.center(cell)).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nav_sim::families::{Family, Split, generate};

    #[test]
    fn both_searches_agree_on_the_cost_and_connect_start_and_goal() {
        for seed in 0..5 {
            let world = generate(Family::Maze, Split::Validation, seed);
            let grid = Grid::new(&world, &Task::default());
            let paths = [Search::AStar, Search::Dijkstra]
                .map(|search| grid.path(search, world.start.position(), world.goal));
            let length = |path: &[Point]| path.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum::<f32>();
            for path in &paths {
                assert!((path[0] - world.start.position()).norm() < CELL_M);
                assert!((path[path.len() - 1] - world.goal).norm() < CELL_M);
            }
            assert!((length(&paths[0]) - length(&paths[1])).abs() < 1.0, "same cost, nearly the same way");
        }
    }
}
