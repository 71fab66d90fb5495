//! How people walk.

mod common;

use nav_core::geometry::{Point, Pose};
use nav_core::task::Task;
use nav_core::twist::Twist;
use nav_sim::disturbance::Disturbance;
use nav_sim::simulation::{Outcome, Simulation};
use nav_sim::world::{Disc, Person, Polygon, Segment, WalkModel, World};
use std::sync::Arc;

const AVOIDING: [WalkModel; 2] = [WalkModel::SocialForce, WalkModel::Orca];

fn world(people: Vec<Person>) -> World {
    World { people, start: Pose::new(0.5, 9.5, 0.0), goal: Point::new(9.5, 0.5), ..common::room(10.0) }
}

fn simulation(world: World, seed: u64) -> Simulation {
    let task = Task { episode_s: 200.0, ..Task::default() };
    Simulation::new(Arc::new(world), &task, &Disturbance::none(), seed)
}

/// How often each person came within half a metre of its far place (8 m away) after being at its near one.
fn rounds(simulation: &mut Simulation, steps: u32) -> Vec<u32> {
    let people = simulation.world().people.clone();
    let mut counts = vec![0; people.len()];
    let mut next = vec![0; people.len()];
    for _ in 0..steps {
        simulation.step(Twist::ZERO);
        for (index, person) in people.iter().enumerate() {
            if (simulation.people()[index].position - person.waypoints[next[index]]).norm() < 0.5 {
                next[index] = (next[index] + 1) % person.waypoints.len();
                counts[index] += 1;
            }
        }
    }
    counts
}

#[test]
fn everybody_alone_goes_round_its_waypoints() {
    for model in [WalkModel::Scripted, WalkModel::ScriptedYielding, WalkModel::SocialForce, WalkModel::Orca] {
        let person = common::walker((1.0, 2.0), (9.0, 2.0), model, true);
        // 8 m at 0.8 m/s: ten seconds a way.
        let counts = rounds(&mut simulation(world(vec![person]), 0), 450);
        assert!((4..=5).contains(&counts[0]), "{model:?} {counts:?}");
    }
}

#[test]
fn two_who_yield_to_each_other_do_not_wait_for_ever() {
    let people = vec![
        common::walker((1.0, 2.0), (9.0, 2.0), WalkModel::ScriptedYielding, false),
        common::walker((9.0, 2.0), (1.0, 2.0), WalkModel::ScriptedYielding, false),
    ];
    let counts = rounds(&mut simulation(world(people), 0), 600);
    assert!(counts.iter().all(|&count| count >= 3), "{counts:?}");
}

#[test]
fn who_yields_waits_for_a_robot_that_it_sees_and_walks_into_one_that_it_does_not() {
    for sees_robot in [true, false] {
        let person = common::walker((6.0, 9.5), (0.5, 9.5), WalkModel::ScriptedYielding, sees_robot);
        let mut simulation = simulation(world(vec![person]), 0);
        let hit = (0..300).any(|_| simulation.step(Twist::ZERO) == Outcome::Collided);
        assert_eq!(hit, !sees_robot);
    }
}

#[test]
fn people_who_avoid_pass_each_other_and_a_standing_robot() {
    for model in AVOIDING {
        for seed in 0..5 {
            let people = vec![
                common::walker((1.0, 5.0), (9.0, 5.0), model, true),
                common::walker((9.0, 5.0), (1.0, 5.0), model, true),
            ];
            let mut simulation = simulation(World { start: Pose::new(3.0, 5.0, 0.0), ..world(people) }, seed);
            let mut passed = false;
            for _ in 0..200 {
                assert_eq!(simulation.step(Twist::ZERO), Outcome::Running, "{model:?} hit the robot");
                let [a, b] = simulation.people() else { panic!("two people") };
                let gap_m = (a.position - b.position).norm() - a.radius_m - b.radius_m;
                assert!(gap_m > -0.02, "{model:?} overlap by {gap_m}");
                passed |= a.position.x > 8.0;
            }
            assert!(passed, "{model:?} seed {seed} never got by");
        }
    }
}

#[test]
fn nobody_who_sees_it_walks_into_a_robot_that_stands_at_whatever_speed() {
    for model in AVOIDING {
        for (case, speed_mps) in (0..60).zip([0.7, 1.1, 1.34, 1.6, 2.0].into_iter().cycle()) {
            // In the open, or between walls 2.4 m apart.
            let aside_m = (case / 5 % 6) as f32 * 0.1 - 0.25;
            let walled = case >= 30;
            let mut person = common::walker((9.0, 5.0 + aside_m), (1.0, 5.0 - aside_m), model, true);
            person.speed_mps = speed_mps;
            let wall = |y_m: f32| Segment { a: Point::new(0.0, y_m), b: Point::new(10.0, y_m) };
            let segments = if walled { vec![wall(3.8), wall(6.2)] } else { vec![] };
            let world = World { start: Pose::new(5.0, 5.0, 0.0), segments, ..world(vec![person]) };
            let mut simulation = simulation(world, case);
            let mut farthest_m = f32::INFINITY;
            for step in 0..300 {
                let outcome = simulation.step(Twist::ZERO);
                assert_eq!(
                    outcome,
                    Outcome::Running,
                    "{model:?} at {speed_mps} m/s, {aside_m} m aside, walled {walled}: hit in step {step}"
                );
                farthest_m = farthest_m.min(simulation.people()[0].position.x);
            }
            assert!(farthest_m < 3.0, "{model:?} at {speed_mps} m/s never got by: {farthest_m}");
        }
    }
}

#[test]
fn people_who_do_not_see_the_robot_walk_into_it() {
    for model in [WalkModel::Scripted, WalkModel::ScriptedYielding, WalkModel::SocialForce, WalkModel::Orca] {
        let person = common::walker((9.0, 5.0), (1.0, 5.0), model, false);
        let mut simulation = simulation(World { start: Pose::new(5.0, 5.0, 0.0), ..world(vec![person]) }, 1);
        let hit = (0..300).any(|_| simulation.step(Twist::ZERO) == Outcome::Collided);
        assert!(hit && simulation.hit_while_standing(), "{model:?}");
    }
}

/// Many people who avoid, in a room with walls, discs and a block: nobody is ever pushed through
/// anything or more than centimetres into it, and nobody is faster than its limit.
#[test]
fn people_who_avoid_stay_out_of_obstacles_in_a_dense_crowd() {
    for model in AVOIDING {
        let mut people = Vec::new();
        for k in 0..10_u8 {
            let at = 0.8 + 0.85 * f32::from(k);
            people.push(common::walker((at, 1.0), (9.6 - at, 9.0), model, k % 2 == 0));
            people.push(common::walker((1.0, at.max(1.9)), (9.0, 10.2 - at.max(1.9)), model, k % 2 == 0));
        }
        let block = [(4.5, 4.5), (5.5, 4.5), (5.5, 5.5), (4.5, 5.5)].map(|(x, y)| Point::new(x, y));
        let crowded = World {
            discs: vec![Disc { center: Point::new(3.0, 7.0), radius_m: 0.5 }],
            segments: vec![Segment { a: Point::new(6.5, 2.5), b: Point::new(8.0, 4.0) }],
            polygons: vec![Polygon { vertices: block.to_vec() }],
            ..world(people)
        };
        let mut simulation = simulation(crowded, 3);
        let mut before: Vec<Point> = simulation.people().iter().map(|person| person.position).collect();
        let mut watched = 0;
        for step in 0..600 {
            if simulation.step(Twist::ZERO).is_over() {
                break;
            }
            watched = step;
            for (person, before) in simulation.people().iter().zip(&mut before) {
                let room_m = simulation.obstacles().distance_m(person.position, 1.0) - person.radius_m;
                assert!(room_m > -0.06, "{model:?} step {step}: {room_m} at {}", person.position);
                let moved_m = (person.position - *before).norm();
                assert!(moved_m <= 1.3 * 0.8 * 0.1 + 0.06, "{model:?}: {moved_m}");
                *before = person.position;
            }
        }
        assert!(watched > 60, "{model:?}: the episode ended after {watched} steps, before they met");
    }
}

#[test]
fn people_on_top_of_each_other_walk_apart_the_same_way_each_time() {
    let positions = |seed| {
        let person = common::walker((5.0, 5.0), (1.0, 5.0), WalkModel::Orca, false);
        let mut simulation = simulation(world(vec![person.clone(), person.clone(), person]), seed);
        for _ in 0..40 {
            simulation.step(Twist::ZERO);
        }
        simulation.people().iter().map(|person| person.position).collect::<Vec<_>>()
    };
    let first = positions(0);
    assert_eq!(first, positions(0));
    assert!(first.iter().all(|position| position.x.is_finite() && position.y.is_finite()));
    assert!((first[0] - first[1]).norm() > 0.3, "{first:?}");
}

#[test]
fn a_world_of_odd_people_is_survived() {
    let mut nowhere = common::walker((5.0, 5.0), (5.0, 5.0), WalkModel::SocialForce, true);
    nowhere.waypoints.clear();
    let mut single = common::walker((2.0, 2.0), (4.0, 2.0), WalkModel::Orca, true);
    single.waypoints.truncate(1);
    let mut simulation = simulation(world(vec![nowhere, single]), 0);
    for _ in 0..200 {
        simulation.step(Twist::ZERO);
    }
    let [nowhere, single] = simulation.people() else { panic!("two people") };
    assert!((nowhere.position - Point::new(5.0, 5.0)).norm() < 0.3, "{nowhere:?}");
    assert!((single.position - Point::new(4.0, 2.0)).norm() < 0.2, "{single:?}");
}

/// Twelve people of all models, half of them each way, in a passage of 2.2 m: the jam dissolves.
#[test]
fn two_streams_pass_each_other_in_a_passage() {
    let wall = |low: f32, high: f32| Polygon {
        vertices: [(3.0, low), (7.0, low), (7.0, high), (3.0, high)].map(|(x, y)| Point::new(x, y)).to_vec(),
    };
    let models =
        [WalkModel::ScriptedYielding, WalkModel::SocialForce, WalkModel::SocialForce, WalkModel::Orca];
    let people: Vec<Person> = (0..12_u8)
        .map(|k| {
            let (near, far) = ((2.2 - 0.15 * f32::from(k), 4.5), (7.8, 4.5));
            let back = [(7.8, 5.5), (2.2, 5.5)].map(|(x, y)| Point::new(x, y));
            let mut person = common::walker(near, far, models[usize::from(k) % 4], false);
            person.waypoints.splice(1..1, back);
            if k % 2 == 1 {
                person.start = Point::new(7.8 + 0.15 * f32::from(k), 5.5);
                person.waypoints.rotate_left(2);
            }
            person
        })
        .collect();
    let crowded = World { polygons: vec![wall(0.5, 3.9), wall(6.1, 9.0)], ..world(people) };
    let mut simulation = simulation(crowded, 1);
    let mut crossings = vec![0; 12];
    let mut side: Vec<bool> = simulation.people().iter().map(|person| person.position.x > 5.0).collect();
    for _ in 0..900 {
        simulation.step(Twist::ZERO);
        for (index, person) in simulation.people().iter().enumerate() {
            let is_past = if side[index] { person.position.x < 3.0 } else { person.position.x > 7.0 };
            if is_past {
                side[index] = !side[index];
                crossings[index] += 1;
            }
        }
    }
    // 90 s at 0.8 m/s would do for ten crossings on a free way.
    assert!(crossings.iter().all(|&count| count >= 2), "{crossings:?}");
    assert!(crossings.iter().sum::<i32>() >= 48, "{crossings:?}");
}
