//! The upper bound: a planner that knows the static map, with a follower. It does not know the people.
//!
//! The path lies in the map's frame and is followed by the localised pose: odometry, corrected as far as a localiser
//! says.

use nav_core::geometry::{Point, Pose};
use nav_core::messages::CmdVel;
use nav_core::shield::Shield;
use nav_core::task::Task;
use nav_core::tick::{Inputs, Tick, TickStatus};
use nav_env::robot::Driver;
use nav_env::searched::Searched;
use nav_env::worlds::Place;
use nav_sim::world::World;
use pathfinding::directed::{astar::astar, dijkstra::dijkstra};
use std::sync::Arc;

use crate::follow::Follower;
use crate::grid::{Cell, Grid};
use crate::meter::Meter;

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
    searched: Option<Searched>,
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
            searched: None,
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
        self.searched = None;
    }

    fn localise(&mut self, map_from_odom: Pose) {
        self.map_from_odom = map_from_odom;
    }

    fn searched(&self) -> Option<Searched> {
        self.searched
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
            let (path, searched) = grid.path(self.search, world.start.position(), world.goal);
            (self.path, self.grid, self.searched) = (path, Some(grid), Some(searched));
        }
        let target = self.target();
        self.follower.towards(now_ns, &inputs, target)
    }

    fn task(&self) -> &Task {
        &self.task
    }
}

impl Grid {
    /// Cell centres from start to goal, empty when there is no path; and what the search took.
    fn path(&self, search: Search, start: Point, goal: Point) -> (Vec<Point>, Searched) {
        let (start, goal) = (self.cell(start), self.cell(goal));
        let octile = |cell: &Cell| {
            let (dx, dy) = (cell.0.abs_diff(goal.0), cell.1.abs_diff(goal.1));
            100 * dx.max(dy) + 40 * dx.min(dy)
        };
        let mut meter = Meter::new(self.costs().len(), self.index(start));
        let neighbours = |cell: &Cell| {
            let found = self.neighbours(*cell);
            meter.expand(self.index(*cell), found.iter().map(|&(next, step)| (self.index(next), step)));
            found
        };
        let found = match search {
            Search::AStar => astar(&start, neighbours, octile, |cell| *cell == goal),
            Search::Dijkstra => dijkstra(&start, neighbours, |cell| *cell == goal),
        };
        let path = found
            .map_or_else(Vec::new, |(cells, _)| cells.into_iter().map(|cell| self.center(cell)).collect());
        (path, meter.searched(size_of_val(self.costs())))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::CELL_M;
    use nav_sim::families::{Family, Split, generate};

    #[test]
    fn both_searches_agree_on_the_cost_and_connect_start_and_goal() {
        for seed in 0..5 {
            let world = generate(Family::Maze, Split::Validation, seed);
            let grid = Grid::new(&world, &Task::default());
            let [(first, quick), (second, slow)] = [Search::AStar, Search::Dijkstra]
                .map(|search| grid.path(search, world.start.position(), world.goal));
            assert!(quick.expanded >= first.len() as u64 - 1, "at least the way itself: {quick:?}");
            assert!(quick.expanded < slow.expanded && slow.expanded <= slow.cells, "{quick:?}, {slow:?}");
            assert!(quick.bytes < slow.bytes && quick.cells == slow.cells, "{quick:?}, {slow:?}");
            let paths = [first, second];
            let length = |path: &[Point]| path.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum::<f32>();
            for path in &paths {
                assert!((path[0] - world.start.position()).norm() < CELL_M);
                assert!((path[path.len() - 1] - world.goal).norm() < CELL_M);
            }
            assert!((length(&paths[0]) - length(&paths[1])).abs() < 1.0, "same cost, nearly the same way");
        }
    }
}
