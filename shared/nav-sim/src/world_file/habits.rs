//! What people of a world file do besides walking: checked before anybody relies on it.

use crate::world::{Person, WalkModel, Whom};

/// Whether a person can keep its place beside somebody, if it has one, with a robot of a radius (m).
pub(super) fn check_beside(people: &[Person], index: usize, robot_radius_m: f32) -> Result<(), &'static str> {
    let person = &people[index];
    let Some(beside) = person.beside else { return Ok(()) };
    let other_m = match beside.whom {
        Whom::Robot if !person.sees_robot => {
            return Err("who keeps the robot company must see it (sees_robot)");
        }
        Whom::Robot => robot_radius_m,
        Whom::Person(other) if other == index => return Err("whom.person is itself"),
        Whom::Person(other) => match people.get(other) {
            None => return Err("whom.person is nobody in the list of people, which is counted from 0"),
            Some(other) if other.beside.is_some() => {
                return Err("whom.person walks beside somebody, too: name the one who leads them all");
            }
            Some(other) => other.radius_m,
        },
    };
    let is_apart = beside.left_m.is_finite() && beside.left_m.abs() >= person.radius_m + other_m;
    if !is_apart {
        return Err(
            "left_m must be a number at least as large as the two radii together, or the two would overlap",
        );
    }
    if !matches!(person.model, WalkModel::SocialForce | WalkModel::Orca) {
        return Err("that needs the model social_force or orca, which keep out of walls");
    }
    if !person.waypoints.is_empty() {
        return Err("it has waypoints of its own: leave them out");
    }
    Ok(())
}

/// Whether a person can stop where it says.
pub(super) fn check_stop(person: &Person) -> Result<(), &'static str> {
    let Some(stop) = person.stop else { return Ok(()) };
    let [least_s, most_s] = stop.seconds;
    if person.waypoints.len() < 2 {
        return Err("that needs two waypoints or more");
    }
    if stop.waypoint >= person.waypoints.len() {
        return Err("stop.waypoint is none of its waypoints, which are counted from 0");
    }
    if !(least_s >= 0.0 && most_s >= least_s && most_s.is_finite()) {
        return Err("stop.seconds must be two numbers of seconds, the smaller first");
    }
    if !(0.0..=1.0).contains(&stop.turns_round) {
        return Err("stop.turns_round must lie in [0, 1]");
    }
    Ok(())
}
