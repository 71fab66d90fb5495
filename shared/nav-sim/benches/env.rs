//! Isolates one environment step on one core: `Simulation::step` and `scan` (72 beams, trained disturbances),
//! then the same with nav-core's digest of the scan and the low-level observation, as training runs it.
//!
//! Prints microseconds a step and steps a second, the best of several short rounds; episodes end and begin
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
use nav_core::guard::Guard;
use nav_core::messages::LaserScan;
use nav_core::navigator::Navigator;
use nav_core::observation::LOW_OBSERVATION;
use nav_core::task::Task;
use nav_core::twist::Twist;
use nav_sim::disturbance::Disturbance;
use nav_sim::families::{Family, Split, generate};
use nav_sim::simulation::Simulation;
use nav_sim::world::{Bounds, Segment, World};
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
    fn command(&mut self, guard: &mut Guard) -> Twist {
        let change: f32 = self.rng.random_range(-0.3..0.3);
        self.turn_radps = (self.turn_radps + change).clamp(-1.0, 1.0);
        guard.limit(Twist::new(0.6, self.turn_radps)).0
    }
}

/// Seconds for [`STEPS`] steps; with a navigator, including the observation.
fn round(worlds: &[Arc<World>], task: &Task, observed: bool) -> f64 {
    let mut roamer = Roamer { rng: Xoshiro256PlusPlus::seed_from_u64(1), turn_radps: 0.0 };
    let mut simulation = Simulation::new(Arc::clone(&worlds[0]), task, &Disturbance::usual(), 0);
    let mut navigator = Navigator::new(task);
    let mut guard = Guard::new(task);
    let mut scan = LaserScan::default();
    let mut observation = [0.0; LOW_OBSERVATION];
    let mut episode = 0_u32;
    let begun = Instant::now();
    for _ in 0..STEPS {
        if simulation.step(roamer.command(&mut guard)).is_over() {
            episode += 1;
            guard.restart_from(Twist::ZERO, 0);
            simulation.reset(Arc::clone(&worlds[episode as usize % worlds.len()]), u64::from(episode));
        }
        simulation.scan(&mut scan);
        let odometry = simulation.odometry();
        if observed {
            navigator.observe(&scan, &odometry, &simulation.goal(episode));
            navigator.encode_low(guard.sent(), &mut observation);
        }
        black_box((&scan, &odometry, &observation));
    }
    begun.elapsed().as_secs_f64()
}

/// The fastest of several rounds: what a core does that nothing else disturbs.
fn best_us(worlds: &[Arc<World>], task: &Task, observed: bool) -> f64 {
    let seconds = (0..ROUNDS).map(|_| round(worlds, task, observed)).min_by(f64::total_cmp);
    seconds.expect("there are rounds") / f64::from(STEPS) * 1e6
}

fn main() {
    let wanted: Vec<String> =
        std::env::args().skip(1).filter(|argument| !argument.starts_with('-')).collect();
    let task = Task::default();
    println!(
        "{:<10} {:>14} {:>14} {:>14} {:>14}",
        "family", "step+scan us", "steps/s", "observed us", "steps/s"
    );
    let families = [Family::Clutter, Family::Maze, Family::Rooms, Family::Crowd, Family::Stream];
    let generated = families.map(|family| {
        let worlds = (0..WORLDS).map(|seed| Arc::new(generate(family, Split::Train, seed)));
        (family.id(), worlds.collect())
    });
    let rows: Vec<(&str, Vec<Arc<World>>)> =
        generated.into_iter().chain([("map", vec![Arc::new(map())])]).collect();
    for (name, worlds) in rows {
        if !wanted.is_empty() && !wanted.iter().any(|part| name.contains(part.as_str())) {
            continue;
        }
        let (bare_us, observed_us) = (best_us(&worlds, &task, false), best_us(&worlds, &task, true));
        println!(
            "{name:<10} {bare_us:>14.2} {:>14.0} {observed_us:>14.2} {:>14.0}",
            1e6 / bare_us,
            1e6 / observed_us
        );
    }
}

/// An imported map: 2000 short walls on 60 x 60 m.
fn map() -> World {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(0);
    let segments = (0..2000).map(|_| {
        let a = Point::new(rng.random_range(2.0..60.0), rng.random_range(2.0..60.0));
        let b = a + nalgebra::Vector2::new(rng.random_range(-0.5..0.5), rng.random_range(-0.5..0.5));
        Segment { a, b }
    });
    World {
        name: "map".into(),
        bounds: Bounds { min: Point::origin(), max: Point::new(60.0, 60.0) },
        discs: Vec::new(),
        segments: segments.collect(),
        polygons: Vec::new(),
        people: Vec::new(),
        start: Pose::new(1.0, 1.0, 0.8),
        goal: Point::new(59.0, 59.0),
    }
}
