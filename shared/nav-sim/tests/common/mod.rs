//! Small worlds for the tests.
#![allow(dead_code, reason = "each test binary uses a part")]

use nav_core::geometry::{Point, Pose};
use nav_core::task::Task;
use nav_core::twist::Twist;
use nav_sim::disturbance::Disturbance;
use nav_sim::simulation::Simulation;
use nav_sim::world::{Bounds, Disc, Person, Segment, WalkModel, World};
use std::sync::Arc;

pub(crate) const FULL_AHEAD: Twist = Twist { linear_mps: 1.0, angular_radps: 0.0 };

/// An empty square room, start near one corner, goal near the other.
pub(crate) fn room(side_m: f32) -> World {
    World {
        name: "test".into(),
        bounds: Bounds { min: Point::origin(), max: Point::new(side_m, side_m) },
        discs: Vec::new(),
        segments: Vec::new(),
        polygons: Vec::new(),
        people: Vec::new(),
        start: Pose::new(1.0, 1.0, 0.0),
        goal: Point::new(side_m - 1.0, side_m - 1.0),
    }
}

/// Somebody who walks between two places.
pub(crate) fn walker(from: (f32, f32), to: (f32, f32), model: WalkModel, sees_robot: bool) -> Person {
    let (from, to) = (Point::new(from.0, from.1), Point::new(to.0, to.1));
    Person {
        start: from,
        waypoints: vec![to, from],
        radius_m: 0.25,
        speed_mps: 0.8,
        model,
        sees_robot,
        beside: None,
        stop: None,
    }
}

/// Twelve people of all models who cross the middle of a 10 m room.
pub(crate) fn crossing_people() -> Vec<Person> {
    let models = [WalkModel::Scripted, WalkModel::ScriptedYielding, WalkModel::SocialForce, WalkModel::Orca];
    (0..12_u8)
        .map(|k| {
            let (sin, cos) = (std::f32::consts::TAU * f32::from(k) / 12.0).sin_cos();
            let (from, to) = ((5.0 + 3.5 * cos, 5.0 + 3.5 * sin), (5.0 - 3.5 * cos, 5.0 - 3.5 * sin));
            walker(from, to, models[usize::from(k) % 4], k % 3 == 0)
        })
        .collect()
}

pub(crate) fn busy_world() -> World {
    let discs = vec![Disc { center: Point::new(2.0, 8.0), radius_m: 0.4 }];
    let segments = vec![Segment { a: Point::new(8.0, 1.0), b: Point::new(9.0, 4.0) }];
    World { discs, segments, people: crossing_people(), ..room(10.0) }
}

pub(crate) fn simulation(world: World, disturbance: &Disturbance, seed: u64) -> Simulation {
    Simulation::new(Arc::new(world), &Task::default(), disturbance, seed)
}
