//! Who a person sees.

use super::company::led_by;
use super::{PersonState, RobotState};
use crate::world::{Person, WalkModel};
use nav_core::geometry::{Point, Vector};

/// People look this far, m.
pub const SIGHT_M: f32 = 3.0;
/// Everybody heeds at most so many other people, the nearest, and the robot.
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
}

/// The nearest others; memory is reused.
#[derive(Clone, Debug, Default)]
pub(super) struct Neighbours {
    heeded: Vec<Neighbour>,
    /// Squared distance (as ordered bits) and index of everybody in sight.
    in_sight: Vec<u64>,
    /// Who leads each; who walks alone leads itself.
    groups: Vec<usize>,
}

impl Neighbours {
    /// Other people.
    pub(super) fn reset(&mut self, people: &[Person]) {
        self.groups.clear();
        self.groups.extend((0..people.len()).map(|index| led_by(people, index)));
    }

    pub(super) fn as_slice(&self) -> &[Neighbour] {
        &self.heeded
    }

    /// Finds the nearest others of a person within `sight_m`, and the robot where it is given and in sight.
    pub(super) fn gather(
        &mut self,
        index: usize,
        people: &[Person],
        states: &[PersonState],
        robot: Option<RobotState>,
        sight_m: f32,
    ) {
        self.look(index, states, sight_m);
        self.heeded.clear();
        self.heeded.extend(self.in_sight.iter().map(|&key| {
            let other = (key & u64::from(u32::MAX)) as usize;
            let state = &states[other];
            Neighbour {
                position: state.position,
                velocity: state.velocity,
                radius_m: state.radius_m,
                person: Some(other),
                avoids: matches!(people[other].model, WalkModel::SocialForce | WalkModel::Orca),
            }
        }));
        let here = states[index].position;
        self.heeded.extend(
            robot.filter(|robot| (robot.position - here).norm_squared() < sight_m * sight_m).map(|robot| {
                Neighbour {
                    position: robot.position,
                    velocity: robot.velocity,
                    radius_m: robot.radius_m,
                    person: None,
                    avoids: false,
                }
            }),
        );
    }

    /// Keeps the nearest, in the order of the world's people if all of them are heeded. Those who walk together keep
    /// their places by themselves.
    fn look(&mut self, index: usize, states: &[PersonState], sight_m: f32) {
        let here = states[index].position;
        let group = self.groups[index];
        self.in_sight.clear();
        self.in_sight.resize(states.len(), 0);
        let mut count = 0;
        for (other, state) in states.iter().enumerate() {
            let distance_m2 = (state.position - here).norm_squared();
            // Written always, counted when in sight: no branch to mispredict. The bits of floats that are
            // not negative are in the order of the floats.
            self.in_sight[count] = u64::from(distance_m2.to_bits()) << 32 | other as u64;
            count += usize::from(distance_m2 < sight_m * sight_m && self.groups[other] != group);
        }
        self.in_sight.truncate(count);
        if count > NEIGHBOURS_MAX {
            self.in_sight.sort_unstable();
            self.in_sight.truncate(NEIGHBOURS_MAX);
        }
    }
}
