//! Straight from waypoint to waypoint; those who yield stand still for whoever is close ahead.

use super::PersonState;
use super::neighbours::Neighbour;
use nav_core::geometry::Vector;

/// Free room that a yielding person wants between itself and whoever is ahead, m.
const ROOM_M: f32 = 0.5;
/// Nobody farther than this can be in the way, m: room and two radii.
pub(super) const SIGHT_M: f32 = 2.0;
/// Cosine of half the angle that counts as ahead (50 degrees).
const AHEAD_COS: f32 = 0.643;

/// Whether a yielding person waits. `steps_aside(other)` tells who already waits and comes later in the
/// order of people: of two that face each other the first walks on, so that they never wait for ever.
pub(super) fn must_wait(
    person: &PersonState,
    preferred: Vector,
    neighbours: &[Neighbour],
    steps_aside: impl Fn(usize) -> bool,
) -> bool {
    let speed_mps = preferred.norm();
    neighbours.iter().filter(|neighbour| !neighbour.person.is_some_and(&steps_aside)).any(|neighbour| {
        let to = neighbour.position - person.position;
        let distance_m = to.norm();
        distance_m < person.radius_m + neighbour.radius_m + ROOM_M
            && to.dot(&preferred) > AHEAD_COS * distance_m * speed_mps
    })
}
