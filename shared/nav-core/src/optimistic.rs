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
            factor: [1; CELLS],
            next: [NONE; CELLS],
            previous: [NONE; CELLS],
            heads: [NONE; BUCKETS],
        }
    }
}

impl OptimisticGeodesic {
    /// Works out the cost of every cell for a goal in the `odom` frame. A goal outside the window is reached
    /// in a straight line from the window's edge.
    pub fn update(&mut self, map: &LocalMap, goal: Point) {
        self.origin = map.origin();
        (self.cell_m, self.unit_m) = (map.cell_m(), map.cell_m() / CELL_UNITS);
        self.paint(&map.occupancy_rows());
        self.cost.fill(UNREACHED);
        self.heads.fill(NONE);
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
        while queued > 0 {
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
        }
    }

    /// Length of the way from a point to the goal, m; `None` where no way is known.
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
        let cost = self.cost[self.index(cell)];
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
mod tests {
    use super::*;
    use crate::messages::LaserScan;
    use crate::scan::{ScanGeometry, ScanView};
    use crate::task::Task;

    /// A map of a straight wall from y = -2 to y = 2 at x = 2, seen from the origin.
    fn walled() -> LocalMap {
        let task =
            Task { lidar: crate::task::Lidar { beam_count: 720, ..Default::default() }, ..Task::default() };
        let geometry = ScanGeometry::new(&task);
        let scan = LaserScan::of(&task.lidar, |angle| {
            let at_wall = 2.05 * libm::tanf(angle);
            let hits = libm::cosf(angle) > 0.0 && at_wall.abs() < 2.0;
            if hits { 2.05 / libm::cosf(angle) } else { f32::INFINITY }
        });
        let mut view = ScanView::new(&geometry);
        view.update(&geometry, scan.ranges_m(), scan.range_max_m);
        let mut map = LocalMap::new(Point::origin(), crate::local_map::CELL_M, 1.0);
        map.integrate(Point::origin(), 1.0, 0.0, &view);
        map
    }

    #[test]
    fn open_floor_is_nearly_straight() {
        let map = LocalMap::new(Point::origin(), crate::local_map::CELL_M, 1.0);
        let mut geodesic = OptimisticGeodesic::default();
        geodesic.update(&map, Point::new(5.0, 3.0));
        let distance = geodesic.distance_m(Point::origin()).expect("free");
        let straight = libm::sqrtf(34.0);
        assert!(
            distance >= straight - 0.3 && distance < straight * 1.1 + 0.3,
            "{distance} against {straight}"
        );
    }

    #[test]
    fn a_wall_costs_the_way_round() {
        let mut geodesic = OptimisticGeodesic::default();
        geodesic.update(&walled(), Point::new(4.0, 0.0));
        let distance = geodesic.distance_m(Point::origin()).expect("a way round");
        assert!(distance > 5.2, "{distance}: through the wall it would be 4");
        let beside = geodesic.distance_m(Point::new(2.0, 2.8)).expect("free");
        assert!(beside < distance - 1.5, "going round the end must look like progress");
    }

    #[test]
    fn a_goal_outside_the_window_pulls_the_right_way() {
        let map = LocalMap::new(Point::origin(), crate::local_map::CELL_M, 1.0);
        let mut geodesic = OptimisticGeodesic::default();
        geodesic.update(&map, Point::new(30.0, 0.0));
        let here = geodesic.distance_m(Point::origin()).expect("free");
        let ahead = geodesic.distance_m(Point::new(2.0, 0.0)).expect("free");
        assert!((here - 30.0).abs() < 1.0 && (here - ahead - 2.0).abs() < 0.3, "{here} {ahead}");
    }
}
