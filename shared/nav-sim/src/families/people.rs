//! Who walks, and where.

use super::Split;
use super::dice::Dice;
use super::scene::Scene;
use crate::world::{Person, WalkModel, World};
use nav_core::geometry::Point;
use std::ops::RangeInclusive;

/// Nobody of `crowd` and `stream` starts nearer to the robot's start, centre to centre, m.
pub(super) const START_DISTANCE_M: f32 = 1.5;
/// Kept between people at reset, m.
const PEOPLE_GAP_M: f32 = 0.1;
/// Kept between a person on a leg and every obstacle, m.
const LEG_MARGIN_M: f32 = 0.05;
const TRIES: usize = 80;

/// Sizes and speeds of the people of a split.
pub(super) struct Manners {
    radius_m: RangeInclusive<f32>,
    speed_mps: RangeInclusive<f32>,
}

impl Manners {
    /// The test split reaches beyond what training has seen.
    pub(super) fn of(split: Split) -> Self {
        match split {
            Split::Train | Split::Validation => Self { radius_m: 0.22..=0.28, speed_mps: 0.3..=0.9 },
            Split::Test => Self { radius_m: 0.24..=0.30, speed_mps: 0.4..=1.1 },
        }
    }

    /// A person without a place yet: 40 % scripted (half of them yield), 40 % social force, 20 % ORCA. Half
    /// of those who see anybody do not see the robot; with the scripted who do not yield, who see nobody, 60 %
    /// of all people are blind to it.
    pub(super) fn person(&self, dice: &mut Dice) -> Person {
        let share = dice.within(0.0..=1.0);
        let model = if share < 0.2 {
            WalkModel::Scripted
        } else if share < 0.4 {
            WalkModel::ScriptedYielding
        } else if share < 0.8 {
            WalkModel::SocialForce
        } else {
            WalkModel::Orca
        };
        Person {
            start: Point::origin(),
            waypoints: Vec::new(),
            radius_m: dice.within(self.radius_m.clone()),
            speed_mps: dice.within(self.speed_mps.clone()),
            model,
            sees_robot: dice.chance(0.5),
            beside: None,
            stop: None,
        }
    }
}

/// Gives a person a round trip from `route` whose legs are free, starts them somewhere on it, so far from the robot (m),
/// and adds them.
pub(super) fn add(
    dice: &mut Dice,
    world: &mut World,
    person: &mut Person,
    distance_m: f32,
    mut route: impl FnMut(&mut Dice) -> Vec<Point>,
) -> Option<()> {
    let scene = Scene::of(world);
    (0..TRIES).find_map(|_| {
        let mut waypoints = route(dice);
        let leg = dice.count(0..=waypoints.len() - 1);
        waypoints.rotate_left(leg);
        // The first waypoint ends the leg on which the person starts.
        let last = waypoints[waypoints.len() - 1];
        let start = last + (waypoints[0] - last) * dice.within(0.0..=1.0);
        let is_clear = (start - world.start.position()).norm() >= distance_m
            && world
                .people
                .iter()
                .all(|other| (start - other.start).norm() >= person.radius_m + other.radius_m + PEOPLE_GAP_M);
        let radius_m = person.radius_m + LEG_MARGIN_M;
        let is_free = is_clear
            && waypoints
                .iter()
                .zip(waypoints.iter().cycle().skip(1))
                .all(|(&a, &b)| scene.is_leg_free(a, b, radius_m));
        is_free.then(|| {
            person.start = start;
            person.waypoints = waypoints;
            world.people.push(person.clone());
        })
    })
}
