//! The optimistic geodesic: the shortest way to the goal over everything seen so far, taking the unseen as
//! free. Dial's algorithm over the window of the [`LocalMap`], 8-connected, in fixed memory.
//!
//! Cells beside an occupied one cost [`NEAR_FACTOR`] times as much, and a gap of one cell between two
//! occupied ones is closed: sparse beams leave holes in walls. A door of less than three cells (0.75 m for the reference robot) may so
//! count as closed, depending on where the cells fall; this is a hint to the policy, not what it may do.

use crate::geometry::Point;
use crate::local_map::{Cell, LocalMap, MAP_CELLS};

const CELLS: usize = MAP_CELLS * MAP_CELLS;
/// Units of cost of a cell's length: a straight step is 5 units, a diagonal one 7.
const CELL_UNITS: f32 = 5.0;
/// How much dearer a cell beside an obstacle is.
pub const NEAR_FACTOR: u16 = 3;
/// From a point to the centres of the cells around its own at most, cells.
const BESIDE: f32 = 1.5 * core::f32::consts::SQRT_2;
/// Above any spread of queued keys: border seeds (at most 128 cells * sqrt 2 apart) and one step.
const BUCKETS: usize = 1024;
const NONE: u16 = u16::MAX;
const UNREACHED: u16 = u16::MAX;

/// Cost to the goal of every cell of the window.
#[derive(Clone, Debug)]
pub struct OptimisticGeodesic {
    origin: Cell,
    /// Side of a cell, m, and of it a unit of cost.
    cell_m: f32,
    unit_m: f32,
    cost: [u16; CELLS],
    /// What is not reached costs more than this, or is not reached at all if this is [`UNREACHED`].
    end: u16,
    /// 0 blocked, else the factor of entering the cell.
    factor: [u8; CELLS],
    next: [u16; CELLS],
    previous: [u16; CELLS],
    heads: [u16; BUCKETS],
}

impl Default for OptimisticGeodesic {
    fn default() -> Self {
        Self {
            origin: Cell { ix: 0, iy: 0 },
            cell_m: 1.0,
            unit_m: 1.0 / CELL_UNITS,
            cost: [UNREACHED; CELLS],
            end: UNREACHED,
            factor: [1; CELLS],
            next: [NONE; CELLS],
            previous: [NONE; CELLS],
            heads: [NONE; BUCKETS],
        }
    }
}

impl OptimisticGeodesic {
    /// Works out the cost of every cell from which the way to a goal in the `odom` frame is at most `farther_m` longer
    /// than from `here`; the others are only known to be farther, whether they are reached at all or not. A goal outside
    /// the window is reached in a straight line from the window's edge.
    pub fn update(&mut self, map: &LocalMap, goal: Point, here: Point, farther_m: f32) {
        self.origin = map.origin();
        (self.cell_m, self.unit_m) = (map.cell_m(), map.cell_m() / CELL_UNITS);
        self.paint(&map.occupancy_rows());
        self.cost.fill(UNREACHED);
        self.heads.fill(NONE);
        self.end = UNREACHED;
        let here = Cell::of(here, self.cell_m);
        let enough = (farther_m / self.unit_m + BESIDE * CELL_UNITS).min(60_000.0) as u16 + 1;
        let is_open = map.contains(here) && self.factor[self.index(here)] > 0;
        let mut key = usize::MAX;
        let mut queued = 0_usize;
        let goal_cell = Cell::of(goal, self.cell_m);
        if map.contains(goal_cell) {
            let index = self.index(goal_cell);
            self.factor[index] = self.factor[index].max(1);
            self.insert(index, 0);
            (key, queued) = (0, 1);
        } else {
            for along in 0..MAP_CELLS {
                let last = MAP_CELLS - 1;
                for (column, row) in [(along, 0), (along, last), (0, along), (last, along)] {
                    let index = row * MAP_CELLS + column;
                    if self.factor[index] == 0 || self.cost[index] != UNREACHED {
                        continue;
                    }
                    let units = ((self.center(index) - goal).norm() / self.unit_m).min(60_000.0) as u16;
                    self.insert(index, units);
                    queued += 1;
                    key = key.min(usize::from(units));
                }
            }
        }
        while queued > 0 && key <= usize::from(self.end) {
            let bucket = key % BUCKETS;
            let index = self.heads[bucket];
            if index == NONE {
                key += 1;
                continue;
            }
            let index = usize::from(index);
            self.remove(index);
            queued -= 1;
            queued += self.relax_around(index);
            // As `distance_m` reads it: from its own cell, or else from the nearest of those around.
            if self.end == UNREACHED && self.are_within(index, here, i32::from(!is_open)) {
                self.end = self.cost[index].saturating_add(enough);
            }
        }
        if queued == 0 {
            // What was not reached by now never is.
            self.end = UNREACHED;
        }
    }

    /// Whether two cells are at most so many columns and rows apart.
    fn are_within(&self, index: usize, cell: Cell, apart: i32) -> bool {
        let (row, column) = ((index / MAP_CELLS) as i32, (index % MAP_CELLS) as i32);
        let (dx, dy) = (self.origin.ix + column - cell.ix, self.origin.iy + row - cell.iy);
        dx.abs().max(dy.abs()) <= apart
    }

    /// Length of the way from a point to the goal, m; `None` where no way is known. Where the way is longer than
    /// [`Self::update`] was asked for, some length that is longer than that.
    ///
    /// Read from the point's own cell; from its neighbours only where the own cell has none, as beside a wall:
    /// a neighbour may lie behind it.
    pub fn distance_m(&self, from: Point) -> Option<f32> {
        let center = Cell::of(from, self.cell_m);
        if let Some(distance_m) = self.through(center, from) {
            return Some(distance_m);
        }
        let mut best = f32::INFINITY;
        for iy in center.iy - 1..=center.iy + 1 {
            for ix in center.ix - 1..=center.ix + 1 {
                best = best.min(self.through(Cell { ix, iy }, from).unwrap_or(f32::INFINITY));
            }
        }
        best.is_finite().then_some(best)
    }

    /// Length of the way by a cell's centre, m; `None` outside the map or where the cell has none.
    fn through(&self, cell: Cell, from: Point) -> Option<f32> {
        let (dx, dy) = (cell.ix - self.origin.ix, cell.iy - self.origin.iy);
        let side = 0..MAP_CELLS as i32;
        if !side.contains(&dx) || !side.contains(&dy) {
            return None;
        }
        let index = self.index(cell);
        let cost = if self.factor[index] > 0 { self.cost[index].min(self.end) } else { self.cost[index] };
        (cost != UNREACHED).then(|| f32::from(cost) * self.unit_m + (cell.center(self.cell_m) - from).norm())
    }

    fn index(&self, cell: Cell) -> usize {
        (cell.iy - self.origin.iy) as usize * MAP_CELLS + (cell.ix - self.origin.ix) as usize
    }

    fn center(&self, index: usize) -> Point {
        let (row, column) = (index / MAP_CELLS, index % MAP_CELLS);
        Cell { ix: self.origin.ix + column as i32, iy: self.origin.iy + row as i32 }.center(self.cell_m)
    }

    /// Turns occupancy bits into factors: occupied and one-cell gaps blocked, their neighbours dear.
    fn paint(&mut self, occupied: &[u128; MAP_CELLS]) {
        let row = |rows: &[u128; MAP_CELLS], index: usize, offset: isize| {
            index.checked_add_signed(offset).and_then(|at| rows.get(at)).copied().unwrap_or(0)
        };
        let mut blocked = [0_u128; MAP_CELLS];
        for (index, bits) in blocked.iter_mut().enumerate() {
            let (here, up, down) =
                (row(occupied, index, 0), row(occupied, index, 1), row(occupied, index, -1));
            let gap = (here << 1 & here >> 1) | (up & down) | (up << 1 & down >> 1) | (up >> 1 & down << 1);
            *bits = here | gap;
        }
        for index in 0..MAP_CELLS {
            let (here, up, down) =
                (row(&blocked, index, 0), row(&blocked, index, 1), row(&blocked, index, -1));
            let any = here | up | down;
            let near = any | any << 1 | any >> 1;
            for column in 0..MAP_CELLS {
                self.factor[index * MAP_CELLS + column] = if here >> column & 1 == 1 {
                    0
                } else if near >> column & 1 == 1 {
                    NEAR_FACTOR as u8
                } else {
                    1
                };
            }
        }
    }

    /// Offers every neighbour the way through `index`; how many entered the queue for the first time.
    fn relax_around(&mut self, index: usize) -> usize {
        const LAST: usize = MAP_CELLS - 1;
        let (row, column) = (index / MAP_CELLS, index % MAP_CELLS);
        let cost = self.cost[index];
        let own = u16::from(self.factor[index].max(1));
        let mut entered = 0;
        for next_row in row.saturating_sub(1)..=(row + 1).min(LAST) {
            for next_column in column.saturating_sub(1)..=(column + 1).min(LAST) {
                let neighbour = next_row * MAP_CELLS + next_column;
                let factor = u16::from(self.factor[neighbour]);
                if factor == 0 || neighbour == index {
                    continue;
                }
                let diagonal = next_row != row && next_column != column;
                // No cutting of blocked corners.
                if diagonal
                    && (self.factor[row * MAP_CELLS + next_column] == 0
                        || self.factor[next_row * MAP_CELLS + column] == 0)
                {
                    continue;
                }
                let step = if diagonal { 7 } else { 5 } * factor.max(own);
                let offer = cost.saturating_add(step);
                if offer < self.cost[neighbour] {
                    if self.cost[neighbour] == UNREACHED {
                        entered += 1;
                    } else {
                        self.remove(neighbour);
                    }
                    self.insert(neighbour, offer);
                }
            }
        }
        entered
    }

    fn insert(&mut self, index: usize, cost: u16) {
        self.cost[index] = cost;
        let bucket = usize::from(cost) % BUCKETS;
        let head = self.heads[bucket];
        self.next[index] = head;
        self.previous[index] = NONE;
        if head != NONE {
            self.previous[usize::from(head)] = index as u16;
        }
        self.heads[bucket] = index as u16;
    }

    fn remove(&mut self, index: usize) {
        let (previous, next) = (self.previous[index], self.next[index]);
        if previous == NONE {
            self.heads[usize::from(self.cost[index]) % BUCKETS] = next;
        } else {
            self.next[usize::from(previous)] = next;
        }
        if next != NONE {
            self.previous[usize::from(next)] = previous;
        }
    }
}

#[cfg(test)]
mod tests;
