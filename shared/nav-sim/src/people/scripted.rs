//! Straight from waypoint to waypoint; those who yield stand still for whoever is close ahead.

use super::PersonState;
use super::neighbours::Neighbour;
use nav_core::geometry::Vector;

/// Free room that a yielding person wants ahead, m.
const ROOM_M: f32 = 0.5;
/// Free room that it wants to either side, m.
const SIDE_ROOM_M: f32 = 0.05;
/// Nobody farther than this can be in the way, m: room and two radii.
pub(super) const SIGHT_M: f32 = 2.0;
/// How long a yielding person waits for other people before it walks on, s, and for how long it then does.
const WAIT_MAX_S: f32 = 2.0;
const PUSH_S: f32 = 1.5;

/// What a yielding person remembers.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Patience {
    /// Standing to let somebody pass.
    pub(super) waits: bool,
    blocked_s: f32,
}

impl Patience {
    /// Decides whether to wait for the next `dt_s`. For a robot that it sees a person waits as long as it
    /// takes; for people until its patience ends, so that a jam dissolves. `steps_aside(other)` tells who
    /// waits already and comes later in the order of people: of two that face each other the first walks on.
    pub(super) fn decide(
        mut self,
        person: &PersonState,
        preferred: Vector,
        neighbours: &[Neighbour],
        steps_aside: impl Fn(usize) -> bool,
        dt_s: f32,
    ) -> Self {
        let is_ahead = |neighbour: &&Neighbour| is_in_the_way(person, preferred, neighbour);
        let mut blocking = neighbours.iter().filter(is_ahead).map(|neighbour| neighbour.person);
        let robot_blocks = blocking.clone().any(|other| other.is_none());
        let people_block = blocking.any(|other| other.is_some_and(|other| !steps_aside(other)));
        self.blocked_s = if people_block { self.blocked_s + dt_s } else { 0.0 };
        if self.blocked_s > WAIT_MAX_S + PUSH_S {
            self.blocked_s = 0.0;
        }
        self.waits = robot_blocks || (people_block && self.blocked_s <= WAIT_MAX_S);
        self
    }
}

fn is_in_the_way(person: &PersonState, preferred: Vector, neighbour: &Neighbour) -> bool {
    let Some(heading) = preferred.try_normalize(1e-6) else { return false };
    let to = neighbour.position - person.position;
    let reach_m = person.radius_m + neighbour.radius_m;
    let (ahead_m, aside_m) = (to.dot(&heading), to.perp(&heading).abs());
    ahead_m > 0.0 && ahead_m < reach_m + ROOM_M && aside_m < reach_m + SIDE_ROOM_M
}
