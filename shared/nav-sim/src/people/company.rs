//! Walking beside somebody: groups of people, and those who keep the robot company.
//!
//! Pedestrians who walk together do so side by side, and closer to a file where it is narrow (Moussaïd et al., *The
//! walking behaviour of pedestrian social groups and its impact on crowd dynamics*, PLoS ONE 5, 2010). Here each has a
//! place beside the one who leads; where that place, or what lies ahead of it, is not free, it is as far behind the
//! leader. Who leads waits for those who fall back.

use super::PersonState;
use crate::geodesic::is_leg_free;
use crate::obstacles::Obstacles;
use crate::world::{Beside, Person, Whom};
use nav_core::geometry::{Point, Vector};

/// Time in which a place is taken, s.
const CATCH_UP_S: f32 = 0.8;
/// A place is free when so much ahead of it is, too, m.
const AHEAD_M: f32 = 1.2;
/// Kept to walls at a place, m.
const WALL_GAP_M: f32 = 0.05;
/// Kept between edges of people of a group, m, and the time in which too little is mended, s.
const GAP_M: f32 = 0.1;
const APART_S: f32 = 0.4;
/// So far behind its place a person slows the leader down, m; so much farther stops it but for a crawl.
const LAG_M: f32 = 0.5;
const LAG_MAX_M: f32 = 1.5;
const CRAWL: f32 = 0.2;

/// Who leads, at a moment.
#[derive(Clone, Copy, Debug)]
pub(super) struct Leader {
    pub(super) position: Point,
    pub(super) velocity: Vector,
    /// Where it is going, of length 1.
    pub(super) course: Vector,
    /// Whether left is right, after it turned round.
    pub(super) is_mirrored: bool,
}

/// The first of the group that a person belongs to: itself, if it goes its own way.
pub(super) fn led_by(people: &[Person], index: usize) -> usize {
    match people[index].beside {
        Some(Beside { whom: Whom::Person(leader), .. }) => leader,
        _ => index,
    }
}

/// Where a person should be now.
pub(super) fn place(state: &PersonState, beside: Beside, leader: &Leader, obstacles: &Obstacles) -> Point {
    if leader.course == Vector::zeros() {
        // It has gone nowhere yet.
        return state.position;
    }
    let left = Vector::new(-leader.course.y, leader.course.x);
    let left_m = if leader.is_mirrored { -beside.left_m } else { beside.left_m };
    let aside = leader.position + left * left_m;
    let radius_m = state.radius_m + WALL_GAP_M;
    let is_free = |from: Point, to: Point| is_leg_free(obstacles, from, to, radius_m);
    if is_free(aside, aside + leader.course * AHEAD_M) && is_free(state.position, aside) {
        return aside;
    }
    leader.position - leader.course * left_m.abs()
}

/// The velocity that a person wants in order to take its place, m/s.
pub(super) fn velocity(state: &PersonState, place: Point, leader: &Leader, fastest_mps: f32) -> Vector {
    let wish = leader.velocity + (place - state.position) / CATCH_UP_S;
    let wish_mps = wish.norm();
    if wish_mps > fastest_mps { wish * (fastest_mps / wish_mps) } else { wish }
}

/// What keeps people of a group off each other, m/s.
pub(super) fn apart(index: usize, people: &[Person], states: &[PersonState]) -> Vector {
    let (state, group) = (&states[index], led_by(people, index));
    let mates = (0..states.len()).filter(|&other| other != index && led_by(people, other) == group);
    mates.fold(Vector::zeros(), |sum, other| {
        let away = state.position - states[other].position;
        let distance_m = away.norm();
        let short_m = state.radius_m + states[other].radius_m + GAP_M - distance_m;
        if short_m > 0.0 && distance_m > 1e-4 { sum + away * (short_m / distance_m / APART_S) } else { sum }
    })
}

/// The share of its speed at which a leader goes whose farthest companion is so far from its place.
pub(super) fn pace(lag_m: f32) -> f32 {
    (1.0 - (lag_m - LAG_M) / LAG_MAX_M).clamp(CRAWL, 1.0)
}
