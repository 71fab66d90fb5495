//! What a robot in training is paid for is the truth: where odometry drifts away, it arrives in its belief only.

mod common;

use common::homing;
use nav_core::controller::Controller;
use nav_core::geometry::{Point, Pose};
use nav_core::metrics::EpisodeEnd;
use nav_core::observation::LOW_ACTION;
use nav_core::reward::{HighReward, LowReward, decomposed};
use nav_core::task::{ACTION_GOAL, Task};
use nav_env::high::{HighRobot, HighRobotConfig};
use nav_env::low::{Attempt, LowRobot, LowRobotConfig, Progress, StepReport};
use nav_env::robot::SimulatedRobot;
use nav_env::worlds::Place;
use nav_sim::disturbance::Disturbance;
use nav_sim::localiser::Localiser;
use nav_sim::simulation::Outcome;
use nav_sim::world::{Bounds, World};
use std::sync::Arc;

/// An empty hall with the goal 12 m ahead.
fn hall() -> Arc<Vec<Place>> {
    let world = World {
        name: "hall".into(),
        bounds: Bounds { min: Point::origin(), max: Point::new(20.0, 20.0) },
        discs: Vec::new(),
        segments: Vec::new(),
        polygons: Vec::new(),
        people: Vec::new(),
        start: Pose::new(4.0, 10.0, 0.0),
        goal: Point::new(16.0, 10.0),
    };
    Arc::new(vec![Place::read("hall", Arc::new(world), 1, &Task::default().robot.footprint)])
}

/// Odometry that is off by a fifth of the distance, more than the goal's radius.
fn drifting(localiser: Localiser) -> Disturbance {
    Disturbance { odometry_drift: [0.2; 2], localiser, ..Disturbance::none() }
}

/// How the attempts at the goal of 3,000 steps end, with their last rewards.
fn attempts(localiser: Localiser) -> Vec<(Attempt, bool, f32)> {
    let config = LowRobotConfig {
        goal_share: 1.0,
        subgoal_m: [0.7, 3.0],
        subgoal_s: 8.0,
        discount: 0.98,
        n_step: 1,
        reward: LowReward::Decomposed(decomposed::LowWeights::default()),
        progress: Progress::Straight,
    };
    let mut robot = LowRobot::new(config, hall(), &Task::default(), &drifting(localiser), 3);
    let mut network = homing();
    let mut ended = Vec::new();
    for _ in 0..3_000 {
        let mut action = [0.0; LOW_ACTION];
        network.run(robot.observation(), &mut action);
        let StepReport { reward, attempt, is_terminated } = robot.step(action, &mut Vec::new());
        if attempt != Attempt::Running {
            ended.push((attempt, is_terminated, reward));
        }
    }
    ended
}

#[test]
fn a_low_level_that_only_believes_to_be_there_is_not_paid_and_does_not_go_on() {
    let ended = attempts(Localiser::default());
    assert!(ended.len() >= 10, "{ended:?}");
    let reached = decomposed::LowWeights::default().reached;
    assert!(ended.iter().any(|(attempt, ..)| *attempt == Attempt::Astray), "{ended:?}");
    for (attempt, terminated, reward) in ended {
        assert_eq!(attempt == Attempt::Reached, reward > 0.5 * reached, "{attempt:?} {reward}");
        assert!(terminated || attempt == Attempt::GivenUp, "{attempt:?}");
    }
}

#[test]
fn a_localiser_brings_it_there() {
    let ended = attempts(Localiser { period_s: 1.0, ..Localiser::default() });
    assert!(ended.len() >= 10 && ended.iter().all(|(attempt, ..)| *attempt == Attempt::Reached), "{ended:?}");
}

#[test]
fn a_high_level_that_goes_astray_pays_the_rest_of_its_time_and_does_not_bootstrap() {
    let weights = decomposed::HighWeights::default();
    let config = HighRobotConfig { discount: 0.995, n_step: 1, reward: HighReward::Decomposed(weights) };
    let mut robot = HighRobot::new(config, hall(), &Task::default(), &drifting(Localiser::default()), 5);
    let (mut low, mut transitions, mut astray) = (homing(), Vec::new(), 0);
    for _ in 0..200 {
        let report = robot.decide(ACTION_GOAL, &mut low, &mut transitions);
        let last = transitions.last().expect("with one step each decision is complete");
        if report.outcome == Outcome::TimedOut {
            astray += 1;
            assert!(last.discount.abs() < 1e-9, "where it stands, nothing follows");
            // At least 30 of 50 seconds were left.
            assert!(last.reward < -0.8 * weights.standing(0.995, 300), "{}", last.reward);
            assert!(report.returned < 6.0 - weights.standing(0.995, 300), "{}", report.returned);
        } else {
            assert_eq!(last.discount > 0.0, report.outcome == Outcome::Running);
        }
    }
    assert!(astray > 3, "{astray}");
}

/// How a flat controller with that low level ends in the hall.
fn end(localiser: Localiser) -> EpisodeEnd {
    let task = Task::default();
    let mut controller = Controller::new(&task, None, homing()).expect("it fits");
    SimulatedRobot::new(&task, &drifting(localiser)).drive(&mut controller, &hall()[0], false).metrics.end
}

#[test]
fn an_episode_says_that_the_robot_only_believes_to_be_there() {
    assert_eq!(end(Localiser::default()), EpisodeEnd::BelievedArrived);
    assert_eq!(end(Localiser { period_s: 1.0, ..Localiser::default() }), EpisodeEnd::Success);
}
