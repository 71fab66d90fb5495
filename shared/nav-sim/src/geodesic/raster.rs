//! A grid of cells that a footprint can or cannot stand on.

use crate::collision::closest_on_segment;
use crate::world::{Disc, Segment, World};
use nav_core::geometry::{Point, Vector};

/// Side of a cell as a share of the robot's radius.
const CELL_SHARE: f32 = 0.5;
/// The most cells of a raster: those of the largest map at 5 cm a pixel; with their distances 340 MB. A larger world
/// gets larger cells.
const CELLS_MAX: f32 = 6.8e7;

/// What a footprint at the centre of a cell does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Class {
    /// It hits an obstacle.
    Blocked,
    /// It touches or nearly touches one: no path leads through here, but the robot may have come here.
    Near,
    /// It has room.
    Free,
}

/// The classes of all cells, with a border of blocked cells so that every real cell has eight neighbours.
#[derive(Clone, Debug)]
pub(super) struct Raster {
    /// Centre of the first border cell, m.
    first: Point,
    /// Side of a cell, m.
    pub(super) cell_m: f32,
    /// Whether a smaller world would not get smaller cells.
    is_finest: bool,
    /// Cells in a row, border included.
    pub(super) stride: usize,
    rows: usize,
    classes: Vec<Class>,
    free_m: f32,
    near_m: f32,
}

impl Raster {
    /// Draws a world for a robot of `radius_m` that keeps `margin_m` off everything.
    pub(super) fn new(world: &World, radius_m: f32, margin_m: f32) -> Self {
        let size = world.bounds.max - world.bounds.min;
        let finest_m = CELL_SHARE * radius_m;
        let cell_m = finest_m.max((size.x / CELLS_MAX * size.y).sqrt());
        let count = |length_m: f32| (length_m / cell_m - 1e-3).ceil().max(1.0) as usize + 2;
        let (stride, rows) = (count(size.x), count(size.y));
        let mut raster = Self {
            first: world.bounds.min - Vector::repeat(0.5 * cell_m),
            cell_m,
            is_finest: cell_m <= finest_m,
            stride,
            rows,
            classes: vec![Class::Free; stride * rows],
            free_m: radius_m + margin_m,
            near_m: 0.25 * radius_m,
        };
        raster.draw_border();
        for edge in world.bounds.edges() {
            raster.draw_edge(&edge);
        }
        for edge in &world.segments {
            raster.draw_edge(edge);
        }
        for disc in &world.discs {
            raster.draw_disc(disc);
        }
        for polygon in &world.polygons {
            raster.draw_polygon(&polygon.vertices);
        }
        raster
    }

    fn draw_border(&mut self) {
        let (stride, last) = (self.stride, self.stride * (self.rows - 1));
        self.classes[..stride].fill(Class::Blocked);
        self.classes[last..].fill(Class::Blocked);
        for row in 1..self.rows {
            self.classes[row * stride] = Class::Blocked;
            self.classes[row * stride - 1] = Class::Blocked;
        }
    }

    fn draw_edge(&mut self, edge: &Segment) {
        let reach_m = self.free_m;
        let (low, high) = if edge.a.y <= edge.b.y { (edge.a, edge.b) } else { (edge.b, edge.a) };
        let along = high - low;
        for row in self.rows_within(low.y - reach_m, high.y + reach_m) {
            // The part of the edge that can reach this row.
            let y = self.first.y + row as f32 * self.cell_m;
            let share = |y: f32| if along.y > 0.0 { ((y - low.y) / along.y).clamp(0.0, 1.0) } else { 0.0 };
            let (from, to) =
                if along.y > 1e-6 { (share(y - reach_m), share(y + reach_m)) } else { (0.0, 1.0) };
            let (x_from, x_to) = (low.x + from * along.x, low.x + to * along.x);
            for column in self.columns_within(x_from.min(x_to) - reach_m, x_from.max(x_to) + reach_m) {
                let cell = row * self.stride + column;
                let center = self.center(cell);
                self.lower(cell, (center - closest_on_segment(center, edge)).norm());
            }
        }
    }

    fn draw_disc(&mut self, disc: &Disc) {
        let reach_m = disc.radius_m + self.free_m;
        for row in self.rows_within(disc.center.y - reach_m, disc.center.y + reach_m) {
            for column in self.columns_within(disc.center.x - reach_m, disc.center.x + reach_m) {
                let cell = row * self.stride + column;
                self.lower(cell, (self.center(cell) - disc.center).norm() - disc.radius_m);
            }
        }
    }

    fn draw_polygon(&mut self, vertices: &[Point]) {
        let ends = || vertices.iter().zip(vertices.iter().cycle().skip(1));
        for (&a, &b) in ends() {
            self.draw_edge(&Segment { a, b });
        }
        let y_min = vertices.iter().fold(f32::INFINITY, |low, vertex| low.min(vertex.y));
        let y_max = vertices.iter().fold(f32::NEG_INFINITY, |high, vertex| high.max(vertex.y));
        let mut crossings = Vec::new();
        for row in self.rows_within(y_min, y_max) {
            let y = self.first.y + row as f32 * self.cell_m;
            crossings.clear();
            crossings.extend(
                ends()
                    .filter(|(a, b)| (a.y > y) != (b.y > y))
                    .map(|(a, b)| a.x + (y - a.y) / (b.y - a.y) * (b.x - a.x)),
            );
            crossings.sort_by(f32::total_cmp);
            for pair in crossings.chunks_exact(2) {
                for column in self.columns_within(pair[0], pair[1]) {
                    self.classes[row * self.stride + column] = Class::Blocked;
                }
            }
        }
    }

    /// Takes note of an obstacle at a distance from a cell's centre.
    fn lower(&mut self, cell: usize, clearance_m: f32) {
        let class = if clearance_m >= self.free_m {
            Class::Free
        } else if clearance_m >= self.near_m {
            Class::Near
        } else {
            Class::Blocked
        };
        self.classes[cell] = self.classes[cell].min(class);
    }

    /// Real rows whose centre lies between two heights.
    fn rows_within(&self, low_m: f32, high_m: f32) -> std::ops::Range<usize> {
        between(low_m - self.first.y, high_m - self.first.y, self.cell_m, self.rows)
    }

    fn columns_within(&self, low_m: f32, high_m: f32) -> std::ops::Range<usize> {
        between(low_m - self.first.x, high_m - self.first.x, self.cell_m, self.stride)
    }

    /// Where cells are larger for the world's size: how wide a straight way must be for its centre line to hold a chain
    /// of free cells whatever its direction, m.
    pub(super) fn surely_seen_m(&self) -> Option<f32> {
        (!self.is_finest).then_some(2.0 * self.free_m + std::f32::consts::SQRT_2 * self.cell_m)
    }

    /// How many layers of near cells may lie between a free cell and an obstacle.
    pub(super) fn near_layers(&self) -> usize {
        ((self.free_m - self.near_m) / self.cell_m).ceil() as usize + 1
    }

    pub(super) fn len(&self) -> usize {
        self.classes.len()
    }

    pub(super) fn class(&self, cell: usize) -> Class {
        self.classes[cell]
    }

    /// Centre of a cell, m.
    pub(super) fn center(&self, cell: usize) -> Point {
        let (column, row) = (cell % self.stride, cell / self.stride);
        self.first + Vector::new(column as f32, row as f32) * self.cell_m
    }

    /// The cell that holds a point; `None` outside the bounds.
    pub(super) fn cell(&self, point: Point) -> Option<usize> {
        let at = (point - self.first) / self.cell_m + Vector::repeat(0.5);
        self.index(at.x.floor(), at.y.floor())
    }

    /// The four cells whose centres surround a point, with their bilinear weights; `None` outside the bounds.
    pub(super) fn corners(&self, point: Point) -> Option<[(usize, f32); 4]> {
        let at = (point - self.first) / self.cell_m;
        let (column, row) = (at.x.floor(), at.y.floor());
        let cell = self.index(column, row)?;
        let (right, up) = (at.x - column, at.y - row);
        Some([
            (cell, (1.0 - right) * (1.0 - up)),
            (cell + 1, right * (1.0 - up)),
            (cell + self.stride, (1.0 - right) * up),
            (cell + self.stride + 1, right * up),
        ])
    }

    /// A cell with a neighbour on the right and above.
    fn index(&self, column: f32, row: f32) -> Option<usize> {
        let inside =
            column >= 0.0 && row >= 0.0 && column < (self.stride - 1) as f32 && row < (self.rows - 1) as f32;
        inside.then(|| row as usize * self.stride + column as usize)
    }

    /// Cells whose centre lies within `reach_m` of a point, and their distances, m.
    pub(super) fn cells_near(&self, point: Point, reach_m: f32) -> impl Iterator<Item = (usize, f32)> {
        self.rows_within(point.y - reach_m, point.y + reach_m)
            .flat_map(move |row| {
                let columns = self.columns_within(point.x - reach_m, point.x + reach_m);
                columns.map(move |column| row * self.stride + column)
            })
            .map(move |cell| (cell, (self.center(cell) - point).norm()))
            .filter(move |&(_, distance_m)| distance_m <= reach_m)
    }

    /// The eight neighbours of a real cell, each with the two cells that a step to it passes between (the
    /// neighbour itself for a step along an axis).
    pub(super) fn neighbours(&self, cell: usize) -> [(usize, [usize; 2]); 8] {
        let (left, right, down, up) = (cell - 1, cell + 1, cell - self.stride, cell + self.stride);
        [
            (left, [left; 2]),
            (right, [right; 2]),
            (down, [down; 2]),
            (up, [up; 2]),
            (down - 1, [down, left]),
            (down + 1, [down, right]),
            (up - 1, [up, left]),
            (up + 1, [up, right]),
        ]
    }
}

/// Indices in 1..count - 1 whose multiple of `cell_m` lies in an interval.
fn between(low_m: f32, high_m: f32, cell_m: f32, count: usize) -> std::ops::Range<usize> {
    let low = ((low_m / cell_m).ceil().max(1.0) as usize).min(count - 1);
    let high = ((high_m / cell_m).floor() + 1.0).max(0.0) as usize;
    low..high.clamp(low, count - 1)
}
