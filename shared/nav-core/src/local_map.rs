//! A rolling map around the robot, of fixed size: what was seen occupied, and where the robot has been.
//!
//! 128 x 128 cells in the `odom` frame, stored as a torus: a cell's place is its world index modulo
//! 128, and rows and columns that the window leaves are cleared. Occupancy is evidence that hits raise and
//! passing beams lower, so that people do not burn in.

use crate::geometry::Point;
use crate::scan::ScanView;

/// Cells a side.
pub const MAP_CELLS: usize = 128;
/// Side of a cell, m of the reference robot ([`crate::scale`]).
pub const CELL_M: f32 = 0.25;
const MASK: i32 = MAP_CELLS as i32 - 1;
const EVIDENCE_MAX: i8 = 8;
const EVIDENCE_MIN: i8 = -4;
const EVIDENCE_HIT: i8 = 3;
/// Rays are followed so many cells far: half the window less two.
const RAY_MAX_CELLS: f32 = (MAP_CELLS / 2 - 2) as f32;
/// Evidence from which a cell counts as occupied.
const OCCUPIED: i8 = 3;

/// A cell by its world index: the cell holds x in [ix, ix + 1) times the side of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cell {
    /// Column.
    pub ix: i32,
    /// Row.
    pub iy: i32,
}

impl Cell {
    /// The cell of side `cell_m` that holds a point of the `odom` frame.
    pub fn of(point: Point, cell_m: f32) -> Self {
        let cells_per_m = 1.0 / cell_m;
        Self { ix: floor(point.x * cells_per_m), iy: floor(point.y * cells_per_m) }
    }

    /// Its centre in the `odom` frame, m.
    pub fn center(self, cell_m: f32) -> Point {
        Point::new((self.ix as f32 + 0.5) * cell_m, (self.iy as f32 + 0.5) * cell_m)
    }

    fn slot(self) -> usize {
        ((self.iy & MASK) as usize) * MAP_CELLS + (self.ix & MASK) as usize
    }
}

/// The next whole number at or below `value`: two instructions where `libm::floorf` is a call.
fn floor(value: f32) -> i32 {
    let truncated = value as i32;
    truncated - i32::from((truncated as f32) > value)
}

/// The rolling map.
#[derive(Clone, Debug)]
pub struct LocalMap {
    cell_m: f32,
    /// Steps of 0.1 s of the reference robot that a visit stands for.
    visit_steps: f32,
    /// World index of the window's lower left cell.
    origin: Cell,
    evidence: [i8; MAP_CELLS * MAP_CELLS],
    visits: [u8; MAP_CELLS * MAP_CELLS],
}

impl LocalMap {
    /// An empty map around `center` (`odom` frame), of cells of side `cell_m`. A [visit](Self::visit) stands for so many steps
    /// of 0.1 s of the reference robot.
    pub fn new(center: Point, cell_m: f32, visit_steps: f32) -> Self {
        Self {
            cell_m,
            visit_steps,
            origin: origin_around(center, cell_m),
            evidence: [0; MAP_CELLS * MAP_CELLS],
            visits: [0; MAP_CELLS * MAP_CELLS],
        }
    }

    /// A map around the origin in which every cell is occupied as `is_occupied` says, asked anew for each.
    #[cfg(test)]
    pub(crate) fn littered(mut is_occupied: impl FnMut() -> bool) -> Self {
        let mut map = Self::new(Point::origin(), CELL_M, 1.0);
        map.evidence.fill_with(|| if is_occupied() { OCCUPIED } else { 0 });
        map
    }

    /// Forgets everything and centres on `center`.
    pub fn clear(&mut self, center: Point) {
        self.origin = origin_around(center, self.cell_m);
        self.evidence.fill(0);
        self.visits.fill(0);
    }

    /// Side of a cell, m.
    pub fn cell_m(&self) -> f32 {
        self.cell_m
    }

    /// World index of the window's lower left cell.
    pub fn origin(&self) -> Cell {
        self.origin
    }

    /// Whether a cell lies in the window.
    pub fn contains(&self, cell: Cell) -> bool {
        let (dx, dy) = (cell.ix - self.origin.ix, cell.iy - self.origin.iy);
        (0..MAP_CELLS as i32).contains(&dx) && (0..MAP_CELLS as i32).contains(&dy)
    }

    /// Moves the window so that `center` is in its middle, forgetting what it leaves.
    pub fn recenter(&mut self, center: Point) {
        let target = origin_around(center, self.cell_m);
        let (dx, dy) = (target.ix - self.origin.ix, target.iy - self.origin.iy);
        // A jump (a new localisation, say) leaves the whole window behind.
        if dx.abs() >= MAP_CELLS as i32 || dy.abs() >= MAP_CELLS as i32 {
            self.clear(center);
            return;
        }
        let first_new = |from: i32, to: i32| if to > from { from + MAP_CELLS as i32 } else { to };
        for step in 0..dx.abs() {
            self.clear_column(first_new(self.origin.ix, target.ix) + step);
        }
        for step in 0..dy.abs() {
            self.clear_row(first_new(self.origin.iy, target.iy) + step);
        }
        self.origin = target;
    }

    fn clear_column(&mut self, ix: i32) {
        let column = (ix & MASK) as usize;
        for row in 0..MAP_CELLS {
            self.evidence[row * MAP_CELLS + column] = 0;
            self.visits[row * MAP_CELLS + column] = 0;
        }
    }

    fn clear_row(&mut self, iy: i32) {
        let start = ((iy & MASK) as usize) * MAP_CELLS;
        self.evidence[start..start + MAP_CELLS].fill(0);
        self.visits[start..start + MAP_CELLS].fill(0);
    }

    /// Adds a stay at `position`.
    pub fn visit(&mut self, position: Point) {
        let cell = Cell::of(position, self.cell_m);
        if self.contains(cell) {
            let count = &mut self.visits[cell.slot()];
            *count = count.saturating_add(1);
        }
    }

    /// Adds a scan taken at `position` with heading (`cos`, `sin`) in the `odom` frame. Rays clear cells as
    /// far as half the window, hits count in the whole window; `position` must be the one that the map was last centred on.
    pub fn integrate(&mut self, position: Point, cos: f32, sin: f32, scan: &ScanView) {
        let (cell_m, cells_per_m) = (self.cell_m, 1.0 / self.cell_m);
        let ray_max_m = RAY_MAX_CELLS * cell_m;
        // Relative to the window's corner a ray never leaves the window, and truncation is rounding down.
        let lidar = scan.origin();
        let start_m = Point::new(
            position.x + (cos * lidar.x - sin * lidar.y),
            position.y + (sin * lidar.x + cos * lidar.y),
        );
        let start_x = start_m.x * cells_per_m - self.origin.ix as f32;
        let start_y = start_m.y * cells_per_m - self.origin.iy as f32;
        let (first_column, first_row) = ((self.origin.ix & MASK) as usize, (self.origin.iy & MASK) as usize);
        for &(ray_cos, ray_sin, free_m) in scan.rays() {
            let (step_x, step_y) = (cos * ray_cos - sin * ray_sin, sin * ray_cos + cos * ray_sin);
            // Sampling a cell apart, up to a cell short of the hit, keeps walls from being eaten.
            let samples = ((free_m.min(ray_max_m) - cell_m) * cells_per_m) as i32;
            let (mut x, mut y) = (start_x, start_y);
            for _ in 0..samples {
                x += step_x;
                y += step_y;
                let column = (x as i32 as usize).wrapping_add(first_column) % MAP_CELLS;
                let row = (y as i32 as usize).wrapping_add(first_row) % MAP_CELLS;
                let evidence = &mut self.evidence[row * MAP_CELLS + column];
                *evidence = (*evidence - 1).max(EVIDENCE_MIN);
            }
        }
        for hit in scan.hits() {
            let (local_x, local_y) = (hit.point.x, hit.point.y);
            let point = Point::new(
                position.x + cos * local_x - sin * local_y,
                position.y + sin * local_x + cos * local_y,
            );
            let cell = Cell::of(point, cell_m);
            if self.contains(cell) {
                let evidence = &mut self.evidence[cell.slot()];
                *evidence = (*evidence + EVIDENCE_HIT).min(EVIDENCE_MAX);
            }
        }
    }

    /// Steps (of 0.1 s of the reference robot) spent per cell in the 3 x 3 cells around a point; 0 outside the window.
    pub fn visit_density(&self, point: Point) -> f32 {
        let center = Cell::of(point, self.cell_m);
        let mut sum = 0_u32;
        for iy in center.iy - 1..=center.iy + 1 {
            for ix in center.ix - 1..=center.ix + 1 {
                let cell = Cell { ix, iy };
                if self.contains(cell) {
                    sum += u32::from(self.visits[cell.slot()]);
                }
            }
        }
        sum as f32 / 9.0 * self.visit_steps
    }

    /// The occupied cells as bits: bit `c` of word `r` is the cell at `origin + (c, r)`.
    pub fn occupancy_rows(&self) -> [u128; MAP_CELLS] {
        let mut rows = [0_u128; MAP_CELLS];
        let shift = (self.origin.ix & MASK) as u32;
        for (row, bits) in rows.iter_mut().enumerate() {
            let start = (((self.origin.iy + row as i32) & MASK) as usize) * MAP_CELLS;
            let mut word = 0_u128;
            for (column, &evidence) in self.evidence[start..start + MAP_CELLS].iter().enumerate() {
                word |= u128::from(evidence >= OCCUPIED) << column;
            }
            *bits = word.rotate_right(shift);
        }
        rows
    }
}

fn origin_around(center: Point, cell_m: f32) -> Cell {
    let middle = Cell::of(center, cell_m);
    Cell { ix: middle.ix - MAP_CELLS as i32 / 2, iy: middle.iy - MAP_CELLS as i32 / 2 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages::LaserScan;
    use crate::scan::ScanGeometry;
    use crate::task::Task;

    fn is_occupied(map: &LocalMap, cell: Cell) -> bool {
        map.contains(cell) && map.evidence[cell.slot()] >= OCCUPIED
    }

    fn ring(range_m: f32) -> ScanView {
        let task = Task::default();
        let geometry = ScanGeometry::new(&task);
        let mut view = ScanView::new(&geometry);
        let scan = LaserScan::of(&task.lidar, |_| range_m);
        view.update(&geometry, scan.ranges_m(), scan.range_max_m);
        view
    }

    #[test]
    fn hits_occupy_and_passing_beams_clear() {
        let here = Point::new(0.1, -0.1);
        let mut map = LocalMap::new(here, CELL_M, 1.0);
        map.integrate(here, 1.0, 0.0, &ring(2.0));
        assert!(is_occupied(&map, Cell::of(Point::new(2.1, -0.1), CELL_M)));
        assert!(!is_occupied(&map, Cell::of(Point::new(1.0, -0.1), CELL_M)));
        for _ in 0..12 {
            map.integrate(here, 1.0, 0.0, &ring(4.0));
        }
        assert!(
            !is_occupied(&map, Cell::of(Point::new(2.1, -0.1), CELL_M)),
            "a person that left must vanish"
        );
    }

    #[test]
    fn the_window_forgets_what_it_leaves_and_keeps_the_rest() {
        let here = Point::new(0.0, 0.0);
        let half_m = 0.5 * MAP_CELLS as f32 * CELL_M;
        let mut map = LocalMap::new(here, CELL_M, 1.0);
        map.visit(Point::new(1.0 - half_m, 0.0));
        map.visit(Point::new(3.0, 0.0));
        map.recenter(Point::new(4.0, 0.0));
        assert!(map.visit_density(Point::new(3.0, 0.0)) > 0.0);
        // The cell that left aliases onto a new one, which must be clean.
        assert!(map.visit_density(Point::new(1.0 + half_m, 0.0)) == 0.0);
        map.recenter(Point::new(0.0, 0.0));
        assert!(map.visit_density(Point::new(1.0 - half_m, 0.0)) == 0.0);
        assert!(map.visit_density(Point::new(3.0, 0.0)) > 0.0);
    }

    #[test]
    fn occupancy_rows_are_relative_to_the_origin() {
        let here = Point::new(10.3, -4.7);
        let mut map = LocalMap::new(here, CELL_M, 1.0);
        map.integrate(here, 0.0, 1.0, &ring(1.5));
        let rows = map.occupancy_rows();
        for (row, &bits) in rows.iter().enumerate() {
            for column in 0..MAP_CELLS {
                let cell = Cell { ix: map.origin().ix + column as i32, iy: map.origin().iy + row as i32 };
                assert_eq!(bits >> column & 1 == 1, is_occupied(&map, cell));
            }
        }
        assert!(rows.iter().any(|&bits| bits != 0));
    }
}
