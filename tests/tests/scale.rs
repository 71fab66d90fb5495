//! Nothing knows the default robot: another one, in a world of its own size and time, drives the same trajectory.
//!
//! The factors are powers of two, so that a length that is scaled everywhere gives the same digits, and one that is
//! forgotten somewhere does not.

use nav_core::controller::Controller;
use nav_core::footprint::Footprint;
use nav_core::geometry::Pose;
use nav_core::metrics::EpisodeEnd;
use nav_core::task::{Decision, Lidar, Robot, ShieldMode, Task};
use nav_env::informed::Informed;
use nav_env::robot::{Driver, SimulatedRobot};
use nav_env::worlds::Place;
use nav_model::load::{Arena, LoadedNetwork};
use nav_model::model::Model;
use nav_rivals::Rival;
use nav_sim::disturbance::Disturbance;
use nav_sim::families::{Family, Split};
use nav_sim::localiser::Localiser;
use std::path::Path;

/// Worlds that nobody walks in.
const STATIC: [Family; 5] = [Family::Clutter, Family::UTrap, Family::Maze, Family::Rooms, Family::Tight];

/// How much larger a robot is, and how much longer it takes for a length of its own.
#[derive(Clone, Copy, Debug)]
struct Factors {
    length: f32,
    time: f32,
}

/// Twice as large and as fast; as large and half as fast; twice as large, at the same speed.
const OTHERS: [Factors; 3] = [
    Factors { length: 2.0, time: 1.0 },
    Factors { length: 1.0, time: 2.0 },
    Factors { length: 2.0, time: 2.0 },
];

/// As it is.
const ONE: Factors = Factors { length: 1.0, time: 1.0 };

impl Factors {
    fn task(self, of: &Task, shield: ShieldMode) -> Task {
        let Self { length, time } = self;
        let robot = Robot {
            footprint: of.robot.footprint.scaled(length),
            linear_max_mps: of.robot.linear_max_mps * length / time,
            linear_min_mps: of.robot.linear_min_mps * length / time,
            angular_max_radps: of.robot.angular_max_radps / time,
            linear_acceleration_mps2: of.robot.linear_acceleration_mps2 * length / (time * time),
            angular_acceleration_radps2: of.robot.angular_acceleration_radps2 / (time * time),
            latency_s: of.robot.latency_s * time,
        };
        let lidar = Lidar {
            range_min_m: of.lidar.range_min_m * length,
            range_max_m: of.lidar.range_max_m * length,
            mount: Pose::new(
                of.lidar.mount.x_m * length,
                of.lidar.mount.y_m * length,
                of.lidar.mount.yaw_rad,
            ),
            ..of.lidar
        };
        let Decision { deviation_margin, memory, .. } = of.decision;
        let decision = Decision { deviation_margin, memory, ..Decision::of(&robot) };
        let control_period_s = of.control_period_s * time;
        Task { lidar, decision, control_period_s, shield, ..Task::of(robot) }
    }

    /// Everything that a static world can do to a robot, but for odometry's drift, which is so much a metre.
    fn disturbance(self) -> Disturbance {
        let Self { length, time } = self;
        let usual = Disturbance::usual();
        Disturbance {
            range_noise_m: usual.range_noise_m.map(|m| m * length),
            latency_s: usual.latency_s.map(|s| s * time),
            actuation_lag_s: usual.actuation_lag_s.map(|s| s * time),
            odometry_drift: [0.0; 2],
            localiser: Localiser {
                period_s: usual.localiser.period_s * time,
                position_error_m: usual.localiser.position_error_m * length,
                late_s: usual.localiser.late_s * time,
                ..usual.localiser
            },
            ..usual
        }
    }
}

fn shipped_task() -> Task {
    shipped().manifest().task
}

/// A box that does not turn about its middle, with a lidar in a corner of it, a little larger than the reference robot: what is
/// kept free for a lidar's noise does not shrink for a smaller one, and people do not slow down with a slower one.
fn boxed_task() -> Task {
    let shipped = shipped_task();
    let footprint = Footprint::Rectangle { front_m: 0.28125, rear_m: 0.140625, half_width_m: 0.17578125 };
    let mount = Pose::new(0.2109375, -0.0703125, 0.5);
    let lidar = Lidar { mount, ..shipped.lidar };
    ONE.task(&Task { robot: Robot { footprint, ..shipped.robot }, lidar, ..shipped }, shipped.shield)
}

fn shipped() -> Model {
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../models"));
    Model::read(folder).expect("the shipped model")
}

/// The shipped policy on the robot of a task.
fn controller(task: &Task) -> Controller<Arena> {
    let (low, high) = shipped().into_networks();
    let high = high.map(LoadedNetwork::into_network);
    Controller::new(task, high, low.into_network()).expect("the shipped networks")
}

fn policy(task: &Task) -> Box<dyn Driver> {
    Box::new(controller(task))
}

/// Its gate knows that nobody walks there. Whom it takes for people by itself depends on their size, which does not scale.
fn informed_policy(task: &Task) -> Box<dyn Driver> {
    Box::new(Informed(controller(task)))
}

fn rival(rival: Rival) -> impl Fn(&Task) -> Box<dyn Driver> {
    move |task| rival.driver(task)
}

/// Where a robot was at each step in a world of its own size, and how that ended.
fn driven(
    driver: &mut dyn Driver,
    factors: Factors,
    (family, seed): (Family, u64),
) -> (Vec<Pose>, EpisodeEnd) {
    let task = *driver.task();
    let mut robot = SimulatedRobot::new(&task, &factors.disturbance());
    let place = Place::generated(family, Split::Validation, seed, &task.robot.footprint);
    let driven = robot.drive(driver, &place, true);
    let trace = driven.trace.expect("it was asked for");
    (trace.steps.iter().map(|step| step.pose).collect(), driven.metrics.end)
}

/// Where two trajectories are farther apart than a thousandth of a radius, as a sentence.
fn difference(reference: &[Pose], other: &[Pose], length: f32) -> Option<String> {
    let apart_m = |pose: &Pose, other: &Pose| (pose.position() - other.position() / length).norm();
    let mut pairs = reference.iter().zip(other).map(|(pose, other)| apart_m(pose, other)).enumerate();
    let apart = pairs.find(|(_, apart_m)| *apart_m > 2e-4);
    let (steps, others) = (reference.len(), other.len());
    apart
        .map(|(step, apart_m)| format!("{apart_m} m apart in step {step} of {steps}"))
        .or_else(|| (steps != others).then(|| format!("{steps} steps and {others}")))
}

fn same_everywhere(task: Task, make: impl Fn(&Task) -> Box<dyn Driver>, shield: ShieldMode, worlds: u64) {
    let reference = ONE.task(&task, shield);
    assert_eq!(reference, Task { shield, ..task }, "its settings are the defaults of its robot");
    for family in STATIC {
        for seed in 0..worlds {
            let (poses, end) = driven(&mut *make(&reference), ONE, (family, seed));
            for factors in OTHERS {
                let mut other = make(&factors.task(&task, shield));
                let (others, other_end) = driven(&mut *other, factors, (family, seed));
                let difference = difference(&poses, &others, factors.length);
                assert_eq!(
                    difference, None,
                    "{factors:?} in {family} {seed}, shield {shield}: {end:?} {other_end:?}"
                );
                assert_eq!(end, other_end);
            }
        }
    }
}

#[test]
fn the_shipped_policy_drives_the_same_trajectory() {
    same_everywhere(shipped_task(), policy, ShieldMode::Off, 4);
}

#[test]
fn and_so_it_does_behind_the_gate() {
    same_everywhere(shipped_task(), informed_policy, ShieldMode::On, 4);
}

#[test]
fn and_so_does_a_box_with_its_lidar_in_a_corner() {
    same_everywhere(boxed_task(), policy, ShieldMode::Off, 2);
}

#[test]
fn and_so_does_a_box_behind_the_gate() {
    same_everywhere(boxed_task(), informed_policy, ShieldMode::On, 2);
}

#[test]
fn and_so_does_a_box_on_the_known_map() {
    same_everywhere(boxed_task(), rival(Rival::Astar), ShieldMode::Off, 2);
}

#[test]
fn and_so_do_the_rivals() {
    for (name, worlds) in [(Rival::Reactive, 4), (Rival::Astar, 4), (Rival::Clairvoyant, 1)] {
        same_everywhere(shipped_task(), rival(name), ShieldMode::Off, worlds);
    }
}

/// The policy was trained at 10 Hz and never saw another rate.
#[test]
fn at_other_rates_the_shipped_policy_drives_sensibly() {
    for (period_s, least) in [(0.2, 15), (0.05, 17), (0.02, 17)] {
        for shield in [ShieldMode::On, ShieldMode::Off] {
            let task = Task { control_period_s: period_s, shield, ..shipped_task() };
            assert_eq!(task.validate(), Ok(()));
            let (mut driver, mut robot) = (policy(&task), SimulatedRobot::new(&task, &Disturbance::usual()));
            let ends = (0..20).map(|seed| {
                let place = Place::generated(Family::Clutter, Split::Validation, seed, &task.robot.footprint);
                robot.drive(&mut *driver, &place, false).metrics.end
            });
            let reached = ends.filter(|end| *end == EpisodeEnd::Success).count();
            println!("{period_s} s, gate {shield}: {reached} of 20");
            assert!(reached >= least, "{reached} of 20 at {period_s} s, gate {shield}");
        }
    }
}
