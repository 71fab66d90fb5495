//! Scene families: seeded generators of worlds, each of which has a way from start to goal.
//!
//! | family | scene | it tests |
//! |---|---|---|
//! | `clutter` | 14 x 14 m, 15-25 discs of 0.2-0.6 m | easy driving |
//! | `boxes` | 10 x 10 m room, 4 boxes | easy driving |
//! | `u_trap` | a U 2.5-5 m wide and 2-4.5 m deep between start and goal | horizon |
//! | `deep_u` | the same, 6-9 m deep in 20 x 20 m: deeper than the lidar sees | memory |
//! | `hook` | a U with lips that leave a mouth of 1.4 m | generalisation; held out |
//! | `maze` | 7 x 7 cells of 2 m, depth first, 15 % braided | memory |
//! | `maze_tight` | 8 x 8 cells of 1.6 m | memory and control; held out |
//! | `rooms` | 3 x 3 rooms, doors of 1.0-1.4 m, 0-7 discs | horizon and control |
//! | `crowd` | open floor, 14-24 people | people |
//! | `stream` | two rooms, 8-16 people streaming through the shorter passage between them | people; held out |
//! | `tight` | gaps, corridors of 0.72-1.2 m and corners | control; for training the low level |
//! | `corridor` | two halls and a corridor of 2.4-3.4 m, 4-7 groups coming towards each other | people; held out |
//! | `doorway` | two rooms and one door of 1.3-1.8 m, 3-6 groups coming through, some stopping in it | people; held out |
//!
//! All lengths are those of the reference robot ([`nav_core::scale`]): another robot gets the same world in its own size, so
//! that a door is as wide for a large robot as for a small one. People stay as large and as fast as they are; so that they
//! have room, worlds with people are not made smaller for a smaller robot.
//!
//! A world is a pure function of family, split, seed and the robot's size. The splits draw from disjoint generator states, and
//! the people of the test split may walk faster and be larger than any in training. In `corridor` and `doorway` people
//! are in every split as they are measured (`pedestrians.rs`): mostly faster than the robot, and in groups.

mod generate;
mod dice;
mod scene;
mod people;

mod open;
mod trap;
mod maze;
mod rooms;
mod stream;
mod tight;
mod pedestrians;
mod corridor;

pub use generate::{generate, generate_with_field, simulation_seed};

use crate::world::World;
use dice::Dice;
use nav_core::footprint::Footprint;
use nav_core::scale::{REFERENCE_RADIUS_M, Scale, length_of};
use nav_core::task::{EPISODE_S, Robot, Task};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// Every generated world has a path for a footprint of this radius and [`crate::geodesic::PATH_MARGIN_M`], m of the
/// reference robot.
pub const DESIGN_RADIUS_M: f32 = REFERENCE_RADIUS_M;
/// The longest shortest path of a generated world, m of the reference robot: half of what it can drive in an episode.
pub const PATH_MAX_M: f32 = 26.0;

/// A generator of worlds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Family {
    /// Discs everywhere.
    Clutter,
    /// A room with four boxes.
    Boxes,
    /// A dead end the lidar can see whole.
    UTrap,
    /// A dead end deeper than the lidar sees.
    DeepU,
    /// A dead end with a narrow mouth; held out.
    Hook,
    /// A maze with wide corridors.
    Maze,
    /// A larger maze with narrower corridors; held out.
    MazeTight,
    /// Rooms joined by doors.
    Rooms,
    /// People on an open floor.
    Crowd,
    /// People streaming through the shorter of several passages; held out.
    Stream,
    /// Narrow gaps, corridors and corners.
    Tight,
    /// Counter-flow in a corridor between two halls; held out.
    Corridor,
    /// A door with people coming through; held out.
    Doorway,
}

/// Which worlds of a family: no two splits share one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Split {
    /// To learn from.
    Train,
    /// To choose settings and checkpoints with.
    Validation,
    /// To report.
    Test,
}

impl Family {
    /// All families, in the order of reports.
    pub const ALL: [Self; 13] = [
        Self::Clutter,
        Self::Boxes,
        Self::UTrap,
        Self::DeepU,
        Self::Hook,
        Self::Maze,
        Self::MazeTight,
        Self::Rooms,
        Self::Crowd,
        Self::Stream,
        Self::Tight,
        Self::Corridor,
        Self::Doorway,
    ];

    /// Its name in configurations, on command lines and in results.
    pub const fn id(self) -> &'static str {
        match self {
            Self::Clutter => "clutter",
            Self::Boxes => "boxes",
            Self::UTrap => "u_trap",
            Self::DeepU => "deep_u",
            Self::Hook => "hook",
            Self::Maze => "maze",
            Self::MazeTight => "maze_tight",
            Self::Rooms => "rooms",
            Self::Crowd => "crowd",
            Self::Stream => "stream",
            Self::Tight => "tight",
            Self::Corridor => "corridor",
            Self::Doorway => "doorway",
        }
    }

    /// Whether a policy may be trained on it. The held-out families measure generalisation.
    pub const fn trainable(self) -> bool {
        !matches!(self, Self::Hook | Self::MazeTight | Self::Stream | Self::Corridor | Self::Doorway)
    }

    /// Whether people walk in its worlds.
    pub const fn has_people(self) -> bool {
        matches!(self, Self::Crowd | Self::Stream | Self::Corridor | Self::Doorway)
    }

    /// How long an episode takes at most, s: distance over speed, with a factor of 1.9 over the longest way
    /// ([`PATH_MAX_M`]), and of 3.1 where the way must first be found.
    pub fn episode_s(self, robot: &Robot) -> f32 {
        let reference_s = match self {
            Self::DeepU | Self::Maze | Self::MazeTight => 80.0,
            _ => EPISODE_S,
        };
        let scale = Scale::of(robot);
        // A world that is larger than the robot's own size takes longer.
        scale.s(reference_s) * (self.world_length(&robot.footprint) / scale.length)
    }

    /// The factor by which its worlds are larger than those of the reference robot.
    pub fn world_length(self, footprint: &Footprint) -> f32 {
        let length = length_of(footprint);
        if self.has_people() { length.max(1.0) } else { length }
    }

    /// The least ratio of shortest path to straight line: a maze in which both ends see each other tests nothing.
    const fn detour_min(self) -> f32 {
        match self {
            Self::Maze | Self::MazeTight => 1.3,
            _ => 1.0,
        }
    }

    /// How far the start must lie from the goal, m, where it may lie anywhere.
    const fn free_start_m(self) -> Option<f32> {
        match self {
            Self::Maze => Some(maze::MAZE.apart_m),
            Self::MazeTight => Some(maze::MAZE_TIGHT.apart_m),
            _ => None,
        }
    }

    fn draft(self, dice: &mut Dice, split: Split) -> Option<World> {
        match self {
            Self::Clutter => open::clutter(dice),
            Self::Boxes => open::boxes(dice),
            Self::UTrap => trap::draft(dice, &trap::U_TRAP),
            Self::DeepU => trap::draft(dice, &trap::DEEP_U),
            Self::Hook => trap::draft(dice, &trap::HOOK),
            Self::Maze => maze::draft(dice, &maze::MAZE),
            Self::MazeTight => maze::draft(dice, &maze::MAZE_TIGHT),
            Self::Rooms => rooms::draft(dice),
            Self::Crowd => open::crowd(dice, split),
            Self::Stream => stream::draft(dice, split),
            Self::Tight => tight::draft(dice),
            Self::Corridor => corridor::corridor(dice),
            Self::Doorway => corridor::doorway(dice),
        }
    }
}

impl Split {
    /// Its name in configurations, on command lines and in results.
    pub const fn id(self) -> &'static str {
        match self {
            Self::Train => "train",
            Self::Validation => "validation",
            Self::Test => "test",
        }
    }
}

impl fmt::Display for Family {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(self.id())
    }
}

impl fmt::Display for Split {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(self.id())
    }
}

/// A name that no family, split or disturbance has.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("there is no {kind} named {name:?}; choose one of {known}")]
pub struct UnknownName {
    pub(crate) kind: &'static str,
    pub(crate) name: String,
    pub(crate) known: String,
}

impl FromStr for Family {
    type Err = UnknownName;

    fn from_str(name: &str) -> Result<Self, UnknownName> {
        Self::ALL.into_iter().find(|family| family.id() == name).ok_or_else(|| UnknownName {
            kind: "family",
            name: name.into(),
            known: Self::ALL.map(Self::id).join(", "),
        })
    }
}

impl FromStr for Split {
    type Err = UnknownName;

    fn from_str(name: &str) -> Result<Self, UnknownName> {
        let all = [Self::Train, Self::Validation, Self::Test];
        all.into_iter().find(|split| split.id() == name).ok_or_else(|| UnknownName {
            kind: "split",
            name: name.into(),
            known: all.map(Self::id).join(", "),
        })
    }
}

/// A task whose episodes last at least `least_s`, for worlds that need longer than the task's own.
/// Everything that drives episodes asks this, so that the same world lasts equally long everywhere.
pub fn lasting(task: &Task, least_s: f32) -> Task {
    Task { episode_s: task.episode_s.max(least_s), ..*task }
}

#[cfg(test)]
mod tests;
