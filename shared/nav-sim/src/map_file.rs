//! Maps in the format of the ROS map server: a YAML description beside a PGM or PNG image.
//!
//! | key | meaning |
//! |---|---|
//! | `image` | the picture, relative to the description |
//! | `resolution` | side of a pixel, m |
//! | `origin` | pose of the lower left corner of the picture: x (m), y (m), yaw (rad) |
//! | `negate` | 0 or false: dark is occupied; 1 or true: bright is occupied |
//! | `occupied_thresh`, `free_thresh` | occupied above the first, free below the second, else unknown |
//! | `mode` | `trinary` (the default), `scale` or `raw` |
//!
//! Other keys are ignored with a warning. What the modes make of a pixel is what `nav2_map_server` makes of it, in
//! three steps where that has a hundred:
//!
//! | mode | occupancy | transparent pixels |
//! |---|---|---|
//! | `trinary` | darkness (with `negate`, brightness) | transparency counts as a fourth colour |
//! | `scale` | the same | unknown |
//! | `raw` | the value of the pixel in percent, above 100 unknown; `negate` does nothing | as opaque ones |
//!
//! What a robot at the start can see of the occupied cells becomes walls: the edges of the free cells it can
//! reach, merged into segments as long as they go straight. A yaw turns the whole map.

mod description;
mod keys;
mod outline;

use crate::world::{Bounds, World};
use crate::world_file::{WorldProblem, check};
use description::Description;
use image::GenericImageView;
use nav_core::footprint::Footprint;
use nav_core::geometry::{Point, Pose};
use std::path::{Path, PathBuf};

/// Largest side of a map, px.
const SIDE_MAX: u32 = 16_384;

/// How a map is read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapOptions {
    /// Whether cells of which the map knows nothing stop the robot.
    pub unknown_is_occupied: bool,
    /// The robot for which [`Map::into_world`] looks for a path.
    pub footprint: Footprint,
}

impl Default for MapOptions {
    fn default() -> Self {
        Self { unknown_is_occupied: true, footprint: Footprint::circle(0.2) }
    }
}

/// What the map says about a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Cell {
    /// The robot can stand here.
    Free,
    /// An obstacle.
    Occupied,
    /// Nobody has looked.
    Unknown,
}

/// A map: a grid of cells with a pose in the world.
#[derive(Clone, Debug)]
pub struct Map {
    name: String,
    options: MapOptions,
    resolution_m: f32,
    /// `world_from_map`; the map's frame has its origin in the lower left corner of the picture.
    origin: Pose,
    columns: usize,
    rows: usize,
    /// Row by row from the lower left corner.
    cells: Vec<Cell>,
    warnings: Vec<String>,
}

/// Why a map could not be used.
#[derive(Debug, thiserror::Error)]
pub enum MapError {
    /// The description could not be read.
    #[error("cannot read the map {}", .path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// A line of the description makes no sense.
    #[error("{}, line {line}: {message}", .path.display())]
    Syntax {
        /// The file.
        path: PathBuf,
        /// Counted from 1.
        line: usize,
        /// What is wrong.
        message: String,
    },
    /// A key is missing.
    #[error("{} has no `{key}`: is it the description of a ROS map?", .path.display())]
    MissingKey {
        /// The file.
        path: PathBuf,
        /// The key.
        key: &'static str,
    },
    /// The image does not exist or is no image.
    #[error("cannot read the image {} of the map {}: {message}", .image.display(), .path.display())]
    Image {
        /// The description.
        path: PathBuf,
        /// The image.
        image: PathBuf,
        /// What is wrong.
        message: String,
    },
    /// The image has no pixels or too many.
    #[error("the image {} has {width} x {height} px, a map has between 1 and {SIDE_MAX} px a side", .image.display())]
    Size {
        /// The image.
        image: PathBuf,
        /// Width, px.
        width: u32,
        /// Height, px.
        height: u32,
    },
    /// Start or goal lies outside the map, or in a cell that is not free.
    #[error("the {what} at ({x:.2}, {y:.2}) lies {place}; choose a free place of the map")]
    NotFree {
        /// Start or goal.
        what: &'static str,
        /// Where, m.
        x: f32,
        /// Where, m.
        y: f32,
        /// In what it lies.
        place: &'static str,
    },
    /// The world made of the map cannot be used.
    #[error("the map cannot be used: {0}")]
    World(WorldProblem),
}

impl Map {
    /// Reads a description and its image.
    ///
    /// # Errors
    /// A file that is missing or damaged, a key that is missing or makes no sense.
    pub fn load(path: &Path, options: &MapOptions) -> Result<Self, MapError> {
        let text = std::fs::read_to_string(path)
            .map_err(|source| MapError::Read { path: path.to_owned(), source })?;
        let description = Description::parse(path, &text)?;
        let image = path.parent().unwrap_or(Path::new("")).join(&description.image);
        let broken =
            |message: String| MapError::Image { path: path.to_owned(), image: image.clone(), message };
        let picture = image::ImageReader::open(&image)
            .and_then(image::ImageReader::with_guessed_format)
            .map_err(|error| broken(error.to_string()))?
            .decode()
            .map_err(|error| broken(error.to_string()))?;
        let (width, height) = picture.dimensions();
        if width == 0 || height == 0 || width > SIDE_MAX || height > SIDE_MAX {
            return Err(MapError::Size { image, width, height });
        }
        let has_alpha = picture.color().has_alpha();
        let mut freed = 0_u64;
        let cells = (0..height)
            .rev()
            .flat_map(|row| (0..width).map(move |column| (column, row)))
            .map(|(column, row)| {
                let pixel = picture.get_pixel(column, row).0;
                let cell = description.cell(pixel, has_alpha);
                freed += u64::from(description.frees_unknown(pixel, cell));
                cell
            })
            .collect();
        let mut warnings = description.warnings;
        if freed > 0 {
            warnings.push(format!(
                "{}: {freed} pixels of value 205, which map savers write where nobody has looked, are free \
                 here: in an image without transparency, a free_thresh of 0.196 makes them unknown",
                path.display()
            ));
        }
        Ok(Self {
            name: path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned()),
            options: *options,
            resolution_m: description.resolution_m,
            origin: description.origin,
            columns: width as usize,
            rows: height as usize,
            cells,
            warnings,
        })
    }

    /// What may not be meant as it is read, in sentences.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// The world of this map with a start and a goal (m, in the frame that `origin` refers to).
    ///
    /// # Errors
    /// Start or goal not free, or no path from one to the other.
    pub fn into_world(self, start: Pose, goal: Point) -> Result<World, MapError> {
        let first = self.free_index("start", start.position())?;
        self.free_index("goal", goal)?;
        let scale = self.resolution_m;
        let place = |column: usize, row: usize| {
            self.origin.parent_from_local(Point::new(column as f32 * scale, row as f32 * scale))
        };
        let reached = outline::reached(self.columns, first, &self.open_cells());
        let segments = outline::walls(self.columns, &reached, place);
        let corners = [(0, 0), (self.columns, 0), (self.columns, self.rows), (0, self.rows)];
        let corners = corners.map(|(column, row)| place(column, row));
        let bounds = Bounds {
            min: corners.iter().fold(corners[0], |min, corner| min.inf(corner)),
            max: corners.iter().fold(corners[0], |max, corner| max.sup(corner)),
        };
        let world = World {
            name: self.name,
            bounds,
            discs: Vec::new(),
            segments,
            polygons: Vec::new(),
            people: Vec::new(),
            start,
            goal,
        };
        check(&world, &self.options.footprint).map_err(MapError::World)?;
        Ok(world)
    }

    /// Which cells the robot may enter.
    fn open_cells(&self) -> Vec<bool> {
        self.cells.iter().map(|&cell| self.is_open(cell)).collect()
    }

    fn is_open(&self, cell: Cell) -> bool {
        cell == Cell::Free || (cell == Cell::Unknown && !self.options.unknown_is_occupied)
    }

    fn index(&self, point: Point) -> Option<usize> {
        let at = self.origin.local_from_parent(point) / self.resolution_m;
        let is_inside = at.x >= 0.0 && at.y >= 0.0 && at.x < self.columns as f32 && at.y < self.rows as f32;
        is_inside.then(|| at.y as usize * self.columns + at.x as usize)
    }

    fn free_index(&self, what: &'static str, point: Point) -> Result<usize, MapError> {
        let not_free = |place| MapError::NotFree { what, x: point.x, y: point.y, place };
        let index = self.index(point).ok_or_else(|| not_free("outside the map"))?;
        match self.cells[index] {
            cell if self.is_open(cell) => Ok(index),
            Cell::Unknown => Err(not_free("where the map knows nothing")),
            _ => Err(not_free("in an obstacle")),
        }
    }
}

#[cfg(test)]
mod tests;
