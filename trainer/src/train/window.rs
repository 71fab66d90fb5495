//! Success over the newest attempts, for progress and logs.

use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

/// The newest attempts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Window {
    length: usize,
    /// (succeeded, collided)
    attempts: VecDeque<(bool, bool)>,
    total: u64,
}

impl Window {
    /// Remembers up to `length` attempts.
    pub fn new(length: usize) -> Self {
        Self { length, attempts: VecDeque::with_capacity(length), total: 0 }
    }

    /// Adds an attempt.
    pub fn push(&mut self, succeeded: bool, collided: bool) {
        if self.attempts.len() == self.length {
            self.attempts.pop_front();
        }
        self.attempts.push_back((succeeded, collided));
        self.total += 1;
    }

    /// Share that succeeded; 0 before the first attempt.
    pub fn success(&self) -> f32 {
        self.share(|attempt| attempt.0)
    }

    /// Share that collided.
    pub fn collision(&self) -> f32 {
        self.share(|attempt| attempt.1)
    }

    fn share(&self, counts: impl Fn(&(bool, bool)) -> bool) -> f32 {
        self.attempts.iter().filter(|attempt| counts(attempt)).count() as f32
            / self.attempts.len().max(1) as f32
    }

    /// Attempts ever added.
    pub fn total(&self) -> u64 {
        self.total
    }
}
