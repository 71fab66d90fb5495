//! Many episodes on two threads, in a fixed order.

use nav_core::task::Task;
use nav_sim::disturbance::Disturbance;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::robot::{Driven, Driver, SimulatedRobot};
use crate::worlds::Place;

/// What is the same for all episodes of a batch.
#[derive(Clone, Copy, Debug)]
pub struct BatchOptions<'a> {
    /// The task that the robot has.
    pub task: &'a Task,
    /// How the robot differs from a perfect one.
    pub disturbance: &'a Disturbance,
    /// Threads; never more than the machine has cores for.
    pub threads: usize,
    /// How many of the first places are traced for pictures.
    pub traces: usize,
}

/// Drives every place once with drivers that `make` makes, one a thread, and calls `progress` after each
/// episode. The result is in the order of `places` and does not depend on the number of threads. The
/// simulation's seed is the place's.
pub fn drive_all<D: Driver>(
    make: impl Fn() -> D + Sync,
    places: &[Place],
    options: &BatchOptions<'_>,
    progress: impl Fn() + Sync,
) -> Vec<Driven> {
    let next = AtomicUsize::new(0);
    let work = || {
        let mut driver = make();
        let mut robot = SimulatedRobot::new(options.task, options.disturbance);
        let mut finished = Vec::new();
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let Some(place) = places.get(index) else { return finished };
            finished.push((index, robot.drive(&mut driver, place, index < options.traces)));
            progress();
        }
    };
    let mut all: Vec<_> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..options.threads.max(1)).map(|_| scope.spawn(work)).collect();
        threads.into_iter().flat_map(|thread| thread.join().expect("an evaluation thread panicked")).collect()
    });
    all.sort_by_key(|(index, _)| *index);
    all.into_iter().map(|(_, driven)| driven).collect()
}
