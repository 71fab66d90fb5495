//! Many episodes on several threads, taken in a fixed order.

use nav_core::task::Task;
use nav_sim::disturbance::Disturbance;
use std::collections::BTreeMap;
use std::convert::Infallible;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc;

use crate::robot::{Driven, Driver, SimulatedRobot};
use crate::worlds::Place;

/// Stack of a thread that drives robots, whose maps and gates are large values that move on their way into a box.
pub const STACK_BYTES: usize = 16 << 20;

/// Does `jobs` on threads, each with a worker that `make` makes, and hands what they give to `take`, here and in the
/// order of the jobs whatever the number of threads; where the system gives none, here, too. Once `stop` says so, no further job is begun; those under way
/// are finished and taken.
///
/// # Errors
/// The first error of `take`; nothing is taken after it.
pub fn in_order<T: Send, W: FnMut(usize) -> T, E>(
    jobs: Range<usize>,
    threads: usize,
    make: impl Fn() -> W + Sync,
    stop: impl Fn() -> bool + Sync,
    mut take: impl FnMut(usize, T) -> Result<(), E>,
) -> Result<(), E> {
    let next = AtomicUsize::new(jobs.start);
    let has_failed = AtomicBool::new(false);
    let (send, receive) = mpsc::channel();
    std::thread::scope(|scope| {
        let mut started = 0;
        for _ in 0..threads.clamp(1, jobs.len().max(1)) {
            let send = send.clone();
            let (next, has_failed, make, stop) = (&next, &has_failed, &make, &stop);
            let end = jobs.end;
            let worker = move || {
                let mut work = make();
                while !has_failed.load(Ordering::Relaxed) && !stop() {
                    let job = next.fetch_add(1, Ordering::Relaxed);
                    if job >= end || send.send((job, work(job))).is_err() {
                        break;
                    }
                }
            };
            started += usize::from(
                std::thread::Builder::new().stack_size(STACK_BYTES).spawn_scoped(scope, worker).is_ok(),
            );
        }
        drop(send);
        if started == 0 {
            let mut work = make();
            return jobs.take_while(|_| !stop()).try_for_each(|job| take(job, work(job)));
        }
        let mut waiting = BTreeMap::new();
        let mut due = jobs.start;
        for (job, result) in receive {
            waiting.insert(job, result);
            while let Some(result) = waiting.remove(&due) {
                if let Err(error) = take(due, result) {
                    has_failed.store(true, Ordering::Relaxed);
                    return Err(error);
                }
                due += 1;
            }
        }
        Ok(())
    })
}

/// What is the same for all episodes of a batch.
#[derive(Clone, Copy, Debug)]
pub struct BatchOptions<'a> {
    /// The task that the robot has.
    pub task: &'a Task,
    /// How the robot differs from a perfect one.
    pub disturbance: &'a Disturbance,
    /// Threads; never more than the machine has cores for.
    pub threads: usize,
}

/// Drives every place once with drivers that `make` makes, one a thread. The result is in the order of `places` and
/// does not depend on the number of threads. The simulation's seed is the place's.
pub fn drive_all<D: Driver>(
    make: impl Fn() -> D + Sync,
    places: &[Place],
    options: &BatchOptions<'_>,
) -> Vec<Driven> {
    let worker = || {
        let mut driver = make();
        let mut robot = SimulatedRobot::new(options.task, options.disturbance);
        move |index: usize| robot.drive(&mut driver, &places[index], false)
    };
    let mut all = Vec::with_capacity(places.len());
    let taken = in_order(
        0..places.len(),
        options.threads,
        worker,
        || false,
        |_, driven| {
            all.push(driven);
            Ok::<(), Infallible>(())
        },
    );
    let Ok(()) = taken;
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    /// Jobs that take the longer, the earlier they are due.
    fn slow_first(job: usize) -> usize {
        std::thread::sleep(Duration::from_millis(20_u64.saturating_sub(job as u64)));
        job * job
    }

    #[test]
    fn results_come_in_the_order_of_the_jobs() {
        let mut taken = Vec::new();
        let result = in_order(
            3..40,
            8,
            || slow_first,
            || false,
            |job, square| {
                taken.push((job, square));
                Ok::<(), ()>(())
            },
        );
        assert_eq!(result, Ok(()));
        assert_eq!(taken, (3..40).map(|job| (job, job * job)).collect::<Vec<_>>());
    }

    #[test]
    fn after_a_stop_what_was_begun_is_taken_without_a_gap() {
        let begun = AtomicUsize::new(0);
        let work = || {
            |job: usize| {
                begun.fetch_add(1, Ordering::Relaxed);
                slow_first(job)
            }
        };
        let mut taken = Vec::new();
        let stop = || begun.load(Ordering::Relaxed) >= 10;
        let result = in_order(0..1000, 4, work, stop, |job, _| {
            taken.push(job);
            Ok::<(), ()>(())
        });
        assert_eq!(result, Ok(()));
        assert_eq!(taken, (0..begun.load(Ordering::Relaxed)).collect::<Vec<_>>());
        assert!(taken.len() < 20, "{taken:?}");
    }

    #[test]
    fn an_error_of_the_taker_ends_it() {
        let take = |job, _| if job == 5 { Err("full") } else { Ok(()) };
        assert_eq!(in_order(0..1000, 4, || slow_first, || false, take), Err("full"));
    }
}
