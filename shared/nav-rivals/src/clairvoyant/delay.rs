//! How much people cost the robot, from everywhere: what tells the search to wait, to leave before somebody comes, or to
//! go another way round.
//!
//! A disc of the robot's width is followed backwards in time from the goal, over square cells and slices of time in
//! which it crosses one in any direction. It is slower than the robot, because the robot must turn. That is a guide
//! and no more: the search itself is exact.

use nav_core::geometry::{Point, Vector};
use nav_sim::simulation::Simulation;
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::f32::consts::SQRT_2;

use super::future::Future;

/// Speed of the point over that of the robot.
const PACE: f32 = 0.7;
/// How often a cell counts in which people always are, on the way that avoids them.
const BUSY: f32 = 10.0;
/// The most cells; a larger world gets larger ones.
const CELLS_MAX: f32 = 1e4;
/// No way to the goal.
const NEVER: u16 = u16::MAX;

/// What people cost in each cell.
pub(super) struct Delay {
    origin: Point,
    cell_m: f32,
    columns: usize,
    rows: usize,
    /// Steps of a slice.
    steps: usize,
    slice_s: f32,
    /// Slices to the goal without people.
    alone: Vec<u16>,
    /// With them, from each slice on.
    among: Vec<Vec<u16>>,
    /// Slices in which people block a cell.
    busy: Vec<u16>,
    /// Seconds to the goal on a way that avoids where people often are.
    around_s: Vec<f32>,
}

impl Delay {
    /// For so many steps from now, in slices of some; people are given so much room.
    pub(super) fn new(truth: &Simulation, future: &Future, steps: usize, slice: usize, gap_m: f32) -> Self {
        let (world, task) = (truth.world(), truth.task());
        let size = world.bounds.max - world.bounds.min;
        let slice_s = slice as f32 * task.control_period_s;
        let cell_m = (PACE * task.robot.linear_max_mps * slice_s).max((size.x * size.y / CELLS_MAX).sqrt());
        // A border that is never free, so that every cell inside has eight neighbours.
        let count = |length_m: f32| (length_m / cell_m).ceil() as usize + 2;
        let (columns, rows) = (count(size.x), count(size.y));
        let mut delay = Self {
            origin: world.bounds.min - Vector::repeat(cell_m),
            cell_m,
            columns,
            rows,
            steps: slice,
            slice_s,
            alone: Vec::new(),
            among: Vec::new(),
            busy: vec![0; columns * rows],
            around_s: Vec::new(),
        };
        let radius_m = truth.footprint().half_width_m();
        let is_free: Vec<bool> = (0..columns * rows)
            .map(|cell| !truth.obstacles().collides(delay.center(cell), radius_m))
            .collect();
        let reach_m = task.goal_radius_m.max(cell_m);
        let is_goal = |cell: usize| (delay.center(cell) - world.goal).norm() <= reach_m;
        let goal: Vec<usize> = (0..columns * rows).filter(|&cell| is_goal(cell)).collect();
        let slices = delay.flooded(&is_free, &goal, |_, _| 1.0);
        delay.alone = slices.into_iter().map(|way| way.min(f32::from(NEVER)) as u16).collect();
        delay.go_back(truth, future, steps, radius_m + gap_m);
        let slices = delay.among.len() as f32;
        let time_s = |cell: usize, is_diagonal: bool| {
            let busy = 1.0 + BUSY * f32::from(delay.busy[cell]) / slices;
            busy * cell_m / task.robot.linear_max_mps * if is_diagonal { SQRT_2 } else { 1.0 }
        };
        delay.around_s = delay.flooded(&is_free, &goal, time_s);
        delay
    }

    /// Dijkstra's algorithm from the goal, with what entering a cell costs, straight or along the diagonal.
    fn flooded(&self, is_free: &[bool], goal: &[usize], cost: impl Fn(usize, bool) -> f32) -> Vec<f32> {
        let mut ways = vec![f32::INFINITY; is_free.len()];
        // The bits of numbers that are not negative are in the order of the numbers.
        let mut open: BinaryHeap<_> = goal.iter().map(|&cell| (Reverse(0_f32.to_bits()), cell)).collect();
        for &cell in goal {
            ways[cell] = 0.0;
        }
        while let Some((Reverse(bits), cell)) = open.pop() {
            let way = f32::from_bits(bits);
            if way > ways[cell] {
                continue;
            }
            for next in self.neighbours(cell).filter(|&next| is_free[next]) {
                let is_diagonal =
                    next / self.columns != cell / self.columns && next % self.columns != cell % self.columns;
                let new = way + cost(next, is_diagonal);
                if new < ways[next] {
                    ways[next] = new;
                    open.push((Reverse(new.to_bits()), next));
                }
            }
        }
        ways
    }

    /// From the last slice to the first.
    fn go_back(&mut self, truth: &Simulation, future: &Future, steps: usize, radius_m: f32) {
        let substeps = truth.base().substeps() as usize;
        let mut later = self.alone.clone();
        let mut rows = vec![NEVER; later.len()];
        for slice in (1..=steps / self.steps).rev() {
            let people = future.after(slice * self.steps * substeps - 1);
            for (&center, person) in people.iter().zip(&truth.world().people) {
                self.block(&mut later, center, radius_m + person.radius_m);
            }
            let mut now = self.alone.clone();
            // The least of three in the row, then of three rows.
            for cell in 1..later.len() - 1 {
                rows[cell] = later[cell - 1].min(later[cell]).min(later[cell + 1]);
            }
            for cell in self.columns..later.len() - self.columns {
                let least = rows[cell - self.columns].min(rows[cell]).min(rows[cell + self.columns]);
                if now[cell] != 0 && now[cell] != NEVER {
                    now[cell] = least.saturating_add(1);
                }
            }
            self.among.push(std::mem::replace(&mut later, now));
        }
        self.among.push(later);
        self.among.reverse();
    }

    /// Nobody can be within `reach_m` of a centre.
    fn block(&mut self, slices: &mut [u16], center: Point, reach_m: f32) {
        let at = (center - self.origin) / self.cell_m;
        let reach = reach_m / self.cell_m;
        let within = |at: f32, count: usize| {
            ((at - reach).max(0.0) as usize)..((at + reach).max(0.0) as usize + 1).min(count)
        };
        for row in within(at.y, self.rows) {
            for column in within(at.x, self.columns) {
                let cell = row * self.columns + column;
                if (self.center(cell) - center).norm_squared() < reach_m * reach_m {
                    slices[cell] = NEVER;
                    self.busy[cell] += 1;
                }
            }
        }
    }

    fn neighbours(&self, cell: usize) -> impl Iterator<Item = usize> {
        let (row, column, stride) = (cell / self.columns, cell % self.columns, self.columns);
        let columns = column.saturating_sub(1)..(column + 2).min(stride);
        let rows = row.saturating_sub(1)..(row + 2).min(self.rows);
        rows.flat_map(move |row| columns.clone().map(move |column| row * stride + column))
    }

    fn center(&self, cell: usize) -> Point {
        let (row, column) = (cell / self.columns, cell % self.columns);
        self.origin + Vector::new(column as f32 + 0.5, row as f32 + 0.5) * self.cell_m
    }

    fn cell(&self, place: Point) -> usize {
        let at = (place - self.origin) / self.cell_m;
        (at.y as usize).min(self.rows - 1) * self.columns + (at.x as usize).min(self.columns - 1)
    }

    /// How much later than without people the goal is reached from a place after so many steps, s; infinite where it
    /// is not.
    pub(super) fn at_s(&self, place: Point, step: usize) -> f32 {
        let cell = self.cell(place);
        match self.among[(step / self.steps).min(self.among.len() - 1)][cell] {
            NEVER => f32::INFINITY,
            among => f32::from(among.saturating_sub(self.alone[cell])) * self.slice_s,
        }
    }

    /// Time to the goal on the way that avoids where people often are, each place where they are counted for more, s.
    pub(super) fn around_s(&self, place: Point) -> Option<f32> {
        let at = (place - self.origin) / self.cell_m - Vector::repeat(0.5);
        let (column, row) = ((at.x as usize).min(self.columns - 2), (at.y as usize).min(self.rows - 2));
        let (right, up) = ((at.x - column as f32).clamp(0.0, 1.0), (at.y - row as f32).clamp(0.0, 1.0));
        let (mut sum_s, mut weights) = (0.0, 0.0);
        for (dx, dy, weight) in [
            (0, 0, (1.0 - right) * (1.0 - up)),
            (1, 0, right * (1.0 - up)),
            (0, 1, (1.0 - right) * up),
            (1, 1, right * up),
        ] {
            let time_s = self.around_s[(row + dy) * self.columns + column + dx];
            if time_s.is_finite() {
                sum_s += weight * time_s;
                weights += weight;
            }
        }
        (weights > 1e-3).then(|| sum_s / weights)
    }
}
