//! Who a person sees.

use super::{PersonState, RobotState};
use crate::world::{Person, WalkModel};
use nav_core::geometry::{Point, Vector};

/// People look this far, m.
pub const SIGHT_M: f32 = 3.0;
/// Everybody heeds at most so many others, the nearest.
pub const NEIGHBOURS_MAX: usize = 8;

/// Somebody near.
#[derive(Clone, Copy, Debug)]
pub(super) struct Neighbour {
    pub(super) position: Point,
    pub(super) velocity: Vector,
    pub(super) radius_m: f32,
    /// Index of the person; `None` for the robot.
    pub(super) person: Option<usize>,
    /// Whether it makes room as well.
    pub(super) avoids: bool,
    distance_m2: f32,
}

/// The nearest others, nearest first; memory is reused.
#[derive(Clone, Debug, Default)]
pub(super) struct Neighbours {
    nearest: Vec<Neighbour>,
}

impl Neighbours {
    pub(super) fn as_slice(&self) -> &[Neighbour] {
        &self.nearest
    }

    /// Finds the nearest others of a person, and the robot where it is given and in sight.
    pub(super) fn gather(
        &mut self,
        index: usize,
        people: &[Person],
        states: &[PersonState],
        robot: Option<RobotState>,
    ) {
        self.nearest.clear();
        let here = states[index].position;
        for (other, state) in states.iter().enumerate() {
            let distance_m2 = (state.position - here).norm_squared();
            if distance_m2 < SIGHT_M * SIGHT_M && other != index {
                self.insert(Neighbour {
                    position: state.position,
                    velocity: state.velocity,
                    radius_m: state.radius_m,
                    person: Some(other),
                    avoids: matches!(people[other].model, WalkModel::SocialForce | WalkModel::Orca),
                    distance_m2,
                });
            }
        }
        if let Some(robot) = robot {
            let distance_m2 = (robot.position - here).norm_squared();
            if distance_m2 < SIGHT_M * SIGHT_M {
                self.insert(Neighbour {
                    position: robot.position,
                    velocity: robot.velocity,
                    radius_m: robot.radius_m,
                    person: None,
                    avoids: false,
                    distance_m2,
                });
            }
        }
    }

    fn insert(&mut self, neighbour: Neighbour) {
        let at = self.nearest.partition_point(|other| other.distance_m2 <= neighbour.distance_m2);
        if at == NEIGHBOURS_MAX {
            return;
        }
        self.nearest.truncate(NEIGHBOURS_MAX - 1);
        self.nearest.insert(at, neighbour);
    }
}
