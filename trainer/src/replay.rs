//! A replay buffer of packed rows.
//!
//! A transition is one row of `f32`, so that storing it is one copy and sampling it is one cache-friendly
//! read. The learners say what a row holds ([`crate::td3::Transition`], [`crate::dqn::Decision`]).

use rand::RngExt;
use serde::{Deserialize, Serialize};
use std::collections::TryReserveError;

use crate::nn::Rng;

/// A ring of rows: the newest overwrites the oldest once the capacity is reached.
#[derive(Debug, Clone)]
pub struct ReplayBuffer {
    position: ReplayPosition,
    rows: Vec<f32>,
}

/// Everything about a replay buffer but its rows: what a checkpoint keeps beside them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct ReplayPosition {
    /// Rows it can hold.
    pub capacity: usize,
    /// Values in a row.
    pub row_length: usize,
    /// Where the next row goes.
    pub next: usize,
    /// Rows ever stored.
    pub stored: u64,
}

impl ReplayBuffer {
    /// An empty buffer. Memory is reserved but only touched as rows come in.
    ///
    /// # Panics
    /// When capacity or row length is zero, or the memory is not to be had.
    pub fn new(capacity: usize, row_length: usize) -> Self {
        Self::try_new(capacity, row_length).expect("so few rows find room")
    }

    /// As [`Self::new`], of a capacity that somebody chose.
    ///
    /// # Errors
    /// Memory that is not to be had.
    ///
    /// # Panics
    /// When capacity or row length is zero.
    pub fn try_new(capacity: usize, row_length: usize) -> Result<Self, TryReserveError> {
        assert!(capacity > 0 && row_length > 0, "a replay buffer holds at least one value");
        let position = ReplayPosition { capacity, row_length, next: 0, stored: 0 };
        let mut rows = Vec::new();
        rows.try_reserve_exact(capacity.saturating_mul(row_length))?;
        Ok(Self { position, rows })
    }

    /// A buffer as it was saved; nothing when the rows do not fit the position.
    pub fn restore(position: ReplayPosition, mut rows: Vec<f32>) -> Option<Self> {
        let ReplayPosition { capacity, row_length, next, stored } = position;
        let length = usize::try_from(stored).unwrap_or(usize::MAX).min(capacity);
        let total = capacity.checked_mul(row_length)?;
        if total == 0 || next >= capacity || rows.len() != length * row_length {
            return None;
        }
        rows.reserve_exact(total - rows.len());
        Some(Self { position, rows })
    }

    /// What to save beside the rows.
    pub fn position(&self) -> ReplayPosition {
        self.position
    }

    /// All rows, in the order of their places in the ring.
    pub fn rows(&self) -> &[f32] {
        &self.rows
    }

    /// Rows held now.
    pub fn len(&self) -> usize {
        self.rows.len() / self.position.row_length
    }

    /// Whether nothing was stored yet.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Stores one row, given in parts.
    ///
    /// # Panics
    /// When the parts do not add up to one row.
    pub fn push(&mut self, parts: &[&[f32]]) {
        let length = self.position.row_length;
        assert_eq!(parts.iter().map(|part| part.len()).sum::<usize>(), length, "the parts make one row");
        let start = self.position.next * length;
        if start == self.rows.len() {
            parts.iter().for_each(|part| self.rows.extend_from_slice(part));
        } else {
            let mut row = &mut self.rows[start..start + length];
            for part in parts {
                let (head, tail) = row.split_at_mut(part.len());
                head.copy_from_slice(part);
                row = tail;
            }
        }
        self.position.next = (self.position.next + 1) % self.position.capacity;
        self.position.stored += 1;
    }

    /// A row drawn uniformly, with replacement.
    ///
    /// # Panics
    /// When the buffer is empty.
    pub fn draw(&self, rng: &mut Rng) -> &[f32] {
        let index = rng.random_range(0..self.len() as u64) as usize;
        &self.rows[index * self.position.row_length..][..self.position.row_length]
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;

    #[test]
    fn the_newest_rows_stay() {
        let mut replay = ReplayBuffer::new(3, 2);
        for value in 0..5_u8 {
            replay.push(&[&[f32::from(value)], &[-f32::from(value)]]);
        }
        assert_eq!(replay.len(), 3);
        assert_eq!(replay.rows(), [3.0, -3.0, 4.0, -4.0, 2.0, -2.0]);
        assert_eq!(replay.position().stored, 5);
    }

    #[test]
    fn memory_that_is_not_to_be_had_is_an_error() {
        assert!(ReplayBuffer::try_new(1 << 60, 1 << 10).is_err());
    }

    #[test]
    fn draws_reach_every_row_and_repeat_with_the_seed() {
        let mut replay = ReplayBuffer::new(8, 1);
        (0..8_u8).for_each(|value| replay.push(&[&[f32::from(value)]]));
        let draws = |seed| {
            let mut rng = Rng::seed_from_u64(seed);
            (0..200).map(|_| replay.draw(&mut rng)[0].to_bits()).collect::<Vec<_>>()
        };
        assert_eq!(draws(1), draws(1));
        assert_ne!(draws(1), draws(2));
        let distinct: std::collections::HashSet<_> = draws(3).into_iter().collect();
        assert_eq!(distinct.len(), 8);
    }

    #[test]
    fn a_restored_buffer_continues_where_it_was() {
        let mut replay = ReplayBuffer::new(3, 1);
        (0..4_u8).for_each(|value| replay.push(&[&[f32::from(value)]]));
        let mut again = ReplayBuffer::restore(replay.position(), replay.rows().to_vec()).expect("it fits");
        replay.push(&[&[9.0]]);
        again.push(&[&[9.0]]);
        assert_eq!(again.rows(), replay.rows());
        assert_eq!(again.position(), replay.position());
        assert!(ReplayBuffer::restore(replay.position(), vec![0.0; 2]).is_none());
    }
}
