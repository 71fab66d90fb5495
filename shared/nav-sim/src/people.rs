//! Walking people: each goes round its waypoints for ever, in one of four ways.
//!
//! | model | sees | file |
//! |---|---|---|
//! | scripted | nobody: walks straight lines at its speed | `scripted.rs` |
//! | scripted, yielding | who is close ahead, and waits for a while | `scripted.rs` |
//! | social force | people and walls within [`SIGHT_M`] | `social_force.rs` |
//! | ORCA | people and walls within [`SIGHT_M`] | `orca.rs` |
//!
//! Whether a person also sees the robot is its own property ([`Person::sees_robot`]); the scripted never do. On top of
//! each way, a person may stop at a waypoint ([`Person::stop`]) and turn round, or, in the last two, keep a place beside
//! somebody instead of going round waypoints ([`Person::beside`], `company.rs`); with a single waypoint it stays there.
//! Velocities are chosen once a step, all from the
//! same moment; then everybody moves with them in substeps. Social force and ORCA are pushed out of static
//! obstacles (they may enter by centimetres within a step); scripted people trust their waypoints to lie in free straight lines. The
//! cost of a step is bounded: everybody looks at the nearest [`NEIGHBOURS_MAX`] only, found by comparing all
//! pairs.

mod walker;
mod company;
mod neighbours;
mod scripted;
mod social_force;
mod orca;

pub use neighbours::{NEIGHBOURS_MAX, SIGHT_M};

use crate::collision::closest_on_segment;
use crate::obstacles::Obstacles;
use crate::world::{Beside, Disc, Person, WalkModel, Whom};
use company::Leader;
use nav_core::geometry::{Point, Vector};
use neighbours::Neighbours;
use rand::{Rng, RngExt};
use walker::Walker;

/// Scripted people turn to the next waypoint this close to one, m.
const REACHED_SCRIPTED_M: f32 = 0.05;
/// Others, who may have to share it, turn this close, m.
const REACHED_M: f32 = 0.4;
/// Those who take their place walk at up to so many times their speed.
const HURRY: f32 = 1.3;
/// The course of a robot that drives slower is not heeded, m/s.
const ROBOT_STANDS_MPS: f32 = 0.05;

/// A person at a moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PersonState {
    /// Centre in the world, m.
    pub position: Point,
    /// Velocity in the world, m/s.
    pub velocity: Vector,
    /// Radius, m.
    pub radius_m: f32,
}

impl PersonState {
    /// The floor that it covers.
    pub fn disc(&self) -> Disc {
        Disc { center: self.position, radius_m: self.radius_m }
    }
}

/// The robot as people see it: a disc, whatever its footprint.
#[derive(Clone, Copy, Debug)]
pub struct RobotState {
    /// Centre in the world, m.
    pub position: Point,
    /// Velocity in the world, m/s.
    pub velocity: Vector,
    /// Radius of the footprint, m.
    pub radius_m: f32,
}

/// Everybody in a world.
#[derive(Clone, Debug, Default)]
pub struct Crowd {
    people: Vec<PersonState>,
    walkers: Vec<Walker>,
    chosen: Vec<Vector>,
    neighbours: Neighbours,
    orca: orca::Scratch,
}

impl Crowd {
    /// Puts everybody at its start, at rest.
    pub fn reset(&mut self, people: &[Person], rng: &mut impl Rng) {
        self.people.clear();
        self.people.extend(people.iter().map(|person| PersonState {
            position: person.start,
            velocity: Vector::zeros(),
            radius_m: person.radius_m,
        }));
        self.neighbours.reset(people);
        self.walkers.clear();
        self.walkers.extend(people.iter().map(|_| Walker::new(rng)));
        // After all others, so that who never stops walks as if nobody did.
        for (walker, _) in self.walkers.iter_mut().zip(people).filter(|(_, person)| person.stop.is_some()) {
            walker.with_luck(rng.random());
        }
    }

    /// Everybody, in the order of the world's people.
    pub fn people(&self) -> &[PersonState] {
        &self.people
    }

    /// Chooses the velocities of the next `dt_s`. `people` are those of the last reset.
    pub fn decide(&mut self, people: &[Person], robot: RobotState, obstacles: &Obstacles, dt_s: f32) {
        self.chosen.clear();
        for (index, person) in people.iter().enumerate() {
            let state = self.people[index];
            let preferred = match person.beside {
                Some(beside) => self.beside(index, people, beside, robot, obstacles),
                None => self.preferred(index, person, dt_s),
            };
            if person.model != WalkModel::Scripted {
                let robot = person.sees_robot.then_some(robot);
                let yields = person.model == WalkModel::ScriptedYielding;
                let sight_m = if yields { scripted::SIGHT_M } else { SIGHT_M };
                self.neighbours.gather(index, people, &self.people, robot, sight_m);
            }
            let neighbours = self.neighbours.as_slice();
            let velocity = match person.model {
                WalkModel::Scripted => preferred,
                WalkModel::ScriptedYielding => {
                    let aside = |other: usize| self.walkers[other].patience.waits && other > index;
                    let patience = self.walkers[index].patience;
                    let patience = patience.decide(&state, preferred, neighbours, aside, dt_s);
                    self.walkers[index].patience = patience;
                    if patience.waits { Vector::zeros() } else { preferred }
                }
                WalkModel::SocialForce => {
                    let walk = social_force::Walk { speed_mps: person.speed_mps, preferred, dt_s };
                    social_force::velocity(&state, walk, neighbours, obstacles)
                }
                WalkModel::Orca => {
                    let walk = orca::Walk { index, speed_mps: person.speed_mps, preferred, dt_s };
                    orca::velocity(&state, walk, neighbours, obstacles, &mut self.orca)
                }
            };
            let avoids = matches!(person.model, WalkModel::SocialForce | WalkModel::Orca);
            self.chosen.push(if avoids { kept_out(&state, velocity, obstacles, dt_s) } else { velocity });
        }
        for (state, &velocity) in self.people.iter_mut().zip(&self.chosen) {
            state.velocity = velocity;
        }
    }

    /// Everybody moves for `dt_s` with the chosen velocity.
    pub fn advance(&mut self, dt_s: f32) {
        for person in &mut self.people {
            person.position += person.velocity * dt_s;
        }
    }

    /// Turns to the next waypoint where due, and gives the velocity straight to it, m/s.
    fn preferred(&mut self, index: usize, person: &Person, dt_s: f32) -> Vector {
        let position = self.people[index].position;
        let walker = &mut self.walkers[index];
        let pace = company::pace(std::mem::take(&mut walker.lag_m));
        let avoids = matches!(person.model, WalkModel::SocialForce | WalkModel::Orca);
        let reached_m = if avoids { REACHED_M } else { REACHED_SCRIPTED_M };
        let Some(target) = person.waypoints.get(walker.waypoint) else {
            return Vector::zeros();
        };
        let mut distance_m = (target - position).norm();
        let alone = person.waypoints.len() == 1;
        if (distance_m <= reached_m || walker.stands_s.is_some()) && !alone {
            if walker.stands_on(person, dt_s) {
                return Vector::zeros();
            }
            walker.turn_to_next(person.waypoints.len());
            distance_m = (person.waypoints[walker.waypoint] - position).norm();
        } else if avoids && !alone && walker.is_stuck(distance_m, dt_s) {
            walker.turn_round(person.waypoints.len());
            distance_m = (person.waypoints[walker.waypoint] - position).norm();
        }
        if distance_m <= 1e-4 {
            return Vector::zeros();
        }
        // Never past the waypoint within this step.
        let speed_mps = person.speed_mps.min(distance_m / dt_s);
        let to = person.waypoints[walker.waypoint] - position;
        walker.head_for(to / distance_m);
        let straight = to * (speed_mps / distance_m);
        let straight = if pace < 1.0 { straight * pace } else { straight };
        if avoids { turned(straight, walker.bias_rad) } else { straight }
    }

    /// Keeps a place beside somebody, m/s.
    fn beside(
        &mut self,
        index: usize,
        people: &[Person],
        beside: Beside,
        robot: RobotState,
        obstacles: &Obstacles,
    ) -> Vector {
        let state = &self.people[index];
        let leader = match beside.whom {
            Whom::Person(leader) => {
                let (Some(other), Some(walker)) = (self.people.get(leader), self.walkers.get(leader)) else {
                    return Vector::zeros();
                };
                Leader {
                    position: other.position,
                    velocity: other.velocity,
                    course: walker.course,
                    is_mirrored: walker.is_mirrored,
                }
            }
            Whom::Robot => {
                let walker = &mut self.walkers[index];
                // While it stands or creeps, its course is the last one.
                if robot.velocity.norm() > ROBOT_STANDS_MPS {
                    walker.head_for(robot.velocity.normalize());
                }
                Leader {
                    position: robot.position,
                    velocity: robot.velocity,
                    course: walker.course,
                    is_mirrored: walker.is_mirrored,
                }
            }
        };
        let place = company::place(state, beside, &leader, obstacles);
        let lag_m = (place - state.position).norm();
        let wish = company::velocity(state, place, &leader, HURRY * people[index].speed_mps);
        if let Whom::Person(leader) = beside.whom {
            let slowed = &mut self.walkers[leader].lag_m;
            *slowed = slowed.max(lag_m);
        }
        wish + company::apart(index, people, &self.people)
    }
}

fn turned(vector: Vector, angle_rad: f32) -> Vector {
    // Small angles only: second order is enough.
    let (sin, cos) = (angle_rad, 1.0 - 0.5 * angle_rad * angle_rad);
    Vector::new(cos * vector.x - sin * vector.y, sin * vector.x + cos * vector.y)
}

/// The velocity, changed so that the next step does not enter a static obstacle.
fn kept_out(person: &PersonState, velocity: Vector, obstacles: &Obstacles, dt_s: f32) -> Vector {
    let mut next = person.position + velocity * dt_s;
    let mut push = |from: Point, reach_m: f32| {
        let away = next - from;
        let distance_m2 = away.norm_squared();
        if distance_m2 < reach_m * reach_m && distance_m2 > 1e-8 {
            let distance_m = distance_m2.sqrt();
            next += away * ((reach_m - distance_m) / distance_m);
            true
        } else {
            false
        }
    };
    let reach_m = person.radius_m + velocity.norm() * dt_s;
    let mut changed = false;
    for (edges, discs) in obstacles.near(person.position, reach_m) {
        for edge in edges {
            // From where the person stands now: from behind a thin wall the push would have the wrong sign.
            changed |= push(closest_on_segment(person.position, edge), person.radius_m);
        }
        for disc in discs {
            changed |= push(disc.center, person.radius_m + disc.radius_m);
        }
    }
    if changed { (next - person.position) / dt_s } else { velocity }
}
