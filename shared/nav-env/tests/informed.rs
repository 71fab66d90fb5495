//! A gate that is told who moves against one that has to find out: other commands among people, the same without them.

mod common;

use common::homing;
use nav_core::controller::Controller;
use nav_core::geometry::{Point, Pose};
use nav_core::metrics::EpisodeMetrics;
use nav_core::task::Task;
use nav_core::twist::Twist;
use nav_env::informed::{Informed, movers};
use nav_env::robot::{Driver, SimulatedRobot};
use nav_env::worlds::Place;
use nav_sim::disturbance::Disturbance;
use nav_sim::families::{Family, Split};
use nav_sim::simulation::Simulation;
use nav_sim::world::{Bounds, Person, WalkModel, World};
use std::sync::Arc;

/// How a driver does in the first validation worlds of a family.
fn driven(driver: &mut dyn Driver, family: Family, worlds: u64) -> Vec<EpisodeMetrics> {
    let task = *driver.task();
    let mut robot = SimulatedRobot::new(&task, &Disturbance::usual());
    let places =
        (0..worlds).map(|seed| Place::generated(family, Split::Validation, seed, &task.robot.footprint));
    places.map(|place| robot.drive(driver, &place, false).metrics).collect()
}

#[test]
fn who_is_told_drives_otherwise_among_people_and_the_same_without_them() {
    let task = Task::default();
    let controller = || Controller::new(&task, None, homing()).expect("a flat controller");
    let (mut plain, mut told) = (controller(), Informed(controller()));
    assert_eq!(driven(&mut plain, Family::Clutter, 3), driven(&mut told, Family::Clutter, 3));
    let (alone, informed) = (driven(&mut plain, Family::Crowd, 12), driven(&mut told, Family::Crowd, 12));
    let differ = alone.iter().zip(&informed).filter(|(a, b)| a != b).count();
    assert!(differ >= 6, "{differ} of 12 worlds are driven otherwise");
}

/// Two who walk straight on, one of them out of range, and a robot that turns and drives in a hall.
fn hall() -> World {
    let walker = |start: Point, end: Point| Person {
        start,
        waypoints: vec![end],
        radius_m: 0.3,
        speed_mps: 0.5,
        model: WalkModel::Scripted,
        sees_robot: false,
        beside: None,
        stop: None,
    };
    World {
        name: "hall".into(),
        bounds: Bounds { min: Point::origin(), max: Point::new(40.0, 40.0) },
        discs: Vec::new(),
        segments: Vec::new(),
        polygons: Vec::new(),
        people: vec![
            walker(Point::new(10.0, 3.0), Point::new(10.0, 39.0)),
            walker(Point::new(30.0, 3.0), Point::new(30.0, 39.0)),
            walker(Point::new(10.0, 2.0), Point::new(39.0, 2.0)),
        ],
        start: Pose::new(8.0, 3.0, 1.0),
        goal: Point::new(35.0, 35.0),
    }
}

/// As the robot would have to see them with exact sensors: the same in its own frame, wherever odometry believes to be.
#[test]
fn movers_are_right_in_an_odom_frame_that_drifts() {
    let drifting = Disturbance { odometry_drift: [0.2; 2], ..Disturbance::none() };
    let mut simulation = Simulation::new(Arc::new(hall()), &Task::default(), &drifting, 3);
    let mut off_m = 0.0_f32;
    for step in 0..30_u16 {
        let (truth, odom) = (simulation.pose(), simulation.odometry().pose);
        off_m = off_m.max((truth.position() - odom.position()).norm());
        let movers = movers(&simulation);
        let near = [0, 2].map(|index| simulation.people()[index]);
        assert_eq!(movers.len(), 2, "step {step}: the third is out of range");
        for person in near {
            let place = truth.local_from_parent(person.position);
            let ahead = truth.local_from_parent(person.position + person.velocity);
            let found = movers.iter().find(|mover| {
                (odom.local_from_parent(mover.position) - place).norm() < 1e-3
                    && (odom.local_from_parent(mover.position + mover.velocity) - ahead).norm() < 1e-3
            });
            assert!(
                found.is_some_and(|mover| (mover.radius_m - 0.3).abs() < 1e-6),
                "step {step}: {movers:?}"
            );
        }
        simulation.step(Twist::new(0.8, 0.5));
    }
    assert!(off_m > 0.1, "odometry drifts: {off_m} m");
}
