//! Disturbances of sensors and wheels: as strong as asked, and of nothing else.

mod common;

use common::{FULL_AHEAD, busy_world, simulation};
use nav_core::geometry::{Point, Pose};
use nav_core::messages::LaserScan;
use nav_core::task::{Robot, Task};
use nav_core::twist::Twist;
use nav_sim::disturbance::Disturbance;
use nav_sim::localiser::Localiser;
use nav_sim::simulation::{Outcome, Simulation};
use nav_sim::world::World;
use std::sync::Arc;

#[test]
fn sensor_noise_does_not_change_what_people_do() {
    let noisy = Disturbance { range_noise_m: [0.05; 2], dropout: [0.3; 2], ..Disturbance::none() };
    let (mut a, mut b) =
        (simulation(busy_world(), &noisy, 4), simulation(busy_world(), &Disturbance::none(), 4));
    let mut scan = LaserScan::default();
    for _ in 0..200 {
        a.step(Twist::ZERO);
        a.scan(&mut scan);
        a.scan(&mut scan);
        b.step(Twist::ZERO);
        assert_eq!(a.people(), b.people());
    }
}

#[test]
fn noise_and_dropout_are_as_strong_as_asked() {
    let disturbance = Disturbance { range_noise_m: [0.02; 2], dropout: [0.1; 2], ..Disturbance::none() };
    // From the middle of a square of 8 m the beams reach 4 to 5.7 m; those to the corners miss.
    let world = World { start: Pose::new(4.0, 4.0, 0.0), ..common::room(8.0) };
    let mut noisy = simulation(world.clone(), &disturbance, 1);
    let mut clean = simulation(world, &Disturbance::none(), 1);
    let (mut a, mut b) = (LaserScan::default(), LaserScan::default());
    let (mut squares, mut hits, mut lost, mut beams) = (0.0_f64, 0_u32, 0_u32, 0_u32);
    for _ in 0..300 {
        noisy.step(Twist::ZERO);
        clean.step(Twist::ZERO);
        noisy.scan(&mut a);
        clean.scan(&mut b);
        for (&noisy_m, &clean_m) in a.ranges_m().iter().zip(b.ranges_m()) {
            beams += 1;
            lost += u32::from(noisy_m.is_nan());
            assert!(noisy_m.is_nan() || clean_m.is_finite() || noisy_m.is_infinite(), "a miss became a hit");
            if noisy_m.is_finite() && clean_m < 4.9 {
                squares += f64::from(noisy_m - clean_m).powi(2);
                hits += 1;
            }
        }
    }
    let deviation_m = (squares / f64::from(hits)).sqrt();
    assert!((deviation_m - 0.02).abs() < 0.001, "{deviation_m}");
    let share = f64::from(lost) / f64::from(beams);
    assert!((share - 0.1).abs() < 0.01, "{share}");
    assert!(b.ranges_m().iter().any(|range_m| range_m.is_infinite()), "the corners are out of range");
}

#[test]
fn latency_delays_commands_by_whole_steps() {
    for latency in 0..=8_u8 {
        let disturbance = Disturbance { latency_s: [0.1 * f32::from(latency); 2], ..Disturbance::none() };
        let mut simulation = simulation(common::room(20.0), &disturbance, 0);
        let mut steps = 0;
        while simulation.velocity().linear_mps <= 0.0 {
            simulation.step(FULL_AHEAD);
            steps += 1;
        }
        assert_eq!(steps, latency + 1);
    }
}

#[test]
fn lag_and_gain_shape_the_answer_to_a_step() {
    let soft =
        Task { robot: Robot { linear_acceleration_mps2: 50.0, ..Robot::default() }, ..Task::default() };
    let disturbance =
        Disturbance { actuation_lag_s: [0.5; 2], velocity_gain: [0.9; 2], ..Disturbance::none() };
    let mut simulation = Simulation::new(Arc::new(common::room(20.0)), &soft, &disturbance, 0);
    for _ in 0..5 {
        simulation.step(FULL_AHEAD);
    }
    let after_one_constant = simulation.velocity().linear_mps;
    assert!((after_one_constant - 0.9 * (1.0 - (-1.0_f32).exp())).abs() < 1e-3, "{after_one_constant}");
    for _ in 0..40 {
        simulation.step(FULL_AHEAD);
    }
    assert!((simulation.velocity().linear_mps - 0.9).abs() < 1e-3);
}

#[test]
fn odometry_drifts_by_the_share_of_the_distance_that_was_asked() {
    for seed in 0..20 {
        let disturbance = Disturbance { odometry_drift: [0.02; 2], ..Disturbance::none() };
        let mut simulation = simulation(common::room(40.0), &disturbance, seed);
        assert_eq!(simulation.odometry().pose, simulation.pose());
        while simulation.pose().x_m < 11.0 {
            assert_eq!(simulation.step(FULL_AHEAD), Outcome::Running);
        }
        let off_m = (simulation.odometry().pose.position() - simulation.pose().position()).norm();
        assert!((off_m - 0.2).abs() < 0.01, "{off_m}");
        let goal = simulation.goal(1);
        assert_eq!((goal.x_m, goal.y_m), (39.0, 39.0), "the goal does not move in the odom frame");
    }
}

#[test]
fn a_localiser_moves_the_goal_to_where_odometry_finds_it() {
    let localiser = Localiser { period_s: 1.0, ..Localiser::default() };
    let disturbance = Disturbance { odometry_drift: [0.02; 2], localiser, ..Disturbance::none() };
    for seed in 0..20 {
        let mut simulation = simulation(common::room(40.0), &disturbance, seed);
        while simulation.pose().x_m < 20.5 {
            assert_eq!(simulation.step(FULL_AHEAD), Outcome::Running);
        }
        let seen = |goal: &nav_core::messages::Goal| {
            simulation.odometry().pose.local_from_parent(Point::new(goal.x_m, goal.y_m))
        };
        let off_m =
            (seen(&simulation.goal(1)) - simulation.pose().local_from_parent(Point::new(39.0, 39.0))).norm();
        let localised = simulation.map_from_odom().after(&simulation.odometry().pose);
        let astray_m = (localised.position() - simulation.pose().position()).norm();
        // Without it up to 3 m by now; with it what the turn of a second makes at 42 m.
        assert!(off_m < 0.2 && astray_m < 0.05, "seed {seed}: goal off by {off_m}, robot by {astray_m}");
    }
}

#[test]
fn the_true_radius_decides_the_collision() {
    for (scale, expected_x_m) in [(0.9, 0.18), (1.1, 0.22)] {
        let disturbance = Disturbance { radius_scale: [scale; 2], ..Disturbance::none() };
        let mut simulation = simulation(common::room(10.0), &disturbance, 0);
        while simulation.step(FULL_AHEAD) == Outcome::Running {}
        assert_eq!(simulation.outcome(), Outcome::Collided);
        let left_m = 10.0 - simulation.pose().x_m;
        assert!((left_m - expected_x_m).abs() < 0.051, "{left_m}");
        assert!(simulation.clearance_m() < 0.0 && simulation.clearance_m() > -0.051);
        assert!(!simulation.hit_while_standing());
    }
}
