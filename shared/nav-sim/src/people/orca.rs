//! Optimal reciprocal collision avoidance (van den Berg et al., *Reciprocal n-body collision avoidance*,
//! 2011), by the crate `dodgy_2d`.
//!
//! Discs take part as agents that never move; edges as one-sided obstacles turned towards the person.

use super::PersonState;
use super::neighbours::Neighbour;
use crate::collision::closest_on_segment;
use crate::obstacles::Obstacles;
use crate::world::Segment;
use dodgy_2d::{Agent, AvoidanceOptions, Obstacle, Vec2};
use nav_core::geometry::{Point, Vector};
use std::borrow::Cow;

/// Collisions with others are avoided this far ahead, s.
const HORIZON_S: f32 = 2.0;
/// Collisions with walls are avoided this far ahead, s.
const WALL_HORIZON_S: f32 = 0.8;
/// Kept to the robot, m.
const ROBOT_GAP_M: f32 = 0.1;
/// Fastest over preferred speed.
const FASTEST: f32 = 1.2;
/// The most static obstacles that are heeded.
const STATIC_MAX: usize = 12;

/// How the person wants to walk.
#[derive(Clone, Copy, Debug)]
pub(super) struct Walk {
    pub(super) index: usize,
    pub(super) speed_mps: f32,
    pub(super) preferred: Vector,
    pub(super) dt_s: f32,
}

/// Room that is reused from call to call.
#[derive(Clone, Debug, Default)]
pub(super) struct Scratch {
    agents: Vec<Cow<'static, Agent>>,
    walls: Vec<Cow<'static, Obstacle>>,
}

/// The velocity nearest to the preferred one that avoids collisions.
pub(super) fn velocity(
    person: &PersonState,
    walk: Walk,
    neighbours: &[Neighbour],
    obstacles: &Obstacles,
    scratch: &mut Scratch,
) -> Vector {
    let fastest_mps = FASTEST * walk.speed_mps;
    let agent = Agent {
        position: vec2(person.position.coords),
        velocity: vec2(person.velocity),
        radius: person.radius_m,
        avoidance_responsibility: 1.0,
    };
    scratch.agents.clear();
    scratch.walls.clear();
    for neighbour in neighbours {
        let other = Agent {
            position: vec2(neighbour.position.coords),
            velocity: vec2(neighbour.velocity),
            // Two who avoid each other touch in passing; nobody brushes against a machine.
            radius: neighbour.radius_m + if neighbour.person.is_none() { ROBOT_GAP_M } else { 0.0 },
            avoidance_responsibility: if neighbour.avoids { 1.0 } else { 0.0 },
        };
        let side = if neighbour.person > Some(walk.index) { 1.0 } else { -1.0 };
        scratch.agents.push(Cow::Owned(without_chance(&agent, other, side, walk.dt_s)));
    }
    let reach_m = person.radius_m + fastest_mps * WALL_HORIZON_S;
    scratch.add_static(&agent, person.position, reach_m, obstacles, walk.dt_s);
    let options = AvoidanceOptions {
        obstacle_margin: person.radius_m,
        time_horizon: HORIZON_S,
        obstacle_time_horizon: WALL_HORIZON_S,
    };
    let chosen = agent.compute_avoiding_velocity(
        &scratch.agents,
        &scratch.walls,
        vec2(walk.preferred),
        fastest_mps,
        walk.dt_s,
        &options,
    );
    if chosen.is_finite() { Vector::new(chosen.x, chosen.y) } else { Vector::zeros() }
}

impl Scratch {
    fn add_static(&mut self, agent: &Agent, here: Point, reach_m: f32, obstacles: &Obstacles, dt_s: f32) {
        for (edges, discs) in obstacles.near(here, reach_m) {
            for edge in edges {
                let near = (closest_on_segment(here, edge) - here).norm_squared() < reach_m * reach_m;
                if near && self.walls.len() < STATIC_MAX {
                    self.walls.push(Cow::Owned(facing(here, edge)));
                }
            }
            for disc in discs {
                let reach_m = reach_m + disc.radius_m;
                if (disc.center - here).norm_squared() < reach_m * reach_m
                    && self.agents.len() < super::NEIGHBOURS_MAX + STATIC_MAX
                {
                    let other = Agent {
                        position: vec2(disc.center.coords),
                        velocity: Vec2::ZERO,
                        radius: disc.radius_m,
                        avoidance_responsibility: 0.0,
                    };
                    self.agents.push(Cow::Owned(without_chance(agent, other, 1.0, dt_s)));
                }
            }
        }
    }
}

/// The library takes the left of an open edge for solid.
fn facing(here: Point, edge: &Segment) -> Obstacle {
    let on_right = (edge.b - edge.a).perp(&(here - edge.a)) <= 0.0;
    let (from, to) = if on_right { (edge.a, edge.b) } else { (edge.b, edge.a) };
    Obstacle::Open { vertices: vec![vec2(from.coords), vec2(to.coords)] }
}

/// Two that overlap and would meet at one point make the library draw a random direction, from a generator
/// that nobody can seed. Such a neighbour's velocity is moved by a millimetre a second to one side (the two
/// must see opposite sides to walk apart), and nothing is drawn.
fn without_chance(agent: &Agent, mut other: Agent, side: f32, dt_s: f32) -> Agent {
    let to = other.position - agent.position;
    let reach_m = agent.radius + other.radius;
    let meets = agent.velocity - other.velocity - to / dt_s;
    if to.length_squared() <= reach_m * reach_m && meets.length_squared() < 1e-10 {
        other.velocity.x += side * 1e-3;
    }
    other
}

fn vec2(vector: Vector) -> Vec2 {
    Vec2::new(vector.x, vector.y)
}
