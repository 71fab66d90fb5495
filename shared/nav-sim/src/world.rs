//! What a world is: static obstacles, people, a start and a goal.

use nav_core::geometry::{Point, Pose};
use serde::{Deserialize, Serialize};

/// No coordinate of a world may be larger, m. Beyond, a 32-bit number has steps of a centimetre, and the robot takes
/// coordinates for broken.
pub const COORDINATE_MAX_M: f32 = 1e5;

/// An axis-aligned rectangle, m. Nothing outside a world's bounds can be driven on.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bounds {
    /// Lower left corner, m.
    pub min: Point,
    /// Upper right corner, m.
    pub max: Point,
}

/// A round obstacle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Disc {
    /// Centre, m.
    pub center: Point,
    /// Radius, m.
    pub radius_m: f32,
}

/// A thin wall.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Segment {
    /// One end, m.
    pub a: Point,
    /// The other end, m.
    pub b: Point,
}

/// A solid obstacle: simple, either winding, at least three vertices. Its inside collides too.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Polygon {
    /// Corners in order, m.
    pub vertices: Vec<Point>,
}

/// How a person walks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum WalkModel {
    /// From waypoint to waypoint, through everybody.
    Scripted,
    /// From waypoint to waypoint, waiting for whoever is close ahead.
    ScriptedYielding,
    /// Social force (Helbing and Molnár 1995).
    SocialForce,
    /// Optimal reciprocal collision avoidance (van den Berg et al. 2011).
    Orca,
}

/// A walking person: a disc that goes round its waypoints for ever.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Person {
    /// Where the person stands at reset, m.
    pub start: Point,
    /// Visited in order, then from the first again, m; at least one, and with a single one the person stays there. None
    /// for those who walk beside somebody.
    #[serde(default)]
    pub waypoints: Vec<Point>,
    /// Radius, m.
    pub radius_m: f32,
    /// Preferred speed, m/s.
    pub speed_mps: f32,
    /// How the person walks.
    pub model: WalkModel,
    /// Whether the person sees the robot and makes room for it. Those who walk [`WalkModel::Scripted`] see nobody,
    /// whatever this says.
    pub sees_robot: bool,
    /// Whom the person walks beside, instead of going its own way.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub beside: Option<Beside>,
    /// Where the person stops on its round.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stop: Option<Stop>,
}

/// A place beside somebody who walks: people with places beside the same person are a group.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Beside {
    /// Beside whom.
    pub whom: Whom,
    /// From the other's centre to this person's, to the left, m; negative to the right. It changes sides when the other
    /// turns round. Where there is no room, the person walks as far behind.
    pub left_m: f32,
}

/// Whom somebody walks beside.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Whom {
    /// The robot.
    Robot,
    /// Another person, by its place in the list of people, counted from 0.
    Person(usize),
}

/// A stop on a round.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stop {
    /// At which waypoint, counted from 0.
    pub waypoint: usize,
    /// For how long at least and at most, s; drawn anew each time.
    pub seconds: [f32; 2],
    /// How likely the person then goes back where it came from.
    pub turns_round: f32,
}

/// A world with one start and one goal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct World {
    /// Where it comes from, for people: a family and seed, or a file.
    pub name: String,
    /// Its edge is a wall.
    pub bounds: Bounds,
    /// Round obstacles.
    #[serde(default)]
    pub discs: Vec<Disc>,
    /// Thin walls.
    #[serde(default)]
    pub segments: Vec<Segment>,
    /// Solid obstacles.
    #[serde(default)]
    pub polygons: Vec<Polygon>,
    /// Walking people.
    #[serde(default)]
    pub people: Vec<Person>,
    /// Where the robot stands at reset. At reset the `odom` frame coincides with the world frame.
    pub start: Pose,
    /// Where it must go, m.
    pub goal: Point,
}

impl World {
    /// Lays everything out by a factor larger. People walk farther, but stay as large and as fast as they are, and as near
    /// to each other where they walk together.
    pub(crate) fn grow(&mut self, factor: f32) {
        let points = [&mut self.bounds.min, &mut self.bounds.max, &mut self.goal].into_iter();
        let points = points
            .chain(self.discs.iter_mut().map(|disc| &mut disc.center))
            .chain(self.segments.iter_mut().flat_map(|segment| [&mut segment.a, &mut segment.b]))
            .chain(self.polygons.iter_mut().flat_map(|polygon| &mut polygon.vertices));
        points.for_each(|point| *point *= factor);
        self.discs.iter_mut().for_each(|disc| disc.radius_m *= factor);
        for person in &mut self.people {
            person.start *= factor;
            person.waypoints.iter_mut().for_each(|point| *point *= factor);
        }
        (self.start.x_m, self.start.y_m) = (self.start.x_m * factor, self.start.y_m * factor);
    }
}

impl Bounds {
    /// Whether a point lies inside or on the edge.
    pub fn contains(&self, point: Point) -> bool {
        (self.min.x..=self.max.x).contains(&point.x) && (self.min.y..=self.max.y).contains(&point.y)
    }

    /// The four walls, counter-clockwise from the lower left corner.
    pub fn edges(&self) -> [Segment; 4] {
        let corners =
            [self.min, Point::new(self.max.x, self.min.y), self.max, Point::new(self.min.x, self.max.y)];
        [0, 1, 2, 3].map(|k| Segment { a: corners[k], b: corners[(k + 1) % 4] })
    }
}
