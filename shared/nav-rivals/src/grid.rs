//! What a planner's grid costs: dearer next to things, blocked where the footprint does not fit. Metres of the constants are
//! those of the reference robot ([`nav_core::scale`]).

use nav_core::geometry::Point;
use nav_core::scale::Scale;
use nav_core::shield::MARGIN_M;
use nav_core::task::{ShieldMode, Task};
use nav_sim::obstacles::Obstacles;
use nav_sim::world::World;

/// Side of a planning cell, m.
pub(crate) const CELL_M: f32 = 0.1;
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

/// Costs of the cells of a world.
pub(crate) struct Grid {
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

/// Column and row.
pub(crate) type Cell = (i32, i32);

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
    pub(crate) fn new(world: &World, task: &Task) -> Self {
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

    pub(crate) fn center(&self, cell: Cell) -> Point {
        Point::new(
            self.origin.x + (cell.0 as f32 + 0.5) * self.cell_m,
            self.origin.y + (cell.1 as f32 + 0.5) * self.cell_m,
        )
    }

    pub(crate) fn cell(&self, point: Point) -> Cell {
        let at = (point - self.origin) / self.cell_m;
        (at.x.floor() as i32, at.y.floor() as i32)
    }

    fn cost(&self, cell: Cell) -> u32 {
        let inside = (0..self.columns).contains(&cell.0) && (0..self.rows).contains(&cell.1);
        if inside { self.cost[(cell.1 * self.columns + cell.0) as usize] } else { 0 }
    }

    /// The farthest point of a path within [`LOOKAHEAD_M`] to which the straight way from a place leads nowhere nearer to
    /// things than the path does or [`CUT_M`] allows; none at its end.
    pub(crate) fn aim(&self, from: Point, path: &[Point]) -> Option<Point> {
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

    /// Costs of all cells, row by row.
    pub(crate) fn costs(&self) -> &[u32] {
        &self.cost
    }

    /// The place of a cell in them.
    pub(crate) fn index(&self, (column, row): Cell) -> usize {
        (row * self.columns + column) as usize
    }

    pub(crate) fn neighbours(&self, cell: Cell) -> Vec<(Cell, u32)> {
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
}
