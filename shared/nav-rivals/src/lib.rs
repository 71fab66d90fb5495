//! Floor 3: the classical rivals of the learned policies, driven by the same loop in the same worlds.
//!
//! Reading order: `follow` (the steering that all robots share), `grid` and `meter` (what plans are made on, and what a
//! search takes), then one file a rival: [`planner`] (knows the map), [`reactive`] (knows the newest scan), [`clairvoyant`]
//! (knows the future: no robot, but a ceiling for all). A new one gets its file and a line in [`Rival`].

mod follow;
mod grid;
mod meter;

pub mod planner;
pub mod reactive;
pub mod clairvoyant;

use nav_core::task::Task;
use nav_env::robot::Driver;
use std::fmt;

/// Every rival, by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rival {
    /// A* on the known static map, with a follower.
    Astar,
    /// Dijkstra's algorithm on the known static map, with a follower.
    Dijkstra,
    /// Steers by the newest scan, without memory.
    Reactive,
    /// Knows the future, and searches in time.
    Clairvoyant,
}

impl Rival {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Astar, Self::Dijkstra, Self::Reactive, Self::Clairvoyant];

    /// Its name on command lines and in results.
    pub const fn id(self) -> &'static str {
        match self {
            Self::Astar => "astar",
            Self::Dijkstra => "dijkstra",
            Self::Reactive => "reactive",
            Self::Clairvoyant => "clairvoyant",
        }
    }

    /// The rival of a name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|rival| rival.id() == name)
    }

    /// A robot's driver for a task.
    pub fn driver(self, task: &Task) -> Box<dyn Driver + Send> {
        match self {
            Self::Astar => Box::new(planner::KnownMapPlanner::new(planner::Search::AStar, task)),
            Self::Dijkstra => Box::new(planner::KnownMapPlanner::new(planner::Search::Dijkstra, task)),
            Self::Reactive => Box::new(reactive::Reactive::new(task)),
            Self::Clairvoyant => Box::new(clairvoyant::Clairvoyant::new(task)),
        }
    }
}

impl fmt::Display for Rival {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.id())
    }
}
