//! Reset and step: determinism, limits, ends.

mod common;

use common::{FULL_AHEAD, busy_world, simulation};
use nav_core::footprint::Footprint;
use nav_core::geometry::{Point, Pose};
use nav_core::messages::LaserScan;
use nav_core::task::{Lidar, Robot, Task};
use nav_core::twist::Twist;
use nav_sim::disturbance::Disturbance;
use nav_sim::simulation::{Outcome, Simulation};
use nav_sim::world::{Bounds, Disc, Polygon, Segment, WalkModel, World};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::sync::Arc;

/// Discs and rectangles of a robot's size.
fn footprints() -> impl Strategy<Value = Footprint> {
    let rectangle = (0.05..0.4_f32, 0.05..0.4_f32, 0.05..0.3_f32);
    prop_oneof![
        (0.05..0.5_f32).prop_map(Footprint::circle),
        rectangle.prop_map(|(front_m, rear_m, half_width_m)| Footprint::Rectangle {
            front_m,
            rear_m,
            half_width_m
        }),
    ]
}

/// Every bit that a learner can see over 500 random steps, with resets.
fn trace(simulation: &mut Simulation) -> Vec<u32> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(99);
    let mut scan = LaserScan::default();
    let mut bits = Vec::new();
    for step in 0..500_u64 {
        let command =
            Twist { linear_mps: rng.random_range(-0.2..1.2), angular_radps: rng.random_range(-1.5..1.5) };
        if simulation.step(command).is_over() {
            bits.push(u32::from(simulation.hit_while_standing()));
            simulation.reset(Arc::clone(simulation.world()), step);
        }
        simulation.scan(&mut scan);
        let (pose, odometry) = (simulation.pose(), simulation.odometry());
        let clearances = [simulation.clearance_m(), simulation.time_to_collision_s()];
        let numbers = [pose.x_m, pose.y_m, pose.yaw_rad, odometry.pose.x_m, odometry.pose.yaw_rad];
        let people = simulation.people().iter().flat_map(|person| [person.position.x, person.velocity.y]);
        bits.extend(numbers.into_iter().chain(clearances).chain(people).map(f32::to_bits));
        bits.extend(scan.ranges_m().iter().map(|range_m| range_m.to_bits()));
    }
    bits
}

#[test]
fn the_same_seed_gives_the_same_bits() {
    let begin = |seed| simulation(busy_world(), &Disturbance::usual(), seed);
    let first = trace(&mut begin(7));
    assert_eq!(first, trace(&mut begin(7)));
    assert_ne!(first, trace(&mut begin(8)), "another seed must differ");
    let mut used = begin(3);
    trace(&mut used);
    used.reset(Arc::new(busy_world()), 7);
    assert_eq!(first, trace(&mut used), "a reset simulation must equal a new one");
    assert_eq!(first, trace(&mut begin(7).clone()));
}

#[test]
fn only_a_robot_that_may_drives_backwards() {
    for linear_min_mps in [0.0, -0.5] {
        let robot = Robot { linear_min_mps, ..Robot::default() };
        let task = Task { robot, ..Task::default() };
        let mut simulation = Simulation::new(Arc::new(common::room(10.0)), &task, &Disturbance::none(), 1);
        let start = simulation.pose();
        for _ in 0..10 {
            simulation.step(Twist { linear_mps: -9.0, angular_radps: 0.0 });
        }
        assert!((simulation.velocity().linear_mps - linear_min_mps).abs() < 1e-5);
        let back_m = -start.local_from_parent(simulation.pose().position()).x;
        // Less than a second at that speed: 0.25 s of braking distance are lost on the way to it.
        assert!(
            back_m <= -linear_min_mps && back_m >= -0.8 * linear_min_mps,
            "{back_m} m at {linear_min_mps}"
        );
        assert!(simulation.odometry().linear_mps <= 0.0);
    }
}

#[test]
fn a_scan_asked_twice_is_the_same_and_the_next_step_is_another() {
    let mut simulation = simulation(common::room(10.0), &Disturbance::usual(), 1);
    let (mut first, mut again) = (LaserScan::default(), LaserScan::default());
    let bits = |scan: &LaserScan| scan.ranges_m().iter().map(|range| range.to_bits()).collect::<Vec<_>>();
    simulation.scan(&mut first);
    simulation.scan(&mut again);
    assert_eq!(bits(&first), bits(&again));
    assert_eq!((first.header.seq, first.header.stamp_ns), (1, 100_000_000));
    simulation.step(Twist::ZERO);
    simulation.scan(&mut again);
    assert_ne!(bits(&first), bits(&again));
    assert_eq!((again.header.seq, again.header.stamp_ns), (2, 200_000_000));
    assert_eq!(simulation.odometry().header, again.header);
    assert_eq!(simulation.goal(5).header, again.header);
}

#[test]
fn velocities_and_accelerations_stay_within_the_limits() {
    let robot = Robot::default();
    let mut simulation = simulation(common::room(60.0), &Disturbance::none(), 0);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(2);
    let mut before = simulation.velocity();
    for _ in 0..400 {
        let command =
            Twist { linear_mps: rng.random_range(-9.0..9.0), angular_radps: rng.random_range(-9.0..9.0) };
        if simulation.step(command).is_over() {
            simulation.reset(Arc::clone(simulation.world()), 0);
            before = Twist::ZERO;
            continue;
        }
        let now = simulation.velocity();
        assert!((0.0..=robot.linear_max_mps).contains(&now.linear_mps), "{now:?}");
        assert!(now.angular_radps.abs() <= robot.angular_max_radps, "{now:?}");
        assert!((now.linear_mps - before.linear_mps).abs() <= robot.linear_acceleration_mps2 * 0.1 + 1e-5);
        assert!(
            (now.angular_radps - before.angular_radps).abs()
                <= robot.angular_acceleration_radps2 * 0.1 + 1e-5
        );
        before = now;
    }
    simulation.step(Twist { linear_mps: f32::NAN, angular_radps: f32::INFINITY });
    assert!(simulation.pose().x_m.is_finite() && simulation.velocity().angular_radps.is_finite());
}

#[test]
fn episodes_end_by_goal_and_by_time_and_then_stand_still() {
    let near = World { goal: Point::new(2.0, 1.0), ..common::room(10.0) };
    let mut reaching = simulation(near, &Disturbance::none(), 0);
    while reaching.step(FULL_AHEAD) == Outcome::Running {}
    assert_eq!(reaching.outcome(), Outcome::Reached);
    assert!((reaching.pose().x_m - 1.7).abs() < 0.051, "{:?}", reaching.pose());
    let (pose, steps) = (reaching.pose(), reaching.steps());
    assert_eq!(reaching.step(FULL_AHEAD), Outcome::Reached);
    assert_eq!((reaching.pose(), reaching.steps()), (pose, steps));

    let mut waiting = simulation(common::room(10.0), &Disturbance::none(), 0);
    let outcomes: Vec<Outcome> = (0..500).map(|_| waiting.step(Twist::ZERO)).collect();
    assert!(outcomes[..499].iter().all(|outcome| !outcome.is_over()));
    assert_eq!(outcomes[499], Outcome::TimedOut);
    assert!((waiting.time_s() - 50.0).abs() < 1e-3);
}

#[test]
fn who_is_run_over_while_standing_is_told_apart() {
    let people = vec![common::walker((5.0, 1.0), (0.5, 1.0), WalkModel::Scripted, false)];
    let mut simulation = simulation(World { people, ..common::room(10.0) }, &Disturbance::none(), 0);
    assert!((simulation.time_to_collision_s()).is_infinite(), "nobody moves yet");
    simulation.step(Twist::ZERO);
    let expected_s = (5.0 - 0.08 - 1.0 - 0.45) / 0.8;
    assert!(
        (simulation.time_to_collision_s() - expected_s).abs() < 1e-3,
        "{}",
        simulation.time_to_collision_s()
    );
    while simulation.step(Twist::ZERO) == Outcome::Running {}
    assert_eq!(simulation.outcome(), Outcome::Collided);
    assert!(simulation.hit_while_standing());
    assert!(simulation.time_to_collision_s() <= 0.0, "it is here");
}

#[test]
fn time_to_a_wall_counts_down_while_driving_at_it() {
    let mut simulation = simulation(common::room(10.0), &Disturbance::none(), 0);
    for _ in 0..20 {
        simulation.step(FULL_AHEAD);
    }
    let expected_s = (10.0 - 0.2 - simulation.pose().x_m) / 1.0;
    assert!((simulation.time_to_collision_s() - expected_s).abs() < 1e-3);
    assert!((simulation.clearance_m() - 0.8).abs() < 1e-3, "{}", simulation.clearance_m());
}

#[test]
fn a_world_of_nonsense_breaks_nothing() {
    let odd = [f32::NAN, f32::INFINITY, -1e30, 1e9];
    for (bad, many) in odd.into_iter().flat_map(|bad| [(bad, false), (bad, true)]) {
        let mut world = busy_world();
        world.bounds.max.x = bad;
        world.discs.push(Disc { center: Point::new(bad, 1.0), radius_m: 0.3 });
        world.segments.push(Segment { a: Point::new(bad, 0.0), b: Point::new(0.0, 9.0) });
        world.polygons.push(Polygon { vertices: vec![Point::new(0.0, bad), Point::new(3.0, 9.0)] });
        world.polygons.push(Polygon { vertices: Vec::new() });
        if many {
            world.segments.extend(vec![Segment { a: Point::new(9.0, 9.0), b: Point::new(9.5, 9.0) }; 200]);
        }
        let mut simulation = simulation(world, &Disturbance::usual(), 0);
        let mut scan = LaserScan::default();
        for _ in 0..20 {
            simulation.step(FULL_AHEAD);
            simulation.scan(&mut scan);
            assert!(simulation.pose().x_m.is_finite());
        }
        let is_outside = !simulation.world().bounds.contains(simulation.pose().position());
        assert!(!is_outside || simulation.outcome() == Outcome::Collided);
    }
}

/// A lidar on the left front corner that looks to the left, in a room with walls at 0 and 10 m.
#[test]
fn a_scan_is_taken_from_where_the_lidar_sits() {
    let lidar = Lidar {
        mount: Pose::new(0.3, 0.2, std::f32::consts::FRAC_PI_2),
        range_max_m: 12.0,
        ..Lidar::default()
    };
    let task = Task { lidar, ..Task::default() };
    let mut simulation = Simulation::new(Arc::new(common::room(10.0)), &task, &Disturbance::none(), 0);
    let mut scan = LaserScan::default();
    simulation.scan(&mut scan);
    // The robot stands at (1, 1) and looks along x.
    for (beam, expected_m) in [(36, 8.8), (54, 1.3), (0, 1.2), (18, 8.7)] {
        assert!((scan.ranges_m[beam] - expected_m).abs() < 1e-4, "beam {beam}: {}", scan.ranges_m[beam]);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// A room cut in two by a thin wall, whatever its place: no command, speed or radius jumps it.
    #[test]
    fn no_wall_is_jumped(
        wall_m in 3.0..9.0_f32,
        slope in -1.0..1.0_f32,
        yaw_rad in -1.5..1.5_f32,
        linear_max_mps in 0.2..5.0_f32,
        footprint in footprints(),
        control_period_s in 0.02..0.5_f32,
        turns in prop::collection::vec(-1.0..1.0_f32, 300),
    ) {
        let task = Task {
            control_period_s,
            robot: Robot { linear_max_mps, footprint, linear_acceleration_mps2: 50.0, ..Robot::default() },
            ..Task::default()
        };
        let wall = Segment { a: Point::new(wall_m - slope, 0.0), b: Point::new(wall_m + slope, 10.0) };
        let bounds = Bounds { min: Point::origin(), max: Point::new(20.0, 10.0) };
        let goal = Point::new(19.0, 5.0);
        let world = World { bounds, goal, segments: vec![wall], start: Pose::new(1.0, 5.0, yaw_rad), ..common::room(10.0) };
        let mut simulation = Simulation::new(Arc::new(world), &task, &Disturbance::none(), 0);
        for turn in turns {
            let outcome = simulation.step(Twist { linear_mps: linear_max_mps, angular_radps: turn });
            prop_assert_ne!(outcome, Outcome::Reached);
            // The centre never leaves its side of the wall, nor the room.
            let position = simulation.pose().position();
            prop_assert!((wall.b - wall.a).perp(&(position - wall.a)) > 0.0, "{position}");
            prop_assert!(bounds.contains(position), "{position}");
            if outcome.is_over() {
                break;
            }
        }
    }

    /// Whatever the robot does, it runs on exactly while its footprint is free.
    #[test]
    fn the_outcome_is_that_of_the_clearance(seed in 0..1000_u64, footprint in footprints()) {
        let task = Task { robot: Robot { footprint, ..Robot::default() }, ..Task::default() };
        let mut simulation = Simulation::new(Arc::new(busy_world()), &task, &Disturbance::usual(), seed);
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut outcome = Outcome::Running;
        while outcome == Outcome::Running {
            outcome = simulation.step(Twist { linear_mps: 0.8, angular_radps: rng.random_range(-1.0..1.0) });
            let clearance_m = simulation.clearance_m();
            prop_assert!((outcome == Outcome::Collided) == (clearance_m < 0.0) || clearance_m.abs() < 1e-5);
            prop_assert!(clearance_m > -0.15, "{clearance_m}");
        }
    }
}
