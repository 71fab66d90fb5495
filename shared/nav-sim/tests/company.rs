//! People who walk beside somebody, and people who stop.

mod common;

use nav_core::geometry::{Point, Pose};
use nav_core::task::Task;
use nav_core::twist::Twist;
use nav_sim::disturbance::Disturbance;
use nav_sim::simulation::{Outcome, Simulation};
use nav_sim::world::{Beside, Person, Polygon, Stop, WalkModel, Whom, World};
use std::sync::Arc;

fn simulation(world: World, seed: u64) -> Simulation {
    let task = Task { episode_s: 500.0, ..Task::default() };
    Simulation::new(Arc::new(world), &task, &Disturbance::none(), seed)
}

/// A room with people; the robot stands in a corner.
fn room(people: Vec<Person>) -> World {
    World { people, start: Pose::new(0.4, 9.6, 0.0), goal: Point::new(9.5, 0.5), ..common::room(10.0) }
}

/// Somebody beside person 0, or beside the robot.
fn beside(whom: Whom, left_m: f32, start: (f32, f32)) -> Person {
    Person {
        waypoints: Vec::new(),
        beside: Some(Beside { whom, left_m }),
        ..common::walker(start, start, WalkModel::SocialForce, true)
    }
}

fn apart_m(simulation: &Simulation, a: usize, b: usize) -> f32 {
    (simulation.people()[a].position - simulation.people()[b].position).norm()
}

#[test]
fn a_group_walks_side_by_side_and_turns_round_without_walking_through_itself() {
    for model in [WalkModel::SocialForce, WalkModel::Orca] {
        let leader = common::walker((1.0, 5.0), (9.0, 5.0), model, false);
        let people = vec![
            leader,
            beside(Whom::Person(0), 0.75, (1.0, 5.75)),
            beside(Whom::Person(0), -0.75, (1.0, 4.25)),
        ];
        let mut simulation = simulation(room(people), 0);
        let (mut abreast, mut turns) = (0, 0);
        let mut course = 1.0;
        for step in 0..400 {
            simulation.step(Twist::ZERO);
            let people = simulation.people();
            let leader = people[0];
            let sides = [1, 2].map(|member: usize| people[member].position - leader.position);
            abreast += u32::from(
                sides.iter().all(|side| side.x.abs() < 0.2 && (side.y.abs() - 0.75).abs() < 0.15)
                    && sides[0].y * sides[1].y < 0.0,
            );
            if leader.velocity.x.abs() > 0.1 {
                turns += u32::from(leader.velocity.x * course < 0.0);
                course = leader.velocity.x;
            }
            for (a, b) in [(0, 1), (0, 2), (1, 2)] {
                assert!(apart_m(&simulation, a, b) > 0.5, "{model:?} step {step}: {a} and {b} overlap");
            }
        }
        assert!(turns >= 3, "{model:?} turned {turns} times");
        assert!(abreast > 270, "{model:?}: abreast in {abreast} of 400 steps");
    }
}

#[test]
fn a_group_of_three_passes_a_door_for_one_and_waits_for_the_last() {
    let wall = |from: f32, to: f32| Polygon {
        vertices: [(4.9, from), (5.1, from), (5.1, to), (4.9, to)].map(|(x, y)| Point::new(x, y)).to_vec(),
    };
    let people = vec![
        common::walker((2.0, 5.0), (8.0, 5.0), WalkModel::SocialForce, false),
        beside(Whom::Person(0), 0.75, (2.0, 5.75)),
        beside(Whom::Person(0), -0.75, (2.0, 4.25)),
    ];
    let world = World { polygons: vec![wall(0.0, 4.45), wall(5.55, 10.0)], ..room(people) };
    let mut simulation = simulation(world, 1);
    let mut passages = [0; 3];
    let mut is_beyond = [false; 3];
    for step in 0..600 {
        simulation.step(Twist::ZERO);
        for (index, person) in simulation.people().iter().enumerate() {
            let room_m = simulation.obstacles().distance_m(person.position, 1.0) - person.radius_m;
            assert!(room_m > -0.06, "step {step}: person {index} is {room_m} m off a wall");
            let x = person.position.x;
            if if is_beyond[index] { x < 4.0 } else { x > 6.0 } {
                is_beyond[index] = !is_beyond[index];
                passages[index] += 1;
            }
        }
        let spread_m = apart_m(&simulation, 0, 1).max(apart_m(&simulation, 0, 2));
        assert!(spread_m < 3.0, "step {step}: the group is {spread_m} m apart");
    }
    // Six metres at 0.8 m/s there and back, and what the door costs.
    assert!(passages.iter().all(|&count| count >= 4), "{passages:?}");
}

#[test]
fn who_leads_waits_for_those_who_fell_back() {
    let gone_m = |people| {
        let mut simulation = simulation(room(people), 0);
        (0..40).for_each(|_| {
            simulation.step(Twist::ZERO);
        });
        simulation.people()[0].position.x - 2.0
    };
    let leader = common::walker((2.0, 2.0), (9.0, 2.0), WalkModel::SocialForce, false);
    let alone_m = gone_m(vec![leader.clone()]);
    let waiting_m = gone_m(vec![leader, beside(Whom::Person(0), 0.75, (2.0, 8.0))]);
    assert!(
        alone_m > 2.5 && waiting_m < 0.5 * alone_m,
        "{alone_m} m alone, {waiting_m} m with somebody far behind"
    );
}

#[test]
fn people_of_a_group_keep_off_each_other_even_where_their_places_do_not() {
    let people = vec![
        common::walker((1.0, 5.0), (9.0, 5.0), WalkModel::SocialForce, false),
        beside(Whom::Person(0), 0.75, (1.0, 5.75)),
        beside(Whom::Person(0), 0.85, (1.0, 6.5)),
    ];
    let mut simulation = simulation(room(people), 0);
    for step in 0..70 {
        simulation.step(Twist::ZERO);
        assert!(apart_m(&simulation, 1, 2) > 0.35, "step {step}: {} m apart", apart_m(&simulation, 1, 2));
    }
}

#[test]
fn who_keeps_the_robot_company_walks_beside_it_and_never_into_it() {
    for left_m in [0.75, -0.75] {
        let world = World {
            start: Pose::new(1.0, 5.0, 0.0),
            goal: Point::new(9.6, 9.6),
            ..room(vec![beside(Whom::Robot, left_m, (1.0, 7.0))])
        };
        let mut simulation = simulation(world, 0);
        for step in 0..130 {
            // Along the room and round again, slowly enough to be followed.
            let command = if step < 100 { Twist::new(0.5, 0.0) } else { Twist::new(0.3, 1.0) };
            assert_eq!(simulation.step(command), Outcome::Running, "step {step}");
            if (60..100).contains(&step) {
                let place = simulation.pose().parent_from_local(Point::new(0.0, left_m));
                let off_m = (simulation.people()[0].position - place).norm();
                assert!(off_m < 0.3, "step {step}: {off_m} m from its place");
            }
        }
    }
}

/// For how long somebody stands at (5, 5) each time, s, on the way between x = 1 and x = 9, and at which end it was
/// before and after.
fn stops(turns_round: f32) -> (Vec<f32>, Vec<[i32; 2]>) {
    let person = Person {
        waypoints: [(9.0, 5.0), (5.0, 5.0), (1.0, 5.0), (4.9, 5.0)].map(|(x, y)| Point::new(x, y)).to_vec(),
        stop: Some(Stop { waypoint: 1, seconds: [2.0, 5.0], turns_round }),
        ..common::walker((1.0, 5.0), (9.0, 5.0), WalkModel::Scripted, false)
    };
    let mut simulation = simulation(room(vec![person]), 3);
    let (mut times_s, mut ends, mut stood) = (Vec::new(), Vec::new(), 0);
    let (mut end, mut before) = (1, 1);
    for _ in 0..4000 {
        simulation.step(Twist::ZERO);
        let person = simulation.people()[0];
        let x = person.position.x;
        if person.velocity.norm() < 1e-6 && (x - 5.0).abs() < 0.1 {
            stood += 1;
            before = end;
        } else if stood > 1 && ((x - 1.0).abs() < 0.2 || (x - 9.0).abs() < 0.2) {
            times_s.push(0.1 * stood as f32);
            ends.push([before, x.round() as i32]);
            stood = 0;
        }
        if (x - 1.0).abs() < 0.2 || (x - 9.0).abs() < 0.2 {
            end = x.round() as i32;
        }
    }
    (times_s, ends)
}

#[test]
fn who_stops_stands_as_long_as_it_says_and_turns_round_as_often() {
    let (times_s, ends) = stops(0.0);
    assert!(times_s.len() > 10 && times_s.iter().all(|&time_s| (1.9..=5.1).contains(&time_s)), "{times_s:?}");
    assert!(times_s.iter().any(|&time_s| (time_s - times_s[0]).abs() > 0.3), "drawn anew: {times_s:?}");
    assert!(ends.iter().all(|[before, after]| before != after), "{ends:?}");
    let (_, ends) = stops(1.0);
    assert!(ends.len() > 10 && ends.iter().all(|[before, after]| before == after), "{ends:?}");
}

#[test]
fn who_stops_changes_nothing_for_those_who_do_not() {
    let positions = |stop| {
        let stopping =
            Person { stop, ..common::walker((9.0, 9.0), (9.0, 1.0), WalkModel::SocialForce, false) };
        let other = common::walker((1.0, 2.0), (3.0, 8.0), WalkModel::SocialForce, false);
        let mut simulation = simulation(room(vec![stopping, other]), 5);
        (0..200).for_each(|_| {
            simulation.step(Twist::ZERO);
        });
        [0, 1].map(|index| simulation.people()[index].position)
    };
    let [here, there] =
        [None, Some(Stop { waypoint: 0, seconds: [9.0, 9.0], turns_round: 0.0 })].map(positions);
    assert_ne!(here[0], there[0]);
    assert_eq!(here[1], there[1]);
}
