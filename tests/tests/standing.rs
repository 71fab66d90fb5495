//! No robot stands until its time is over: worlds in which an earlier policy, whose high level could not see that it
//! stood, chose the same again at every decision while its low level did not drive off.

use nav_core::metrics::EpisodeEnd;
use nav_env::robot::SimulatedRobot;
use nav_env::worlds::Place;
use nav_model::model::Model;
use nav_sim::disturbance::DisturbanceName;
use nav_sim::families::{Family, Split};
use std::path::Path;

/// Validation worlds; in each that policy drove less than 10 m, in eight of them less than one, and timed out.
const STOOD: [(Family, u64); 12] = [
    (Family::Clutter, 65),
    (Family::Maze, 12),
    (Family::MazeTight, 115),
    (Family::MazeTight, 129),
    (Family::MazeTight, 136),
    (Family::Tight, 31),
    (Family::Tight, 72),
    (Family::Tight, 78),
    (Family::Tight, 79),
    (Family::Tight, 95),
    (Family::Tight, 117),
    (Family::Tight, 137),
];
/// Longer than any sensible wait, s.
const LONG_S: f32 = 10.0;

#[test]
fn the_shipped_model_does_not_stand_until_its_time_is_over() {
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../models"));
    for name in [DisturbanceName::None, DisturbanceName::Usual] {
        let model = Model::read(folder).expect("the shipped model");
        let task = model.manifest().task;
        let mut controller = model.into_controller().expect("a controller");
        let mut robot = SimulatedRobot::new(&task, &name.disturbance(&task.robot));
        for (family, seed) in STOOD {
            let place = Place::generated(family, Split::Validation, seed, &task.robot.footprint);
            let metrics = robot.drive(&mut controller, &place, false).metrics;
            assert!(
                metrics.end != EpisodeEnd::Timeout || metrics.stood_at_end_s < LONG_S,
                "{} ({name}): stood for {} of {} s",
                place.world.name,
                metrics.stood_at_end_s,
                metrics.time_s
            );
        }
    }
}
