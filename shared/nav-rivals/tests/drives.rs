//! The rivals drive: every one of the list, and those that follow a path by the localised pose.

use nav_core::footprint::Footprint;
use nav_core::geometry::{Point, Pose};
use nav_core::metrics::EpisodeEnd;
use nav_core::task::{Lidar, Robot, ShieldMode, Task};
use nav_env::robot::SimulatedRobot;
use nav_env::robot_profile::RobotProfile;
use nav_env::worlds::Place;
use nav_rivals::Rival;
use nav_sim::disturbance::Disturbance;
use nav_sim::families::{Family, Split};
use nav_sim::localiser::Localiser;
use nav_sim::world::{Bounds, Polygon, World};
use std::sync::Arc;

/// How a rival ends in the first validation worlds of a family.
fn ends(rival: Rival, family: Family, disturbance: &Disturbance, shield: ShieldMode) -> Vec<EpisodeEnd> {
    let task = Task { shield, ..Task::default() };
    let mut driver = rival.driver(&task);
    let mut robot = SimulatedRobot::new(&task, disturbance);
    let places = (0..10).map(|seed| Place::generated(family, Split::Validation, seed, &task.robot.footprint));
    places.map(|place| robot.drive(&mut *driver, &place, false).metrics.end).collect()
}

fn successes(ends: &[EpisodeEnd]) -> usize {
    ends.iter().filter(|end| **end == EpisodeEnd::Success).count()
}

#[test]
fn every_rival_of_the_list_finds_its_way_through_clutter() {
    for rival in Rival::ALL {
        assert_eq!(Rival::named(rival.id()), Some(rival));
        let ends = ends(rival, Family::Clutter, &Disturbance::none(), ShieldMode::On);
        assert!(successes(&ends) >= 9, "{rival}: {ends:?}");
    }
}

/// In the odometry's frame the path of a maze would soon lead through walls.
#[test]
fn a_path_on_the_map_is_followed_by_the_localised_pose() {
    let drifting = Disturbance {
        odometry_drift: [0.1; 2],
        localiser: Localiser { period_s: 0.5, ..Localiser::default() },
        ..Disturbance::none()
    };
    for rival in [Rival::Astar, Rival::Dijkstra] {
        let ends = ends(rival, Family::Maze, &drifting, ShieldMode::On);
        assert_eq!(successes(&ends), ends.len(), "{rival}: {ends:?}");
    }
}

/// A planner that knows the map keeps to ways that the safety gate lets through.
#[test]
fn the_safety_gate_costs_a_planner_no_goal() {
    for family in [Family::UTrap, Family::DeepU, Family::MazeTight, Family::Tight] {
        for shield in [ShieldMode::Off, ShieldMode::On] {
            let ends = ends(Rival::Astar, family, &Disturbance::usual(), shield);
            assert_eq!(successes(&ends), ends.len(), "{family}, gate {shield}: {ends:?}");
        }
    }
}

/// What the gate keeps free for the lidar's errors is not smaller for a small robot: where it has the choice, the planner
/// takes the wider way.
#[test]
fn a_small_robot_is_led_through_what_the_gate_lets_through() {
    let burger = RobotProfile::read("turtlebot3_burger").expect("built in");
    // As a disc it turns in a smaller circle, and its worlds are narrower.
    let robot = Robot { footprint: Footprint::circle(0.105), ..burger.robot };
    let task = Task { lidar: burger.lidar, control_period_s: burger.control_period_s, ..Task::of(robot) };
    let mut driver = Rival::Astar.driver(&task);
    let mut robot = SimulatedRobot::new(&task, &Disturbance::usual().on(&task.robot));
    for seed in [0, 65, 70] {
        let place = Place::generated(Family::Clutter, Split::Validation, seed, &task.robot.footprint);
        let end = robot.drive(&mut *driver, &place, false).metrics.end;
        assert_eq!(end, EpisodeEnd::Success, "clutter {seed}");
    }
}

/// Backwards to a goal that lies close behind it, if it may: turning round takes longer.
#[test]
fn the_clairvoyant_reverses_where_that_is_faster() {
    let time_s = |linear_min_mps| {
        let task = Task { robot: Robot { linear_min_mps, ..Robot::default() }, ..Task::default() };
        let world = World {
            name: "behind".into(),
            bounds: Bounds { min: Point::origin(), max: Point::new(6.0, 4.0) },
            discs: Vec::new(),
            segments: Vec::new(),
            polygons: Vec::new(),
            people: Vec::new(),
            start: Pose::new(4.0, 2.0, 0.0),
            goal: Point::new(2.5, 2.0),
        };
        let place = Place::read("behind", Arc::new(world), 1, &task.robot.footprint);
        let mut robot = SimulatedRobot::new(&task, &Disturbance::none());
        let metrics = robot.drive(&mut *Rival::Clairvoyant.driver(&task), &place, false).metrics;
        assert_eq!(metrics.end, EpisodeEnd::Success);
        metrics.time_s
    };
    let (round_s, back_s) = (time_s(0.0), time_s(-1.0));
    assert!(back_s < 3.0 && round_s > back_s + 0.8, "{round_s} s round, {back_s} s back");
}

/// Wherever people walk, whoever knows where they will be gets through: the worlds are fair.
#[test]
fn the_clairvoyant_reaches_every_goal_among_people_and_the_same_way_again() {
    for family in Family::ALL.into_iter().filter(|family| family.has_people()) {
        let task = Task::default();
        let mut driver = Rival::Clairvoyant.driver(&task);
        let mut robot = SimulatedRobot::new(&task, &Disturbance::usual());
        for seed in 0..8 {
            let place = Place::generated(family, Split::Validation, seed, &task.robot.footprint);
            let [once, again] = [(); 2].map(|()| robot.drive(&mut *driver, &place, false).metrics);
            assert_eq!(once.end, EpisodeEnd::Success, "{}", place.world.name);
            assert_eq!(once, again, "{}", place.world.name);
        }
    }
}

/// Two processes drive one episode after another, an evaluation as many side by side as there are cores: the same rows.
#[test]
fn an_episode_does_not_depend_on_those_before_it() {
    let task = Task::default();
    for family in [Family::Crowd, Family::Tight] {
        let place = |seed| Place::generated(family, Split::Validation, seed, &task.robot.footprint);
        let drive = |seeds: &mut dyn Iterator<Item = u64>| -> Vec<(u64, u32)> {
            let mut driver = Rival::Reactive.driver(&task);
            let mut robot = SimulatedRobot::new(&task, &Disturbance::usual());
            seeds.map(|seed| (seed, robot.drive(&mut *driver, &place(seed), false).metrics.steps)).collect()
        };
        let there = drive(&mut (0..100));
        let mut back = drive(&mut (0..100).rev());
        back.reverse();
        let differ = there.iter().zip(&back).filter(|(a, b)| a != b).count();
        assert_eq!(differ, 0, "{family}: of 100 worlds");
    }
}

/// A gap that a long box fits through straight on, and that the circle that it turns in does not.
#[test]
fn a_box_drives_through_a_gap_that_it_could_not_turn_in() {
    let footprint = Footprint::Rectangle { front_m: 0.45, rear_m: 0.45, half_width_m: 0.2 };
    let robot = Robot { footprint, ..Robot::default() };
    let wall = |x: f32, low: f32, high: f32| {
        let vertices = [(x, low), (x + 0.8, low), (x + 0.8, high), (x, high)];
        Polygon { vertices: vertices.map(|(x, y)| Point::new(x, y)).to_vec() }
    };
    let gap_m = 0.8;
    assert!(2.0 * footprint.half_width_m() < gap_m && gap_m < 2.0 * footprint.circumradius_m() - 0.1);
    let (low, high) = (4.0 - 0.5 * gap_m, 4.0 + 0.5 * gap_m);
    let world = |start: Pose| World {
        name: "gap".into(),
        bounds: Bounds { min: Point::origin(), max: Point::new(12.0, 8.0) },
        discs: Vec::new(),
        segments: Vec::new(),
        polygons: vec![wall(5.6, 0.0, low), wall(5.6, high, 8.0)],
        people: Vec::new(),
        start,
        goal: Point::new(10.0, 4.0),
    };
    for shield in [ShieldMode::Off, ShieldMode::On] {
        for mount in [Pose::default(), Pose::new(0.4, 0.0, 0.0)] {
            let of = Task::of(robot);
            let task = Task { shield, lidar: Lidar { mount, ..of.lidar }, ..of };
            let (mut driver, mut simulated) =
                (Rival::Astar.driver(&task), SimulatedRobot::new(&task, &Disturbance::none()));
            for start in [Pose::new(2.0, 4.0, 0.0), Pose::new(2.0, 2.0, 1.5), Pose::new(1.5, 5.5, -2.5)] {
                let place = Place::read("gap", Arc::new(world(start)), 1, &footprint);
                let end = simulated.drive(&mut *driver, &place, false).metrics.end;
                assert_eq!(end, EpisodeEnd::Success, "gate {shield}, lidar at {mount:?}, from {start:?}");
            }
        }
    }
    let round = Task::of(Robot { footprint: Footprint::circle(footprint.circumradius_m()), ..robot });
    let place = Place::read("gap", Arc::new(world(Pose::new(2.0, 4.0, 0.0))), 1, &round.robot.footprint);
    assert_eq!(place.geodesic_m(), None, "a disc of its size does not pass");
}
