//! Social force (Helbing and Molnár, *Social force model for pedestrian dynamics*, Phys. Rev. E 51, 1995).
//!
//! Different from the paper:
//! 1. People have a radius: the elliptical repulsion acts on the gap between edges, not between centres, and
//!    so is weaker and shorter (1 m²/s² over 0.2 m, steps of 1 s; there 2.1 over 0.3 and 2 s): two streams
//!    pass each other in a passage of 2 m. The robot repels as strongly as there: it makes no room, and nobody who sees
//!    it walks into it.
//! 2. Walls repel from the edge and over a shorter range (5 m/s² falling by e each 0.1 m), so that a door of
//!    1 m can be passed; people at the wall are stopped by geometry, not by force.
//! 3. No attraction and no random fluctuation.

use super::PersonState;
use super::neighbours::Neighbour;
use crate::collision::closest_on_segment;
use crate::obstacles::Obstacles;
use nav_core::geometry::{Point, Vector};

/// Time in which the preferred velocity is taken up, s.
const RELAXATION_S: f32 = 0.5;
/// How somebody is kept at a distance.
struct Repulsion {
    /// Strength V0, m²/s².
    strength: f32,
    range_m: f32,
    /// How far ahead the other's own step counts, s.
    step_s: f32,
}

/// Between people...
const OF_PEOPLE: Repulsion = Repulsion { strength: 1.0, range_m: 0.2, step_s: 1.0 };
/// ...and of the robot, which makes no room itself. It must stop whoever walks at the mean speed of the paper...
const OF_THE_ROBOT: Repulsion = Repulsion { strength: 2.1, range_m: 0.3, step_s: 2.0 };
/// ...m/s; whoever is faster is repelled with the square of its speed, as stopping asks for.
const MEAN_MPS: f32 = 1.34;
/// Strength at contact and range of the repulsion of walls, m/s² and m.
const WALL_STRENGTH_MPS2: f32 = 5.0;
const WALL_RANGE_M: f32 = 0.1;
/// Walls farther than this from the edge of the person are not felt, m.
const WALL_REACH_M: f32 = 0.5;
/// Cosine of half the effective angle of sight (200 degrees), and the weight of what lies outside it.
const SIGHT_COS: f32 = -0.173_648;
const UNSEEN_WEIGHT: f32 = 0.5;
/// Fastest over preferred speed.
const FASTEST: f32 = 1.3;

/// How the person wants to walk.
#[derive(Clone, Copy, Debug)]
pub(super) struct Walk {
    pub(super) speed_mps: f32,
    pub(super) preferred: Vector,
    pub(super) dt_s: f32,
}

/// The velocity after `dt_s` under the forces of now.
pub(super) fn velocity(
    person: &PersonState,
    walk: Walk,
    neighbours: &[Neighbour],
    obstacles: &Obstacles,
) -> Vector {
    let mut acceleration = (walk.preferred - person.velocity) / RELAXATION_S;
    for neighbour in neighbours {
        acceleration += weighted(repulsion(person, walk.speed_mps, neighbour), walk.preferred);
    }
    acceleration += walls(person, obstacles);
    let velocity = person.velocity + acceleration * walk.dt_s;
    let fastest_mps = FASTEST * walk.speed_mps;
    let speed_mps = velocity.norm();
    if speed_mps > fastest_mps { velocity * (fastest_mps / speed_mps) } else { velocity }
}

/// `-∇ V0 exp(-b / range)`, b the small half-axis of the ellipse round the neighbour's next step.
fn repulsion(person: &PersonState, speed_mps: f32, neighbour: &Neighbour) -> Vector {
    let apart = person.position - neighbour.position;
    let distance_m = apart.norm();
    if distance_m < 1e-4 {
        return Vector::zeros();
    }
    let gap_m = (distance_m - person.radius_m - neighbour.radius_m).max(0.02);
    let gap = apart * (gap_m / distance_m);
    let Repulsion { strength, range_m, step_s } = if neighbour.person.is_some() {
        OF_PEOPLE
    } else {
        let faster = (speed_mps / MEAN_MPS).max(1.0);
        Repulsion { strength: OF_THE_ROBOT.strength * faster * faster, ..OF_THE_ROBOT }
    };
    let step = neighbour.velocity * step_s;
    let after = gap - step;
    let after_m = after.norm().max(1e-3);
    let sum_m = gap_m + after_m;
    let half_axis_m = 0.5 * (sum_m * sum_m - step.norm_squared()).max(4e-4).sqrt();
    let gradient = (gap / gap_m + after / after_m) * (sum_m / (4.0 * half_axis_m));
    gradient * (strength / range_m * libm::expf(-half_axis_m / range_m))
}

/// Less for what happens behind the back.
fn weighted(force: Vector, preferred: Vector) -> Vector {
    let seen = -force.dot(&preferred) >= SIGHT_COS * force.norm() * preferred.norm();
    if seen { force } else { force * UNSEEN_WEIGHT }
}

fn walls(person: &PersonState, obstacles: &Obstacles) -> Vector {
    let mut sum = Vector::zeros();
    let mut push = |from: Point, radius_m: f32| {
        let apart = person.position - from;
        let reach_m = person.radius_m + radius_m + WALL_REACH_M;
        let distance_m2 = apart.norm_squared();
        if distance_m2 < reach_m * reach_m && distance_m2 > 1e-8 {
            let distance_m = distance_m2.sqrt();
            let gap_m = (distance_m - person.radius_m - radius_m).max(0.0);
            sum += apart * (WALL_STRENGTH_MPS2 / distance_m * libm::expf(-gap_m / WALL_RANGE_M));
        }
    };
    for (edges, discs) in obstacles.near(person.position, person.radius_m + WALL_REACH_M) {
        edges.iter().for_each(|edge| push(closest_on_segment(person.position, edge), 0.0));
        discs.iter().for_each(|disc| push(disc.center, disc.radius_m));
    }
    sum
}
