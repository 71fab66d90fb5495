use super::scene::Scene;
use super::*;
use crate::geodesic::GeodesicField;
use crate::world::{Beside, Person, WalkModel, Whom};
use nav_core::geometry::Point;
use std::sync::LazyLock;

const ROBOT: Footprint = Footprint::circle(0.2);

const SPLITS: [Split; 3] = [Split::Train, Split::Validation, Split::Test];
const SEEDS: u64 = 60;

/// The same seeds of every family and split, generated once.
fn every_world() -> impl Iterator<Item = &'static (Family, Split, World)> {
    static WORLDS: LazyLock<Vec<(Family, Split, World)>> = LazyLock::new(|| {
        Family::ALL
            .into_iter()
            .flat_map(|family| SPLITS.map(|split| (family, split)))
            .flat_map(|(family, split)| {
                (0..SEEDS).map(move |seed| (family, split, generate(family, split, seed)))
            })
            .collect()
    });
    WORLDS.iter()
}

#[test]
fn every_world_has_a_path_and_room_at_both_ends() {
    for (_, _, world) in every_world() {
        let scene = Scene::of(world);
        let (start, goal) = (world.start.position(), world.goal);
        assert!(scene.clearance_m(start) >= 0.35, "start of {}", world.name);
        assert!(scene.clearance_m(goal) >= 0.35, "goal of {}", world.name);
        let path_m = GeodesicField::new(world, &ROBOT).distance_m(start).expect("every world has a path");
        assert!(path_m >= (goal - start).norm() && path_m <= PATH_MAX_M, "{path_m} m in {}", world.name);
    }
}

#[test]
fn paths_keep_their_margin() {
    for (_, _, world) in every_world().step_by(7) {
        let scene = Scene::of(world);
        let path =
            GeodesicField::new(world, &ROBOT).path(world.start.position()).expect("every world has a path");
        assert_eq!(path.last(), Some(&world.goal));
        for pair in path.windows(2) {
            // Cells are judged at their centre: half a diagonal is lost between centres.
            assert!(scene.is_leg_free(pair[0], pair[1], 0.18), "{pair:?} in {}", world.name);
        }
    }
}

#[test]
fn goals_are_not_near_and_traps_lie_in_between() {
    for (family, _, world) in every_world() {
        let straight_m = (world.goal - world.start.position()).norm();
        match family {
            Family::UTrap | Family::DeepU | Family::Hook => {
                let is_blocked = !Scene::of(world).is_leg_free(world.start.position(), world.goal, 0.02);
                assert!(is_blocked, "{}", world.name);
            }
            _ => assert!(straight_m > 3.0, "{straight_m} m in {}", world.name),
        }
    }
}

#[test]
fn people_have_room_to_start_and_to_walk() {
    let mut counts = [0; 4];
    let mut seeing = 0;
    for (family, split, world) in every_world() {
        let expected = match *family {
            Family::Crowd => 14..=24,
            Family::Stream => 8..=16,
            Family::Corridor => 3..=32,
            Family::Doorway => 3..=26,
            _ => 0..=0,
        };
        assert!(expected.contains(&world.people.len()), "{} people in {}", world.people.len(), world.name);
        let scene = Scene::of(world);
        for (index, person) in world.people.iter().enumerate() {
            assert!((person.start - world.start.position()).norm() >= 1.5, "{}", world.name);
            assert!(
                world.people[..index]
                    .iter()
                    .all(|other| { (other.start - person.start).norm() > other.radius_m + person.radius_m })
            );
            if person.beside.is_some() {
                continue;
            }
            let legs = std::iter::once(&person.start)
                .chain(&person.waypoints)
                .zip(person.waypoints.iter().chain(&person.waypoints[..1]));
            for (&a, &b) in legs {
                assert!(scene.is_leg_free(a, b, person.radius_m), "{a} to {b} in {}", world.name);
            }
            if !matches!(family, Family::Crowd | Family::Stream) {
                continue;
            }
            let fastest_mps = if *split == Split::Test { 1.1 } else { 0.9 };
            assert!(person.speed_mps >= 0.3 && person.speed_mps <= fastest_mps);
            counts[person.model as usize] += 1;
            seeing += usize::from(person.sees_robot && person.model != WalkModel::Scripted);
        }
    }
    let all: usize = counts.iter().sum();
    let share = |count: usize| count as f32 / all as f32;
    for (model, expected) in [
        (WalkModel::Scripted, 0.2),
        (WalkModel::ScriptedYielding, 0.2),
        (WalkModel::SocialForce, 0.4),
        (WalkModel::Orca, 0.2),
    ] {
        assert!((share(counts[model as usize]) - expected).abs() < 0.03, "{counts:?}");
    }
    // Half of those who see anybody.
    assert!((share(seeing) - 0.4).abs() < 0.03, "{seeing} of {all}");
}

/// Weidmann's speeds and the shoulders of ANSUR II, and all that people do together.
#[test]
fn corridors_and_doorways_have_people_as_they_are_measured() {
    for family in [Family::Corridor, Family::Doorway] {
        let worlds: Vec<_> =
            every_world().filter(|(of, ..)| *of == family).map(|(_, _, world)| world).collect();
        let everybody = || worlds.iter().flat_map(|world| &world.people);
        let mean = |values: Vec<f32>| values.iter().sum::<f32>() / values.len() as f32;
        // Of those who walk alone: groups are slower.
        let leads = |world: &World, index| {
            world.people.iter().any(|other| {
                matches!(other.beside, Some(Beside { whom: Whom::Person(leader), .. }) if leader == index)
            })
        };
        let single = |world: &World| {
            let people = world.people.iter().enumerate();
            let single = people
                .filter(|(index, person)| person.waypoints.len() > 1 && !leads(world, *index))
                .map(|(_, person)| person.speed_mps);
            single.collect::<Vec<_>>()
        };
        let speed_mps = mean(worlds.iter().flat_map(|world| single(world)).collect());
        assert!((speed_mps - 1.34).abs() < 0.05, "{family}: {speed_mps} m/s");
        let radius_m = mean(everybody().map(|person| person.radius_m).collect());
        assert!((radius_m - 0.24).abs() < 0.005, "{family}: {radius_m} m");
        let count = |what: fn(&&Person) -> bool| everybody().filter(what).count();
        let kinds = [
            count(|person| matches!(person.beside, Some(Beside { whom: Whom::Person(_), .. }))),
            count(|person| matches!(person.beside, Some(Beside { whom: Whom::Robot, .. }))),
            count(|person| person.stop.is_some()),
            count(|person| person.waypoints.len() == 1),
        ];
        assert!(kinds.iter().all(|&kind| kind > 15), "{family}: {kinds:?}");
        for world in &worlds {
            crate::world_file::check(world, &ROBOT)
                .unwrap_or_else(|problem| panic!("{}: {problem}", world.name));
        }
    }
}

#[test]
fn families_of_people_say_so_and_the_measured_ones_are_for_tests_only() {
    assert!([Family::Corridor, Family::Doorway].into_iter().all(|family| !family.trainable()));
    for family in Family::ALL {
        let world = generate(family, Split::Validation, 0);
        assert_eq!(family.has_people(), !world.people.is_empty(), "{family}");
    }
}

#[test]
fn the_same_seed_gives_the_same_world_and_no_two_worlds_are_equal() {
    let mut seen = Vec::new();
    for (index, (family, split, world)) in every_world().enumerate() {
        if index % 5 == 0 {
            assert_eq!(world, &generate(*family, *split, index as u64 % SEEDS));
        }
        let nameless = World { name: String::new(), ..world.clone() };
        seen.push((family, format!("{nameless:?}"), &world.name));
    }
    seen.sort();
    for pair in seen.windows(2) {
        assert_ne!((pair[0].0, &pair[0].1), (pair[1].0, &pair[1].1), "{} equals {}", pair[0].2, pair[1].2);
    }
}

#[test]
fn no_two_worlds_draw_the_same_disturbance() {
    let seeds: std::collections::HashSet<u64> = Family::ALL
        .into_iter()
        .flat_map(|family| SPLITS.map(|split| (family, split)))
        .flat_map(|(family, split)| (0..1000).map(move |seed| simulation_seed(family, split, seed)))
        .collect();
    assert_eq!(seeds.len(), Family::ALL.len() * SPLITS.len() * 1000);
}

#[test]
fn walls_are_merged() {
    for (family, split, seed) in [(Family::Maze, Split::Train, 3), (Family::Rooms, Split::Test, 4)] {
        let world = generate(family, split, seed);
        let joined = world
            .segments
            .iter()
            .enumerate()
            .flat_map(|(index, a)| world.segments[index + 1..].iter().map(move |b| (a, b)));
        for (a, b) in joined {
            let (along_a, along_b) = (a.b - a.a, b.b - b.a);
            let is_parallel = along_a.perp(&along_b).abs() < 1e-3;
            let touches =
                [a.a, a.b].iter().any(|p: &Point| (p - b.a).norm() < 1e-3 || (p - b.b).norm() < 1e-3);
            assert!(!(is_parallel && touches), "{a:?} and {b:?} in {}", world.name);
        }
    }
}

#[test]
fn names_go_there_and_back() {
    for family in Family::ALL {
        assert_eq!(family.id().parse(), Ok(family));
        let toml = toml::Value::try_from(family).expect("a family is a string");
        assert_eq!(toml.as_str(), Some(family.id()));
    }
    for split in SPLITS {
        assert_eq!(split.id().parse(), Ok(split));
    }
    let error = "mazes".parse::<Family>().expect_err("there is no such family");
    assert!(error.to_string().contains("mazes") && error.to_string().contains("maze_tight"), "{error}");
}

#[test]
fn a_world_is_as_large_as_its_robot_and_its_people_are_as_they_are() {
    for (family, seed) in [(Family::Rooms, 3), (Family::Crowd, 4), (Family::Doorway, 5)] {
        let reference = generate(family, Split::Validation, seed);
        for (radius_m, factor) in [(0.4, 2.0), (0.1, if family.has_people() { 1.0 } else { 0.7 })] {
            let footprint = Footprint::circle(radius_m);
            let (world, field) = generate_with_field(family, Split::Validation, seed, &footprint);
            let mut expected = reference.clone();
            expected.grow(factor);
            assert_eq!(world, expected, "{family} for {radius_m} m");
            let length_m = |world: &World| (world.goal - world.start.position()).norm();
            assert!((length_m(&world) - factor * length_m(&reference)).abs() < 1e-4);
            assert!(
                field.distance_m(world.start.position()).is_some(),
                "{family} has a way for {radius_m} m"
            );
            let sizes = |world: &World| {
                world.people.iter().map(|who| (who.radius_m, who.speed_mps)).collect::<Vec<_>>()
            };
            assert_eq!(sizes(&world), sizes(&reference));
            assert_eq!(crate::world_file::check(&world, &footprint), Ok(()), "{family} for {radius_m} m");
        }
    }
}

#[test]
fn episodes_last_by_distance_over_speed() {
    let robot = |radius_m, linear_max_mps| Robot {
        footprint: Footprint::circle(radius_m),
        linear_max_mps,
        ..Robot::default()
    };
    assert_eq!(Family::Rooms.episode_s(&robot(0.2, 1.0)).to_bits(), 50.0_f32.to_bits());
    assert_eq!(Family::Maze.episode_s(&robot(0.4, 0.5)).to_bits(), 320.0_f32.to_bits());
    // Where people walk, a small robot's world is as large as the reference robot's.
    assert_eq!(Family::Crowd.episode_s(&robot(0.1, 0.5)).to_bits(), 100.0_f32.to_bits());
}
