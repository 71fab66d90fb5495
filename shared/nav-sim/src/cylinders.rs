//! Lists of cylinders, as benchmarks publish their worlds: one CSV file, a row for each cylinder.
//!
//! | column | meaning |
//! |---|---|
//! | `world` | which world it stands in: a name of letters, digits, `-` and `_` |
//! | `x_m`, `y_m` | its centre, m |
//! | `radius_m` | its radius, m |
//!
//! The first line names the columns, in any order; others are left out. Worlds come in the order of their first rows.

use crate::world::{Bounds, COORDINATE_MAX_M, Disc, World};
use nav_core::geometry::{Point, Pose, Vector};
use std::path::{Path, PathBuf};

const COLUMNS: [&str; 4] = ["world", "x_m", "y_m", "radius_m"];

/// What a list of cylinders does not say.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surroundings {
    /// Where the robot starts in every world.
    pub start: Pose,
    /// Where it must go, m.
    pub goal: Point,
    /// From whatever reaches farthest out, start and goal included, to the wall round the world, m.
    pub margin_m: f32,
}

/// Why a list of cylinders was not read.
#[derive(Debug, thiserror::Error)]
pub enum CylinderError {
    /// The file could not be read.
    #[error("cannot read the list of cylinders {}", .path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The first line does not name a column.
    #[error("{} has no column `{column}`: its first line must name the columns world, x_m, y_m and radius_m", .path.display())]
    MissingColumn {
        /// The file.
        path: PathBuf,
        /// The column.
        column: &'static str,
    },
    /// A row has too few or too many cells, or is no text.
    #[error("{}, line {line}: {message}", .path.display())]
    Row {
        /// The file.
        path: PathBuf,
        /// Counted from 1.
        line: u64,
        /// What is wrong.
        message: String,
    },
    /// A cell makes no sense.
    #[error("{}, line {line}, column {column}: {message}", .path.display())]
    Cell {
        /// The file.
        path: PathBuf,
        /// Counted from 1.
        line: u64,
        /// The column's name.
        column: &'static str,
        /// What is wrong.
        message: String,
    },
    /// There is no row.
    #[error("{} lists no cylinders", .path.display())]
    Empty {
        /// The file.
        path: PathBuf,
    },
}

/// Reads the worlds of a list. Whether a robot can drive in them is for [`crate::world_file::check`] to say.
///
/// # Errors
/// The first line, column or cell that makes no sense.
pub fn read(path: &Path, surroundings: &Surroundings) -> Result<Vec<World>, CylinderError> {
    let broken = |error: csv::Error| {
        let line = error.position().map_or(1, csv::Position::line);
        match error.into_kind() {
            csv::ErrorKind::Io(source) => CylinderError::Read { path: path.to_owned(), source },
            csv::ErrorKind::UnequalLengths { expected_len, len, .. } => CylinderError::Row {
                path: path.to_owned(),
                line,
                message: format!("{len} cells, the first line has {expected_len}"),
            },
            _ => CylinderError::Row { path: path.to_owned(), line, message: "this is not UTF-8".into() },
        }
    };
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_path(path).map_err(broken)?;
    let header = reader.headers().map_err(broken)?;
    let mut at = [0; COLUMNS.len()];
    for (at, column) in at.iter_mut().zip(COLUMNS) {
        *at = header
            .iter()
            .position(|name| name == column)
            .ok_or_else(|| CylinderError::MissingColumn { path: path.to_owned(), column })?;
    }
    let mut worlds: Vec<(String, Vec<Disc>)> = Vec::new();
    let mut row = csv::StringRecord::new();
    while reader.read_record(&mut row).map_err(broken)? {
        let row = Row { path, at: &at, cells: &row };
        let (name, disc) = (row.name()?, row.disc()?);
        // Rows of a world mostly follow each other.
        match worlds.iter_mut().rev().find(|(known, _)| known == name) {
            Some((_, discs)) => discs.push(disc),
            None => worlds.push((name.to_owned(), vec![disc])),
        }
    }
    if worlds.is_empty() {
        return Err(CylinderError::Empty { path: path.to_owned() });
    }
    let list = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
    Ok(worlds.into_iter().map(|(name, discs)| surroundings.world(format!("{list}_{name}"), discs)).collect())
}

impl Surroundings {
    fn world(&self, name: String, discs: Vec<Disc>) -> World {
        let ends = [self.start.position(), self.goal].map(|end| Bounds { min: end, max: end });
        let boxes = discs.iter().map(|disc| {
            let reach = Vector::repeat(disc.radius_m);
            Bounds { min: disc.center - reach, max: disc.center + reach }
        });
        let around = boxes
            .chain([ends[1]])
            .fold(ends[0], |all, one| Bounds { min: all.min.inf(&one.min), max: all.max.sup(&one.max) });
        let margin = Vector::repeat(self.margin_m);
        World {
            name,
            bounds: Bounds { min: around.min - margin, max: around.max + margin },
            discs,
            segments: Vec::new(),
            polygons: Vec::new(),
            people: Vec::new(),
            start: self.start,
            goal: self.goal,
        }
    }
}

/// A row with the places of its columns.
struct Row<'a> {
    path: &'a Path,
    at: &'a [usize; COLUMNS.len()],
    cells: &'a csv::StringRecord,
}

impl<'a> Row<'a> {
    fn name(&self) -> Result<&'a str, CylinderError> {
        let name = self.cell(0);
        let is_plain = |letter: char| letter.is_alphanumeric() || letter == '-' || letter == '_';
        if name.is_empty() || !name.chars().all(is_plain) {
            return Err(self.wrong(0, format!("{name:?} cannot name a world: use letters, digits, - and _")));
        }
        Ok(name)
    }

    fn disc(&self) -> Result<Disc, CylinderError> {
        let radius_m = self.number(3)?;
        if radius_m <= 0.0 {
            return Err(self.wrong(3, format!("a radius must be positive, this one is {radius_m} m")));
        }
        Ok(Disc { center: Point::new(self.number(1)?, self.number(2)?), radius_m })
    }

    fn number(&self, column: usize) -> Result<f32, CylinderError> {
        let cell = self.cell(column);
        match cell.parse::<f32>() {
            Ok(number) if number.abs() <= COORDINATE_MAX_M => Ok(number),
            Ok(number) if number.is_finite() => {
                Err(self.wrong(column, format!("{cell} is beyond 100 km: shift the worlds")))
            }
            _ => Err(self.wrong(column, format!("{cell:?} is not a number"))),
        }
    }

    fn cell(&self, column: usize) -> &'a str {
        self.cells.get(self.at[column]).unwrap_or_default()
    }

    fn wrong(&self, column: usize, message: String) -> CylinderError {
        let line = self.cells.position().map_or(1, csv::Position::line);
        CylinderError::Cell { path: self.path.to_owned(), line, column: COLUMNS[column], message }
    }
}

#[cfg(test)]
mod tests;
