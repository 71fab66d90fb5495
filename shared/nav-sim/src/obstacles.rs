//! The static part of a world, prepared for fast questions: edges and discs in a uniform grid.
//!
//! Bounds and polygons become edges like any wall; a polygon also remembers that its inside is solid. A small
//! world is one cell. A large one (an imported map) has cells of about a metre; longer edges are cut to the
//! size of a cell, so that each piece belongs to exactly one cell (that of its middle) and a question never
//! meets a piece twice.

mod grid;

use crate::body::Body;
use crate::collision::{closest_on_segment, is_inside};
use crate::world::{Bounds, Disc, Segment, World};
use grid::{Cells, Grid};
use nav_core::footprint::Footprint;
use nav_core::geometry::{Point, Vector};

/// Up to this many edges and discs are one cell.
const SINGLE_CELL_MAX: usize = 128;
/// Side of the cells of larger worlds, m.
const CELL_M: f32 = 1.0;
/// An edge is cut into so many pieces at most.
const PIECES_MAX: usize = 4096;
/// The grid ends this far from the origin at most, m; what lies beyond is in its border cells.
const GRID_END_M: f32 = 1e6;
/// Edges shorter than this are dropped, m.
const EDGE_MIN_M: f32 = 1e-6;

/// The static obstacles of a world, bounds included.
#[derive(Clone, Debug)]
pub struct Obstacles {
    bounds: Bounds,
    grid: Grid,
    /// How far an item can reach out of the cell of its middle, m.
    slack_m: f32,
    edges: Cells<Segment>,
    discs: Cells<Disc>,
    solids: Vec<Solid>,
    vertices: Vec<Point>,
}

/// A polygon: a range of vertices, and the box around them.
#[derive(Clone, Copy, Debug)]
struct Solid {
    around: Bounds,
    first: usize,
    end: usize,
}

impl Obstacles {
    /// Prepares a world. Items with numbers that are not finite are left out.
    pub fn new(world: &World) -> Self {
        let mut obstacles = Self {
            bounds: world.bounds,
            grid: Grid::single(),
            slack_m: 0.0,
            edges: Cells::default(),
            discs: Cells::default(),
            solids: Vec::new(),
            vertices: Vec::new(),
        };
        obstacles.rebuild(world);
        obstacles
    }

    /// Prepares another world in the same memory.
    pub fn rebuild(&mut self, world: &World) {
        self.bounds = world.bounds;
        let count = 4 + world.discs.len() + edges_of(world).count();
        self.grid = if count > SINGLE_CELL_MAX { covering(world) } else { Grid::single() };
        self.edges.clear();
        self.discs.clear();
        self.slack_m = 0.0;
        for edge in world.bounds.edges().into_iter().chain(edges_of(world)) {
            self.stage_edge(edge);
        }
        for &disc in world.discs.iter().filter(|disc| is_finite(disc.center) && disc.radius_m.is_finite()) {
            self.discs.stage(self.grid.cell(disc.center), disc);
            self.slack_m = self.slack_m.max(disc.radius_m);
        }
        self.edges.sort(self.grid.len());
        self.discs.sort(self.grid.len());
        self.solids.clear();
        self.vertices.clear();
        for polygon in &world.polygons {
            self.push_solid(&polygon.vertices);
        }
    }

    fn stage_edge(&mut self, edge: Segment) {
        let along = edge.b - edge.a;
        let length_m = along.norm();
        if !length_m.is_finite() || length_m < EDGE_MIN_M {
            return;
        }
        let pieces = ((length_m / self.grid.cell_m) as usize + 1).min(PIECES_MAX);
        let mut from = edge.a;
        for piece in 1..=pieces {
            // Pieces share their ends exactly, so that no beam passes between them.
            let to = if piece == pieces { edge.b } else { edge.a + along * (piece as f32 / pieces as f32) };
            self.edges.stage(self.grid.cell(nalgebra::center(&from, &to)), Segment { a: from, b: to });
            from = to;
        }
        self.slack_m = self.slack_m.max(0.51 * length_m / pieces as f32);
    }

    fn push_solid(&mut self, vertices: &[Point]) {
        let first = self.vertices.len();
        self.vertices.extend_from_slice(vertices);
        let (min, max) = vertices.iter().fold(
            (Point::new(f32::INFINITY, f32::INFINITY), Point::new(f32::NEG_INFINITY, f32::NEG_INFINITY)),
            |(min, max), vertex| (min.inf(vertex), max.sup(vertex)),
        );
        self.solids.push(Solid { around: Bounds { min, max }, first, end: self.vertices.len() });
    }

    /// Distance from a point to the nearest obstacle, m. Negative inside a disc or polygon and outside the
    /// bounds: then minus the distance to the edge of whatever holds the point.
    ///
    /// `cap_m` bounds the search: a larger distance is reported as `cap_m`.
    pub fn distance_m(&self, point: Point, cap_m: f32) -> f32 {
        let (mut edge_m2, mut disc_m) = (cap_m * cap_m, cap_m);
        for (edges, discs) in self.near(point, cap_m) {
            for edge in edges {
                edge_m2 = edge_m2.min((point - closest_on_segment(point, edge)).norm_squared());
            }
            for disc in discs {
                disc_m = disc_m.min((point - disc.center).norm() - disc.radius_m);
            }
        }
        let edge_m = edge_m2.sqrt();
        if self.is_in_solid(point) { (-edge_m).min(disc_m) } else { edge_m.min(disc_m) }
    }

    /// Whether a round footprint touches an obstacle, lies inside one, or leaves the bounds.
    pub fn collides(&self, center: Point, radius_m: f32) -> bool {
        self.near(center, radius_m).any(|(edges, discs)| {
            edges
                .iter()
                .any(|edge| (center - closest_on_segment(center, edge)).norm_squared() < radius_m * radius_m)
                || discs.iter().any(|disc| {
                    let reach_m = radius_m + disc.radius_m;
                    (center - disc.center).norm_squared() < reach_m * reach_m
                })
        }) || self.is_in_solid(center)
    }

    /// Whether a footprint touches an obstacle, lies inside one, or leaves the bounds.
    pub fn touches(&self, body: &Body) -> bool {
        let position = body.position();
        if let Footprint::Circle { radius_m } = *body.footprint() {
            return self.collides(position, radius_m);
        }
        self.near(position, body.footprint().circumradius_m()).any(|(edges, discs)| {
            edges.iter().any(|edge| body.touches_edge(edge))
                || discs.iter().any(|disc| body.touches_disc(disc, 0.0))
        }) || self.is_in_solid(position)
    }

    /// From a footprint's outline to the nearest obstacle, m, negative where it touches one; at most `cap_m`.
    pub fn clearance_m(&self, body: &Body, cap_m: f32) -> f32 {
        let position = body.position();
        if let Footprint::Circle { radius_m } = *body.footprint() {
            return self.distance_m(position, cap_m + radius_m) - radius_m;
        }
        let mut nearest_m = cap_m;
        for (edges, discs) in self.near(position, cap_m + body.footprint().circumradius_m()) {
            for edge in edges {
                nearest_m = nearest_m.min(body.distance_to_edge_m(edge));
            }
            for disc in discs {
                nearest_m = nearest_m.min(body.distance_to_disc_m(disc));
            }
        }
        if self.is_in_solid(position) { -nearest_m.abs() } else { nearest_m }
    }

    /// Whether a point lies inside a polygon or outside the bounds.
    fn is_in_solid(&self, point: Point) -> bool {
        !self.bounds.contains(point)
            || self.solids.iter().any(|solid| {
                solid.around.contains(point) && is_inside(point, &self.vertices[solid.first..solid.end])
            })
    }

    /// All edges and discs within `reach_m` of a point, and some that are farther.
    pub(crate) fn near(&self, point: Point, reach_m: f32) -> impl Iterator<Item = (&[Segment], &[Disc])> {
        let reach = Vector::repeat(reach_m);
        self.touching(point - reach, point + reach)
    }

    /// All edges and discs that touch the rectangle from `low` to `high`, and some that do not.
    pub(crate) fn touching(&self, low: Point, high: Point) -> impl Iterator<Item = (&[Segment], &[Disc])> {
        let slack = Vector::repeat(self.slack_m);
        self.grid
            .cells_in(low - slack, high + slack)
            .map(|cells| (self.edges.of(cells.clone()), self.discs.of(cells)))
    }

    /// Edges and discs in rings round a point, with the distance (m) below which no item of that ring lies.
    pub(crate) fn rings(
        &self,
        point: Point,
    ) -> impl Iterator<Item = (f32, impl Iterator<Item = (&[Segment], &[Disc])>)> {
        (0..).map_while(move |ring| {
            let cells = self.grid.ring(point, ring)?;
            let beyond_m = if ring == 0 { 0.0 } else { (ring - 1) as f32 * self.grid.cell_m - self.slack_m };
            Some((beyond_m, cells.map(|cells| (self.edges.of(cells.clone()), self.discs.of(cells)))))
        })
    }
}

/// Every wall and polygon edge of a world, without the bounds.
fn edges_of(world: &World) -> impl Iterator<Item = Segment> {
    let polygon_edges = world.polygons.iter().flat_map(|polygon| {
        let ends = polygon.vertices.iter().cycle().skip(1);
        polygon.vertices.iter().zip(ends).map(|(&a, &b)| Segment { a, b })
    });
    world.segments.iter().copied().chain(polygon_edges)
}

fn covering(world: &World) -> Grid {
    let ends = edges_of(world).flat_map(|edge| [edge.a, edge.b]);
    let points = ends.chain(world.discs.iter().map(|disc| disc.center)).filter(|&point| is_finite(point));
    let (min, max) = points
        .fold((world.bounds.min, world.bounds.max), |(min, max), point| (min.inf(&point), max.sup(&point)));
    let within = |point: Point| point.map(|coordinate| coordinate.clamp(-GRID_END_M, GRID_END_M));
    Grid::covering(within(min), within(max), CELL_M)
}

fn is_finite(point: Point) -> bool {
    point.x.is_finite() && point.y.is_finite()
}
