//! How the newest attempts ended, for progress and logs: every figure over the same attempts, so that they can be
//! compared with each other.

use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

use super::trail::Judged;

/// An attempt (stage A) or an episode (stage B) that has ended.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ended {
    /// Whether it reached its target.
    pub succeeded: bool,
    /// Whether it ended in a collision.
    pub collided: bool,
    /// Sum of its rewards, undiscounted.
    pub returned: f32,
    /// What the critic promised and what came, if it terminated.
    pub judged: Option<Judged>,
}

/// The newest attempts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Window {
    length: usize,
    attempts: VecDeque<Ended>,
    total: u64,
}

impl Window {
    /// Remembers up to `length` attempts.
    pub fn new(length: usize) -> Self {
        Self { length, attempts: VecDeque::with_capacity(length), total: 0 }
    }

    /// Adds an attempt.
    pub fn push(&mut self, ended: Ended) {
        if self.attempts.len() == self.length {
            self.attempts.pop_front();
        }
        self.attempts.push_back(ended);
        self.total += 1;
    }

    /// Share that succeeded; 0 before the first attempt.
    pub fn success(&self) -> f32 {
        self.share(|ended| ended.succeeded)
    }

    /// Share that collided; 0 before the first attempt.
    pub fn collision(&self) -> f32 {
        self.share(|ended| ended.collided)
    }

    /// Mean return; 0 before the first attempt.
    pub fn mean_return(&self) -> f32 {
        // From +0: the sum of nothing is -0 otherwise.
        self.attempts.iter().fold(0.0, |sum, ended| sum + ended.returned) / self.attempts.len().max(1) as f32
    }

    /// Mean discounted return from the states of the attempts that terminated to their ends, and how much more the
    /// critic promised; nothing before the first such attempt.
    pub fn discounted_return_and_bias(&self) -> Option<(f32, f32)> {
        let judged = || self.attempts.iter().filter_map(|ended| ended.judged);
        let states = judged().map(|judged| judged.states).sum::<u32>() as f32;
        let mean = |of: fn(&Judged) -> f32| judged().fold(0.0, |sum, judged| sum + of(&judged)) / states;
        (states > 0.0)
            .then(|| (mean(|judged| judged.returned), mean(|judged| judged.promised - judged.returned)))
    }

    fn share(&self, of: impl Fn(&Ended) -> bool) -> f32 {
        self.attempts.iter().filter(|ended| of(ended)).count() as f32 / self.attempts.len().max(1) as f32
    }

    /// Whether it holds as many attempts as it remembers.
    pub fn is_full(&self) -> bool {
        self.attempts.len() == self.length
    }

    /// Attempts ever added.
    pub fn total(&self) -> u64 {
        self.total
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_mean_is_over_the_newest_attempts_alone() {
        let mut window = Window::new(2);
        assert_eq!(window.discounted_return_and_bias(), None);
        let figures = [window.success(), window.collision(), window.mean_return()];
        assert_eq!(figures.map(f32::to_bits), [0; 3], "before the first, and without a sign");
        for (succeeded, collided, returned) in [(false, true, -9.0), (true, false, 3.0), (false, false, 1.0)]
        {
            let judged = succeeded.then_some(Judged { states: 4, returned, promised: 5.0 });
            window.push(Ended { succeeded, collided, returned, judged });
        }
        assert_eq!(window.total(), 3);
        assert!((window.success() - 0.5).abs() < 1e-6 && window.collision().abs() < 1e-9);
        assert!((window.mean_return() - 2.0).abs() < 1e-6);
        assert_eq!(window.discounted_return_and_bias(), Some((0.75, 0.5)), "of the one that terminated");
    }
}
