//! Training and the robot act alike: the same networks in the same worlds drive the same way, step by step, through
//! the robots of training and through the controller.

use nav_core::controller::Controller;
use nav_core::observation::{CANDIDATE_FEATURES, LOW_ACTION, LOW_OBSERVATION, expand_candidates};
use nav_core::task::{ACTION_COUNT, ACTION_WAIT, ShieldMode, Task};
use nav_env::ActingNetwork;
use nav_env::episode::Episode;
use nav_env::high::drive_step;
use nav_env::robot::SimulatedRobot;
use nav_env::worlds::generate_places;
use nav_sim::disturbance::Disturbance;
use nav_sim::families::{Family, Split};
use rand::SeedableRng;
use trainer::acting::{Normaliser, pack};
use trainer::nn::{Activation, Mlp, MlpShape, Rng};

/// Fresh networks, low and high: their behaviour makes no sense and hangs on every input.
fn networks() -> (ActingNetwork, ActingNetwork) {
    let mut rng = Rng::seed_from_u64(5);
    let mut low = MlpShape::new(LOW_OBSERVATION, &[32], LOW_ACTION, Activation::Tanh);
    low.output_gain = 3.0;
    let high = MlpShape::new(CANDIDATE_FEATURES, &[16], 1, Activation::Identity);
    let low = pack(&Mlp::new(low, &mut rng), Some(&Normaliser::identity()), 1).expect("a small network");
    (low, pack(&Mlp::new(high, &mut rng), None, ACTION_COUNT).expect("a small network"))
}

/// Bits of x and y after each step.
type Track = Vec<[u32; 2]>;

fn bits(x_m: f32, y_m: f32) -> [u32; 2] {
    [x_m.to_bits(), y_m.to_bits()]
}

#[test]
fn training_and_controller_drive_alike() {
    let task = Task::default();
    // Two steps from a command to its effect: what is under way matters.
    let disturbance = Disturbance { latency_s: [0.2, 0.2], ..Disturbance::trained() };
    let places =
        generate_places(&[Family::Rooms, Family::Clutter], Split::Train, 0..4, &task.robot.footprint);

    let (low, high) = networks();
    // Training has no safety gate.
    let ungated = Task { shield: ShieldMode::Off, ..task };
    let mut controller = Controller::new(&ungated, Some(high), low).expect("they fit");
    let mut robot = SimulatedRobot::new(&task, &disturbance);
    let by_controller = places.iter().map(|place| {
        let trace = robot.drive(&mut controller, place, true).trace.expect("asked for");
        trace.steps.iter().map(|step| bits(step.pose.x_m, step.pose.y_m)).collect::<Track>()
    });
    let by_controller: Vec<Track> = by_controller.collect();

    let (mut low, mut high) = networks();
    let mut episode = Episode::new(places[0].clone(), &task, &disturbance, places[0].simulation_seed);
    let (mut rows, mut values) = (vec![0.0; ACTION_COUNT * CANDIDATE_FEATURES], [0.0; ACTION_COUNT]);
    let (mut steps, mut waits) = (0, 0);
    for (index, place) in places.iter().enumerate() {
        if index > 0 {
            episode.restart(place.clone(), place.simulation_seed);
        }
        let mut track = Track::new();
        loop {
            track.push(bits(episode.pose().x_m, episode.pose().y_m));
            let navigator = episode.navigator_mut();
            if !navigator.goal_reached() && navigator.decision_due().is_some() {
                let (observation, mask) = navigator.prepare_decision();
                expand_candidates(observation, &mut rows);
                high.run(&rows, &mut values);
                let action = mask.best(&values, task.decision.deviation_margin).expect("finite values");
                navigator.commit(action);
                waits += usize::from(action == ACTION_WAIT);
            }
            if drive_step(&mut episode, &mut low).is_over() {
                break;
            }
        }
        track.push(bits(episode.pose().x_m, episode.pose().y_m));
        steps += track.len();
        assert_eq!(track, by_controller[index], "{}", place.world.name);
    }
    assert!(steps > 100 && waits > 0, "{steps} steps and {waits} waits prove little");
}
