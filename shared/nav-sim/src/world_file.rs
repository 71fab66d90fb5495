//! Worlds as TOML files, for scenes made by hand.
//!
//! The file is a [`World`], field by field; `worlds/office.toml` is an example. Points are `[x, y]` in metres.
//! A field that does not exist is an error, and so is a world in which the robot cannot reach its goal.

mod folder;
mod habits;

pub use folder::read_folder;

use crate::body::Body;
use crate::geodesic::{GeodesicField, is_leg_free};
use crate::obstacles::Obstacles;
use crate::world::{COORDINATE_MAX_M, Person, World};
use nav_core::footprint::Footprint;
use nav_core::geometry::Point;
use std::path::{Path, PathBuf};

/// Why a world file was not read or written.
#[derive(Debug, thiserror::Error)]
pub enum WorldFileError {
    /// The file could not be read.
    #[error("cannot read the world {}", .path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The file could not be written.
    #[error("cannot write the world {}", .path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// A folder without world files.
    #[error("{} holds no world: a folder of worlds has files named *.toml", .path.display())]
    Empty {
        /// The folder.
        path: PathBuf,
    },
    /// The text is not a world.
    #[error("{} is not a world: {message}", .path.display())]
    Parse {
        /// The file.
        path: PathBuf,
        /// What is wrong, and in which line.
        message: String,
    },
    /// The world makes no sense.
    #[error("the world {} cannot be used: {problem}", .path.display())]
    Invalid {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        problem: WorldProblem,
    },
    /// The world has a number TOML cannot hold.
    #[error("the world cannot be written as TOML: {0}")]
    Format(toml::ser::Error),
}

/// What is wrong with a world. Items are counted from 0.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum WorldProblem {
    /// A coordinate is infinite or not a number.
    #[error("{0} has a coordinate that is not finite")]
    NotFinite(String),
    /// A coordinate is too large for a robot.
    #[error(
        "{0} lies more than 100 km from the origin, where a robot's coordinates are too coarse: shift the world"
    )]
    TooFar(String),
    /// The bounds enclose nothing.
    #[error("bounds.max must lie to the upper right of bounds.min")]
    Bounds,
    /// A radius or speed is not positive.
    #[error("{what} must be a positive number, it is {value}")]
    NotPositive {
        /// The field.
        what: String,
        /// Its value.
        value: f32,
    },
    /// A polygon is a line.
    #[error("polygon {index} has {count} vertices, it needs at least 3")]
    Vertices {
        /// Which polygon.
        index: usize,
        /// How many vertices it has.
        count: usize,
    },
    /// A person has nowhere to go.
    #[error("person {0} has no waypoints, give at least one")]
    NoWaypoints(usize),
    /// A place beside somebody makes no sense.
    #[error("person {person} cannot walk beside anybody: {problem}")]
    Beside {
        /// Which person.
        person: usize,
        /// What is wrong.
        problem: &'static str,
    },
    /// A stop makes no sense.
    #[error("person {person} cannot stop: {problem}")]
    Stop {
        /// Which person.
        person: usize,
        /// What is wrong.
        problem: &'static str,
    },
    /// Somebody stands in an obstacle or outside the bounds.
    #[error(
        "{what} at ({x:.2}, {y:.2}) stands in an obstacle or outside the bounds: it needs {radius_m} m of room"
    )]
    Blocked {
        /// Who.
        what: String,
        /// Where, m.
        x: f32,
        /// Where, m.
        y: f32,
        /// The radius that does not fit, m.
        radius_m: f32,
    },
    /// The robot does not fit to its start as it is turned there.
    #[error(
        "the start at ({x:.2}, {y:.2}) is too narrow for a robot of {footprint}, turned as it is there: move or turn it"
    )]
    BlockedStart {
        /// Where, m.
        x: f32,
        /// Where, m.
        y: f32,
        /// The robot.
        footprint: Footprint,
    },
    /// A leg of a person's round leads through an obstacle.
    #[error("person {person} would walk through an obstacle on the way to waypoint {waypoint}")]
    Leg {
        /// Which person.
        person: usize,
        /// Where the leg ends.
        waypoint: usize,
    },
    /// The goal cannot be reached.
    #[error("no path for a robot {} m wide leads from the start to the goal", 2.0 * radius_m)]
    NoPath {
        /// Radius of the robot, or half of its width, m.
        radius_m: f32,
    },
    /// The goal cannot be reached on wide ways, and the world is too large to look for narrow ones.
    #[error(
        "no way of {width_m:.1} m or more leads from the start to the goal, and in a world this large narrower ones are \
         not seen: cut out the part that the robot needs"
    )]
    NoWideWay {
        /// Ways of this width are seen, m.
        width_m: f32,
    },
}

/// Reads a world and checks it for a robot.
///
/// # Errors
/// A file that cannot be read, is not a world, or is one that makes no sense: see [`check`].
pub fn load(path: &Path, footprint: &Footprint) -> Result<World, WorldFileError> {
    let text = std::fs::read_to_string(path)
        .map_err(|source| WorldFileError::Read { path: path.to_owned(), source })?;
    let world = toml::from_str(&text).map_err(|error| WorldFileError::Parse {
        path: path.to_owned(),
        message: error.to_string().trim_end().to_owned(),
    })?;
    check(&world, footprint).map_err(|problem| WorldFileError::Invalid { path: path.to_owned(), problem })?;
    Ok(world)
}

/// Writes a world as TOML.
///
/// # Errors
/// A file that cannot be written.
pub fn save(path: &Path, world: &World) -> Result<(), WorldFileError> {
    let text = toml::to_string_pretty(world).map_err(WorldFileError::Format)?;
    std::fs::write(path, text).map_err(|source| WorldFileError::Write { path: path.to_owned(), source })
}

/// Whether a robot can use a world: shapes that exist, people who can walk their rounds, start and goal free (a rectangle need
/// only stand at the goal in some direction), and a path between them.
///
/// # Errors
/// The first thing that is wrong.
pub fn check(world: &World, footprint: &Footprint) -> Result<(), WorldProblem> {
    check_numbers(world)?;
    let obstacles = Obstacles::new(world);
    let fits = |what: &str, at: Point, radius_m: f32| {
        if obstacles.collides(at, radius_m) {
            Err(WorldProblem::Blocked { what: what.to_owned(), x: at.x, y: at.y, radius_m })
        } else {
            Ok(())
        }
    };
    let start = world.start.position();
    fits("the start", start, footprint.half_width_m())?;
    if obstacles.touches(&Body::new(*footprint, world.start)) {
        return Err(WorldProblem::BlockedStart { x: start.x, y: start.y, footprint: *footprint });
    }
    fits("the goal", world.goal, footprint.half_width_m())?;
    for (index, person) in world.people.iter().enumerate() {
        fits(&format!("person {index}"), person.start, person.radius_m)?;
        let beside = |problem| WorldProblem::Beside { person: index, problem };
        habits::check_beside(&world.people, index, footprint.circumradius_m()).map_err(beside)?;
        habits::check_stop(person).map_err(|problem| WorldProblem::Stop { person: index, problem })?;
        if person.beside.is_none() {
            check_round(&obstacles, index, person)?;
        }
    }
    let field = GeodesicField::new(world, footprint);
    field.distance_m(start).map(|_| ()).ok_or_else(|| match field.surely_seen_m() {
        None => WorldProblem::NoPath { radius_m: footprint.half_width_m() },
        Some(width_m) => WorldProblem::NoWideWay { width_m },
    })
}

fn check_round(obstacles: &Obstacles, index: usize, person: &Person) -> Result<(), WorldProblem> {
    let Some(&last) = person.waypoints.last() else { return Err(WorldProblem::NoWaypoints(index)) };
    let from_start = (person.start, person.waypoints[0], 0);
    let round = std::iter::once(&last).chain(&person.waypoints).zip(&person.waypoints).enumerate();
    std::iter::once(from_start)
        .chain(round.map(|(waypoint, (&from, &to))| (from, to, waypoint)))
        .find(|&(from, to, _)| !is_leg_free(obstacles, from, to, person.radius_m))
        .map_or(Ok(()), |(_, _, waypoint)| Err(WorldProblem::Leg { person: index, waypoint }))
}

fn check_numbers(world: &World) -> Result<(), WorldProblem> {
    let usable = |what: String, points: &[Point]| {
        let all = |is_fine: fn(f32) -> bool| points.iter().all(|point| is_fine(point.x) && is_fine(point.y));
        if !all(f32::is_finite) {
            Err(WorldProblem::NotFinite(what))
        } else if !all(|m| m.abs() <= COORDINATE_MAX_M) {
            Err(WorldProblem::TooFar(what))
        } else {
            Ok(())
        }
    };
    let positive = |what: String, value: f32| {
        let is_positive = value > 0.0 && value.is_finite();
        if is_positive { Ok(()) } else { Err(WorldProblem::NotPositive { what, value }) }
    };
    usable("bounds".into(), &[world.bounds.min, world.bounds.max])?;
    let size = world.bounds.max - world.bounds.min;
    if size.x <= 0.0 || size.y <= 0.0 {
        return Err(WorldProblem::Bounds);
    }
    usable("the start".into(), &[world.start.position(), Point::new(world.start.yaw_rad, 0.0)])?;
    usable("the goal".into(), &[world.goal])?;
    for (index, disc) in world.discs.iter().enumerate() {
        usable(format!("disc {index}"), &[disc.center])?;
        positive(format!("radius_m of disc {index}"), disc.radius_m)?;
    }
    for (index, segment) in world.segments.iter().enumerate() {
        usable(format!("segment {index}"), &[segment.a, segment.b])?;
    }
    for (index, polygon) in world.polygons.iter().enumerate() {
        usable(format!("polygon {index}"), &polygon.vertices)?;
        let count = polygon.vertices.len();
        if count < 3 {
            return Err(WorldProblem::Vertices { index, count });
        }
    }
    for (index, person) in world.people.iter().enumerate() {
        usable(format!("person {index}"), &[person.start])?;
        usable(format!("a waypoint of person {index}"), &person.waypoints)?;
        positive(format!("radius_m of person {index}"), person.radius_m)?;
        positive(format!("speed_mps of person {index}"), person.speed_mps)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests;
