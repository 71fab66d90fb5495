//! Mazes: depth first, then braided.

use super::dice::Dice;
use super::scene::{place_ends, square, wall};
use crate::world::World;
use nav_core::geometry::Point;

/// Size of a maze, and how many of the walls that depth-first search leaves are opened.
pub(super) struct Shape {
    pub(super) cells: usize,
    pub(super) cell_m: f32,
    pub(super) braided: f64,
    pub(super) apart_m: f32,
}

pub(super) const MAZE: Shape = Shape { cells: 7, cell_m: 2.0, braided: 0.15, apart_m: 5.0 };
pub(super) const MAZE_TIGHT: Shape = Shape { cells: 8, cell_m: 1.6, braided: 0.15, apart_m: 5.0 };

pub(super) fn draft(dice: &mut Dice, shape: &Shape) -> Option<World> {
    let side_m = shape.cells as f32 * shape.cell_m;
    let mut world = square(side_m);
    let grid = Grid::carved(dice, shape.cells, shape.braided);
    let at = |line: usize| line as f32 * shape.cell_m;
    for line in 1..shape.cells {
        for (from, to) in grid.runs(line, Grid::is_open_right) {
            world.segments.push(wall(Point::new(at(line), at(from)), Point::new(at(line), at(to))));
        }
        for (from, to) in grid.runs(line, |grid, line, along| grid.is_open_up(along, line)) {
            world.segments.push(wall(Point::new(at(from), at(line)), Point::new(at(to), at(line))));
        }
    }
    place_ends(dice, &mut world, shape.apart_m)?;
    Some(world)
}

/// Which neighbouring cells are joined.
struct Grid {
    cells: usize,
    right: Vec<bool>,
    up: Vec<bool>,
}

impl Grid {
    fn carved(dice: &mut Dice, cells: usize, braided: f64) -> Self {
        let mut grid = Self { cells, right: vec![false; cells * cells], up: vec![false; cells * cells] };
        let mut seen = vec![false; cells * cells];
        let mut stack = vec![dice.count(0..=cells * cells - 1)];
        seen[stack[0]] = true;
        while let Some(&cell) = stack.last() {
            let fresh: Vec<usize> = grid.neighbours(cell).filter(|&next| !seen[next]).collect();
            if fresh.is_empty() {
                stack.pop();
                continue;
            }
            let next = fresh[dice.count(0..=fresh.len() - 1)];
            seen[next] = true;
            *grid.between(cell, next) = true;
            stack.push(next);
        }
        for cell in 0..cells * cells {
            for next in [cell + 1, cell + cells] {
                let is_neighbour = grid.neighbours(cell).any(|other| other == next);
                if is_neighbour && !*grid.between(cell, next) && dice.chance(braided) {
                    *grid.between(cell, next) = true;
                }
            }
        }
        grid
    }

    fn neighbours(&self, cell: usize) -> impl Iterator<Item = usize> + use<> {
        let cells = self.cells;
        let (column, row) = (cell % cells, cell / cells);
        [
            (column > 0).then(|| cell - 1),
            (column + 1 < cells).then_some(cell + 1),
            (row > 0).then(|| cell - cells),
            (row + 1 < cells).then_some(cell + cells),
        ]
        .into_iter()
        .flatten()
    }

    fn between(&mut self, a: usize, b: usize) -> &mut bool {
        let low = a.min(b);
        if a.abs_diff(b) == 1 { &mut self.right[low] } else { &mut self.up[low] }
    }

    /// Whether the wall on the vertical line left of column `line` is open in a row.
    fn is_open_right(&self, line: usize, row: usize) -> bool {
        self.right[row * self.cells + line - 1]
    }

    /// Whether the wall on the horizontal line below row `line` is open in a column.
    fn is_open_up(&self, column: usize, line: usize) -> bool {
        self.up[(line - 1) * self.cells + column]
    }

    /// Walls along a grid line, merged: from and to in cells.
    fn runs(&self, line: usize, is_open: impl Fn(&Self, usize, usize) -> bool) -> Vec<(usize, usize)> {
        let mut runs: Vec<(usize, usize)> = Vec::new();
        for along in (0..self.cells).filter(|&along| !is_open(self, line, along)) {
            match runs.last_mut() {
                Some(run) if run.1 == along => run.1 += 1,
                _ => runs.push((along, along + 1)),
            }
        }
        runs
    }
}
