//! Isolates one environment step on one core: `Simulation::step` and `scan` (72 beams, trained disturbances),
//! then the same with nav-core's digest of the scan and the low-level observation, as training runs it.
//!
//! Prints microseconds a step and steps a second, the median of several short rounds; episodes end and begin
//! inside the timed loop, so resets are included. What bounds a step:
//!
//! | part | grows with |
//! |---|---|
//! | lidar | obstacles in range times the beams each of them spans (not beams times obstacles) |
//! | noise | beams: one normal and one uniform draw each |
//! | people | pairs of people (a distance each), then at most 8 neighbours a person; ORCA people cost most |
//! | collision | obstacles in the cell, twice a step |
//!
//! Run with `cargo bench -p nav-sim --bench env`, or with a part of a row's name to see only that one.
#![allow(clippy::print_stdout, reason = "a bench prints")]

use nav_core::geometry::{Point, Pose};
use nav_core::messages::LaserScan;
use nav_core::navigator::Navigator;
use nav_core::observation::LOW_OBSERVATION;
use nav_core::task::Task;
use nav_sim::disturbance::Disturbance;
use nav_sim::simulation::{Simulation, Twist};
use nav_sim::world::{Bounds, Disc, Person, Segment, WalkModel, World};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;

const WORLDS: u64 = 32;
const ROUNDS: usize = 7;
const STEPS: u32 = 20_000;

/// Commands that keep the robot roaming: mostly forward, the turn a random walk.
struct Roamer {
    rng: Xoshiro256PlusPlus,
    turn_radps: f32,
}

impl Roamer {
    fn command(&mut self) -> Twist {
        let change: f32 = self.rng.random_range(-0.3..0.3);
        self.turn_radps = (self.turn_radps + change).clamp(-1.0, 1.0);
        Twist { linear_mps: 0.6, angular_radps: self.turn_radps }
    }
}

/// Seconds for [`STEPS`] steps; with a navigator, including the observation.
fn round(worlds: &[Arc<World>], task: &Task, observed: bool) -> f64 {
    let mut roamer = Roamer { rng: Xoshiro256PlusPlus::seed_from_u64(1), turn_radps: 0.0 };
    let mut simulation = Simulation::new(Arc::clone(&worlds[0]), task, &Disturbance::trained(), 0);
    let mut navigator = Navigator::new(task);
    let mut scan = LaserScan::default();
    let mut observation = [0.0; LOW_OBSERVATION];
    let mut episode = 0_u32;
    let begun = Instant::now();
    for _ in 0..STEPS {
        if simulation.step(roamer.command()).is_over() {
            episode += 1;
            simulation.reset(Arc::clone(&worlds[episode as usize % worlds.len()]), u64::from(episode));
        }
        simulation.scan(&mut scan);
        let odometry = simulation.odometry();
        if observed {
            navigator.observe(&scan, &odometry, &simulation.goal(episode));
            navigator.encode_low(&mut observation);
        }
        black_box((&scan, &odometry, &observation));
    }
    begun.elapsed().as_secs_f64()
}

fn median_us(worlds: &[Arc<World>], task: &Task, observed: bool) -> f64 {
    let mut seconds: Vec<f64> = (0..ROUNDS).map(|_| round(worlds, task, observed)).collect();
    seconds.sort_by(f64::total_cmp);
    seconds[ROUNDS / 2] / f64::from(STEPS) * 1e6
}

fn main() {
    let wanted: Vec<String> =
        std::env::args().skip(1).filter(|argument| !argument.starts_with('-')).collect();
    let task = Task::default();
    println!(
        "{:<10} {:>14} {:>14} {:>14} {:>14}",
        "family", "step+scan us", "steps/s", "observed us", "steps/s"
    );
    let families: [(&str, fn(u64) -> World); 4] =
        [("clutter", clutter), ("maze", maze), ("crowd", crowd), ("map", map)];
    for (name, generate) in families {
        if !wanted.is_empty() && !wanted.iter().any(|part| name.contains(part.as_str())) {
            continue;
        }
        let worlds: Vec<Arc<World>> = (0..WORLDS).map(|seed| Arc::new(generate(seed))).collect();
        let (bare_us, observed_us) = (median_us(&worlds, &task, false), median_us(&worlds, &task, true));
        println!(
            "{name:<10} {bare_us:>14.2} {:>14.0} {observed_us:>14.2} {:>14.0}",
            1e6 / bare_us,
            1e6 / observed_us
        );
    }
}

fn empty(side_m: f32) -> World {
    World {
        name: "bench".into(),
        bounds: Bounds { min: Point::origin(), max: Point::new(side_m, side_m) },
        discs: Vec::new(),
        segments: Vec::new(),
        polygons: Vec::new(),
        people: Vec::new(),
        start: Pose::new(1.0, 1.0, 0.8),
        goal: Point::new(side_m - 1.0, side_m - 1.0),
    }
}

fn clutter(seed: u64) -> World {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let discs = (0..20).map(|_| Disc {
        center: Point::new(rng.random_range(2.0..12.0), rng.random_range(2.0..12.0)),
        radius_m: rng.random_range(0.2..0.6),
    });
    World { discs: discs.collect(), ..empty(14.0) }
}

/// A wall between half of all neighbouring cells of 2 m.
fn maze(seed: u64) -> World {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut segments = Vec::new();
    for row in 0..7_u8 {
        for column in 1..7_u8 {
            let (at, from) = (f32::from(column) * 2.0, f32::from(row) * 2.0);
            if rng.random_bool(0.7) {
                segments.push(Segment { a: Point::new(at, from), b: Point::new(at, from + 2.0) });
            }
            if rng.random_bool(0.7) {
                segments.push(Segment { a: Point::new(from, at), b: Point::new(from + 2.0, at) });
            }
        }
    }
    World { segments, ..empty(14.0) }
}

fn crowd(seed: u64) -> World {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut anywhere = || Point::new(rng.random_range(1.0..13.0), rng.random_range(1.0..13.0));
    let mut people = Vec::new();
    for index in 0..24_usize {
        let model = match index % 10 {
            0 | 1 => WalkModel::Scripted,
            2 | 3 => WalkModel::ScriptedYielding,
            4..=7 => WalkModel::SocialForce,
            _ => WalkModel::Orca,
        };
        people.push(Person {
            start: anywhere(),
            waypoints: vec![anywhere(), anywhere(), anywhere()],
            radius_m: 0.26,
            speed_mps: 0.7,
            model,
            sees_robot: index % 2 == 0,
        });
    }
    World { people, start: Pose::new(0.6, 0.6, 0.8), ..empty(14.0) }
}

/// An imported map: 4000 short walls on 60 x 60 m.
fn map(seed: u64) -> World {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let segments = (0..4000).map(|_| {
        let a = Point::new(rng.random_range(0.0..60.0), rng.random_range(0.0..60.0));
        let b = a + nalgebra::Vector2::new(rng.random_range(-0.5..0.5), rng.random_range(-0.5..0.5));
        Segment { a, b }
    });
    World { segments: segments.collect(), ..empty(60.0) }
}
