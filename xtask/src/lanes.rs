//! Jobs side by side, one a core.

use std::collections::VecDeque;
use std::sync::{Mutex, PoisonError};
use std::thread;

use anyhow::Result;

/// Does all jobs, so many at a time. After a failure those under way end, and no other begins.
pub(crate) fn side_by_side<T: Send>(
    jobs: Vec<T>,
    lanes: usize,
    work: impl Fn(&T) -> Result<()> + Sync,
) -> Result<()> {
    let waiting = Mutex::new((VecDeque::from(jobs), Ok(())));
    let locked = || waiting.lock().unwrap_or_else(PoisonError::into_inner);
    let lane = || {
        loop {
            let next = {
                let (jobs, result) = &mut *locked();
                if result.is_err() { None } else { jobs.pop_front() }
            };
            let Some(job) = next else { return };
            if let Err(error) = work(&job) {
                let (_, result) = &mut *locked();
                if result.is_ok() {
                    *result = Err(error);
                }
            }
        }
    };
    thread::scope(|scope| {
        for _ in 0..lanes {
            scope.spawn(lane);
        }
    });
    let (_, result) = waiting.into_inner().unwrap_or_else(PoisonError::into_inner);
    result
}

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::ensure;
    use std::sync::atomic::{AtomicUsize, Ordering};

    #[test]
    fn so_many_run_side_by_side_and_none_begins_after_a_failure() {
        let (now, most, done) = (AtomicUsize::new(0), AtomicUsize::new(0), AtomicUsize::new(0));
        let work = |job: &u32| {
            most.fetch_max(now.fetch_add(1, Ordering::SeqCst) + 1, Ordering::SeqCst);
            thread::sleep(std::time::Duration::from_millis(20));
            now.fetch_sub(1, Ordering::SeqCst);
            done.fetch_add(1, Ordering::SeqCst);
            ensure!(*job != 3, "job {job} fails");
            Ok(())
        };
        side_by_side(vec![0, 1, 2, 4], 2, work).expect("all done");
        assert_eq!((most.load(Ordering::SeqCst), done.load(Ordering::SeqCst)), (2, 4));
        let error = side_by_side(vec![3, 0, 1, 2, 4, 5, 6, 7], 1, work).expect_err("it failed");
        assert!(error.to_string().contains("job 3"), "{error}");
        assert_eq!(done.load(Ordering::SeqCst), 5, "nothing after it");
    }
}
