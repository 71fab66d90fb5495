//! How the newest attempts ended, for progress and logs: every figure over the same attempts, so that they can be
//! compared with each other.

use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

/// An attempt (stage A) or an episode (stage B) that has ended.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ended {
    /// Whether it reached its target.
    pub succeeded: bool,
    /// Whether it ended in a collision.
    pub collided: bool,
    /// Sum of its rewards, undiscounted.
    pub returned: f32,
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
        self.mean(|ended| f32::from(u8::from(ended.succeeded)))
    }

    /// Share that collided.
    pub fn collision(&self) -> f32 {
        self.mean(|ended| f32::from(u8::from(ended.collided)))
    }

    /// Mean return.
    pub fn mean_return(&self) -> f32 {
        self.mean(|ended| ended.returned)
    }

    fn mean(&self, of: impl Fn(&Ended) -> f32) -> f32 {
        self.attempts.iter().map(of).sum::<f32>() / self.attempts.len().max(1) as f32
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
        assert!(window.success().abs() < 1e-9 && window.mean_return().abs() < 1e-9, "before the first");
        for (succeeded, collided, returned) in [(false, true, -9.0), (true, false, 3.0), (false, false, 1.0)]
        {
            window.push(Ended { succeeded, collided, returned });
        }
        assert_eq!(window.total(), 3);
        assert!((window.success() - 0.5).abs() < 1e-6 && window.collision().abs() < 1e-9);
        assert!((window.mean_return() - 2.0).abs() < 1e-6);
    }
}
