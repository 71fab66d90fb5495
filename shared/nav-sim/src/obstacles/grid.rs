//! A uniform grid of cells, and items sorted by cell.

use nav_core::geometry::Point;
use std::ops::Range;

/// The most cells of a grid; a larger area gets larger cells.
const CELLS_MAX: usize = 1 << 16;

/// A uniform grid over a rectangle. Points outside belong to the nearest cell.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Grid {
    min: Point,
    per_cell: f32,
    columns: usize,
    rows: usize,
    /// Side of a cell, m.
    pub(crate) cell_m: f32,
}

impl Grid {
    /// One cell for everything.
    pub(crate) fn single() -> Self {
        Self { min: Point::origin(), per_cell: 0.0, columns: 1, rows: 1, cell_m: f32::INFINITY }
    }

    /// Square cells of about `cell_m` from `min` to `max`, m.
    pub(crate) fn covering(min: Point, max: Point, mut cell_m: f32) -> Self {
        let count = |length_m: f32, cell_m: f32| (length_m / cell_m) as usize + 1;
        let (width_m, height_m) = ((max.x - min.x).max(0.0), (max.y - min.y).max(0.0));
        while count(width_m, cell_m).saturating_mul(count(height_m, cell_m)) > CELLS_MAX {
            cell_m *= 2.0;
        }
        Self {
            min,
            per_cell: 1.0 / cell_m,
            columns: count(width_m, cell_m),
            rows: count(height_m, cell_m),
            cell_m,
        }
    }

    /// How many cells there are.
    pub(crate) fn len(&self) -> usize {
        self.columns * self.rows
    }

    /// The cell of a point.
    pub(crate) fn cell(&self, point: Point) -> usize {
        let (column, row) = self.column_row(point);
        row * self.columns + column
    }

    fn column_row(&self, point: Point) -> (usize, usize) {
        // A float cast saturates, so that what lies outside lands in the nearest cell.
        let column = ((point.x - self.min.x) * self.per_cell) as usize;
        let row = ((point.y - self.min.y) * self.per_cell) as usize;
        (column.min(self.columns - 1), row.min(self.rows - 1))
    }

    /// The cells that touch the rectangle from `low` to `high`, as one range a row.
    pub(crate) fn cells_in(&self, low: Point, high: Point) -> impl Iterator<Item = Range<usize>> + use<> {
        let (left, bottom) = self.column_row(low);
        let (right, top) = self.column_row(high);
        let columns = self.columns;
        (bottom..=top).map(move |row| row * columns + left..row * columns + right + 1)
    }

    /// The cells `ring` steps (in the maximum norm) from the cell of `point`; ring 0 is that cell itself.
    /// `None` once the ring lies outside the grid.
    pub(crate) fn ring(
        &self,
        point: Point,
        ring: usize,
    ) -> Option<impl Iterator<Item = Range<usize>> + use<>> {
        let (column, row) = self.column_row(point);
        let reach = column.max(self.columns - 1 - column).max(row).max(self.rows - 1 - row);
        if ring > reach {
            return None;
        }
        let columns = self.columns;
        let left = column.checked_sub(ring);
        let right = Some(column + ring).filter(|&right| right < columns);
        let (bottom, top) = (row.saturating_sub(ring), (row + ring).min(self.rows - 1));
        Some((bottom..=top).flat_map(move |at| {
            let base = at * columns;
            let one = |column: Option<usize>| column.map_or(0..0, |column| base + column..base + column + 1);
            if at.abs_diff(row) == ring {
                let whole = base + left.unwrap_or(0)..base + right.unwrap_or(columns - 1) + 1;
                [whole, 0..0]
            } else {
                [one(left), one(right)]
            }
        }))
    }
}

/// Items sorted by cell, so that the items of neighbouring cells of a row are one slice.
#[derive(Clone, Debug)]
pub(crate) struct Cells<T> {
    items: Vec<T>,
    starts: Vec<u32>,
    staged: Vec<(u32, T)>,
}

impl<T> Default for Cells<T> {
    fn default() -> Self {
        Self { items: Vec::new(), starts: Vec::new(), staged: Vec::new() }
    }
}

impl<T: Copy> Cells<T> {
    /// Forgets everything; memory is kept.
    pub(crate) fn clear(&mut self) {
        self.staged.clear();
    }

    /// Adds an item, seen only after [`Self::sort`].
    pub(crate) fn stage(&mut self, cell: usize, item: T) {
        self.staged.push((u32::try_from(cell).expect("cells are at most 65536"), item));
    }

    /// Sorts what was staged into `cell_count` cells; items of a cell keep their order.
    pub(crate) fn sort(&mut self, cell_count: usize) {
        if cell_count > 1 {
            self.staged.sort_by_key(|&(cell, _)| cell);
        }
        self.items.clear();
        self.items.extend(self.staged.iter().map(|&(_, item)| item));
        self.starts.clear();
        self.starts.resize(cell_count + 1, 0);
        for &(cell, _) in &self.staged {
            self.starts[cell as usize + 1] += 1;
        }
        for cell in 0..cell_count {
            self.starts[cell + 1] += self.starts[cell];
        }
    }

    /// The items of a range of cells.
    pub(crate) fn of(&self, cells: Range<usize>) -> &[T] {
        &self.items[self.starts[cells.start] as usize..self.starts[cells.end] as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rings_visit_every_cell_once() {
        let grid = Grid::covering(Point::new(-3.0, 1.0), Point::new(6.5, 5.2), 1.0);
        for start in [Point::new(-3.0, 1.0), Point::new(2.2, 3.1), Point::new(90.0, 90.0)] {
            let mut seen = vec![0; grid.len()];
            let mut ring = 0;
            while let Some(cells) = grid.ring(start, ring) {
                cells.flatten().for_each(|cell| seen[cell] += 1);
                ring += 1;
            }
            assert!(seen.iter().all(|&count| count == 1), "{seen:?}");
        }
    }

    #[test]
    fn a_huge_area_keeps_the_number_of_cells_bounded() {
        let grid = Grid::covering(Point::new(-1e6, -1e6), Point::new(1e6, 1e6), 0.5);
        assert!(grid.len() <= CELLS_MAX, "{}", grid.len());
    }
}
