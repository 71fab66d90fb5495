//! People as they are measured: sizes and speeds from published data, alone and in groups that walk or stand together.
//!
//! | what | value | from |
//! |---|---|---|
//! | free speed | normal, 1.34 m/s, standard deviation 0.26, cut to 0.7-2 | Weidmann, *Transporttechnik der Fussgänger*, Schriftenreihe des IVT 90, ETH Zürich 1993; as Helbing and Molnár take it, *Social force model for pedestrian dynamics*, Phys. Rev. E 51, 4282, 1995 (arXiv cond-mat/9805244) |
//! | radius | half of `bideltoidbreadth`, the breadth over both shoulders: 0.24 m, 0.02, cut to 0.2-0.29 (half of each sex; 0.510 m, 0.033 of 4082 men, 0.450 m, 0.029 of 1986 women across, worked out from the survey's public data) | Gordon et al., *2012 anthropometric survey of U.S. Army personnel* (ANSUR II), NATICK/TR-15/007, 2014 |
//! | groups | up to 70 % of people are not alone; side by side, in file where it is narrow; the larger the slower | Moussaïd et al., PLoS ONE 5, e10047, 2010 |
//! | standing groups | in a ring about an empty middle, at personal distance (0.45-1.2 m) | Kendon, *Conducting interaction*, 1990; Hall, *The hidden dimension*, 1966 |
//!
//! Chosen, not measured: the shares of group sizes, 6 % less speed for each further member, 0.75 m from one to the next,
//! the shares of the walking models, and that four groups in five see the robot.

use super::dice::Dice;
use super::people;
use super::scene::Scene;
use crate::world::{Beside, Person, WalkModel, Whom, World};
use nav_core::geometry::{Point, Vector};
use std::f32::consts::{PI, TAU};

/// From one to the next in a group that walks, m.
const SIDE_BY_SIDE_M: f32 = 0.75;
/// From one to the next in a group that stands, m.
const IN_A_RING_M: f32 = 0.95;
/// Kept between people at reset, and between them and obstacles, m.
const GAP_M: f32 = 0.1;
/// Nobody starts nearer to the robot's start, m, but for who keeps it company: the fastest who do not see it take as long
/// for that as the robot for turning and getting out of their way.
const START_DISTANCE_M: f32 = 4.0;
const COMPANION_DISTANCE_M: f32 = 1.5;
const TRIES: usize = 40;

/// A person without a place yet.
pub(super) fn person(dice: &mut Dice) -> Person {
    let share = dice.within(0.0..=1.0);
    let model = if share < 0.7 { WalkModel::SocialForce } else { WalkModel::Orca };
    Person {
        start: Point::origin(),
        waypoints: Vec::new(),
        radius_m: dice.normal(0.24, 0.02, 0.2..=0.29),
        speed_mps: dice.normal(1.34, 0.26, 0.7..=2.0),
        model,
        sees_robot: dice.chance(0.8),
        beside: None,
        stop: None,
    }
}

/// How many walk together: of people, a third alone, and four in ten in pairs.
pub(super) fn group_size(dice: &mut Dice) -> usize {
    let share = dice.within(0.0..=1.0);
    if share < 0.56 {
        1
    } else if share < 0.88 {
        2
    } else if share < 0.97 {
        3
    } else {
        4
    }
}

/// Adds a group that walks a round trip from `route`, the leader's, whose legs are free.
pub(super) fn add_walking(
    dice: &mut Dice,
    world: &mut World,
    size: usize,
    mut route: impl FnMut(&mut Dice) -> Vec<Point>,
) -> Option<()> {
    let mut leader = person(dice);
    leader.speed_mps *= 1.0 - 0.06 * (size - 1) as f32;
    let first = world.people.len();
    for _ in 0..TRIES {
        people::add(dice, world, &mut leader, START_DISTANCE_M, &mut route)?;
        if add_beside(dice, world, first, size) {
            return Some(());
        }
        world.people.truncate(first);
    }
    None
}

/// Adds those beside a leader: one on its left, one on its right, one farther left.
fn add_beside(dice: &mut Dice, world: &mut World, first: usize, size: usize) -> bool {
    let leader = world.people[first].clone();
    let course = leader.waypoints[0] - leader.start;
    let Some(course) = course.try_normalize(1e-3) else { return size == 1 };
    let left = Vector::new(-course.y, course.x);
    [1.0, -1.0, 2.0].into_iter().take(size - 1).all(|places| {
        let left_m = places * SIDE_BY_SIDE_M;
        let member = Person {
            start: leader.start + left * left_m,
            speed_mps: leader.speed_mps,
            sees_robot: leader.sees_robot,
            beside: Some(Beside { whom: Whom::Person(first), left_m }),
            ..person(dice)
        };
        let fits = is_clear(world, &member, START_DISTANCE_M);
        world.people.push(member);
        fits
    })
}

/// Adds a group that stands about a middle; people are on the circle from `angle_rad` on.
pub(super) fn add_standing(
    dice: &mut Dice,
    world: &mut World,
    size: usize,
    middle: Point,
    angle_rad: f32,
) -> bool {
    let first = world.people.len();
    let ring_m = 0.5 * IN_A_RING_M / libm::sinf(PI / size as f32);
    let sees_robot = dice.chance(0.8);
    let fits = (0..size).all(|index| {
        let (sin, cos) = libm::sincosf(angle_rad + index as f32 * TAU / size as f32);
        let place = middle + Vector::new(cos, sin) * ring_m;
        let member = Person { start: place, waypoints: vec![place], sees_robot, ..person(dice) };
        let fits = is_clear(world, &member, START_DISTANCE_M);
        world.people.push(member);
        fits
    });
    if !fits {
        world.people.truncate(first);
    }
    fits
}

/// Adds somebody who keeps the robot company from the start on: behind it, where it looks away from.
pub(super) fn add_companion(dice: &mut Dice, world: &mut World) -> bool {
    let left_m = if dice.chance(0.5) { SIDE_BY_SIDE_M } else { -SIDE_BY_SIDE_M };
    let beside = Some(Beside { whom: Whom::Robot, left_m });
    let member = Person { sees_robot: true, beside, ..person(dice) };
    (0..TRIES).any(|_| {
        let (sin, cos) = libm::sincosf(dice.angle());
        let away = Vector::new(cos, sin) * (COMPANION_DISTANCE_M + dice.within(0.1..=1.0));
        let member = Person { start: world.start.position() + away, ..member.clone() };
        let fits = is_clear(world, &member, COMPANION_DISTANCE_M);
        if fits {
            world.people.push(member);
        }
        fits
    })
}

/// Whether somebody can start where it says.
fn is_clear(world: &World, person: &Person, distance_m: f32) -> bool {
    (person.start - world.start.position()).norm() >= distance_m
        && Scene::of(world).clearance_m(person.start) >= person.radius_m + GAP_M
        && world
            .people
            .iter()
            .all(|other| (person.start - other.start).norm() >= person.radius_m + other.radius_m + GAP_M)
}
