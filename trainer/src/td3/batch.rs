//! Transitions as rows of the replay buffer, and batches of them.

use crate::nn::{Buffer, Rng, View};
use crate::replay::ReplayBuffer;

/// One step of the environment. A row of the replay buffer holds its fields in this order.
#[derive(Debug, Clone, Copy)]
pub struct Transition<'a> {
    /// What the policy saw.
    pub observation: &'a [f32],
    /// What it did, each in `[-1, 1]`.
    pub action: &'a [f32],
    /// What it got, for n steps their discounted sum.
    pub reward: f32,
    /// Factor on the value of the next observation: gamma to the number of steps, 0 when the episode
    /// terminated. A truncated episode keeps its discount: it bootstraps.
    pub discount: f32,
    /// What it saw next.
    pub next_observation: &'a [f32],
}

impl Transition<'_> {
    /// Values in a row.
    pub const fn row_length(observation: usize, action: usize) -> usize {
        2 * observation + action + 2
    }

    /// Stores the transition.
    ///
    /// # Panics
    /// When the widths are not those of the replay buffer.
    pub fn store(&self, replay: &mut ReplayBuffer) {
        let middle = [self.reward, self.discount];
        replay.push(&[self.observation, self.action, &middle, self.next_observation]);
    }
}

/// How a transition becomes that of the scene's mirror image, in place.
#[derive(Debug, Clone, Copy)]
pub struct Mirror {
    /// Of what the policy sees.
    pub observation: fn(&mut [f32]),
    /// Of what it does.
    pub action: fn(&mut [f32]),
}

/// A batch, allocated once and filled again and again.
#[derive(Debug)]
pub struct Batch {
    mirror: Option<Mirror>,
    observation: usize,
    action: usize,
    /// Observation and action, side by side: input of a critic.
    now: Buffer,
    /// Next observation, and room for the target policy's action.
    next: Buffer,
    rewards: Vec<f32>,
    discounts: Vec<f32>,
}

impl Batch {
    /// Room for `rows` transitions.
    pub fn new(rows: usize, observation: usize, action: usize) -> Self {
        Self {
            mirror: None,
            observation,
            action,
            now: Buffer::zeros(rows, observation + action),
            next: Buffer::zeros(rows, observation + action),
            rewards: vec![0.0; rows],
            discounts: vec![0.0; rows],
        }
    }

    /// Every other transition becomes its mirror image when it is sampled.
    pub fn with_mirror(self, mirror: Option<Mirror>) -> Self {
        Self { mirror, ..self }
    }

    /// Number of transitions.
    pub fn rows(&self) -> usize {
        self.rewards.len()
    }

    /// Fills all rows from one replay buffer.
    ///
    /// # Panics
    /// When the replay buffer is empty or holds rows of another length.
    pub fn sample(&mut self, replay: &ReplayBuffer, rng: &mut Rng) {
        self.sample_rows(0..self.rows(), replay, rng);
    }

    /// Fills some rows, so that a batch can mix replay buffers.
    ///
    /// # Panics
    /// As [`Batch::sample`], and when there are no such rows.
    pub fn sample_rows(&mut self, rows: std::ops::Range<usize>, replay: &ReplayBuffer, rng: &mut Rng) {
        let (observation, action) = (self.observation, self.action);
        assert_eq!(
            replay.position().row_length,
            Transition::row_length(observation, action),
            "replay buffer and batch agree on the row"
        );
        for index in rows {
            let (now, rest) = replay.draw(rng).split_at(observation + action);
            self.now.row_mut(index).copy_from_slice(now);
            self.rewards[index] = rest[0];
            self.discounts[index] = rest[1];
            self.next.row_mut(index)[..observation].copy_from_slice(&rest[2..]);
            if let Some(mirror) = self.mirror.filter(|_| index % 2 == 1) {
                let (seen, done) = self.now.row_mut(index).split_at_mut(observation);
                (mirror.observation)(seen);
                (mirror.action)(done);
                (mirror.observation)(&mut self.next.row_mut(index)[..observation]);
            }
        }
    }

    pub(super) fn widths(&self) -> (usize, usize) {
        (self.observation, self.action)
    }

    pub(super) fn rewards(&self) -> &[f32] {
        &self.rewards
    }

    pub(super) fn discounts(&self) -> &[f32] {
        &self.discounts
    }

    pub(super) fn critic_input(&self) -> View<'_> {
        self.now.view(self.rows())
    }

    pub(super) fn next_critic_input(&self) -> View<'_> {
        self.next.view(self.rows())
    }

    pub(super) fn observation(&self) -> View<'_> {
        self.now.view_columns(0, self.observation)
    }

    pub(super) fn next_observation(&self) -> View<'_> {
        self.next.view_columns(0, self.observation)
    }

    pub(super) fn observation_row(&self, row: usize) -> &[f32] {
        &self.now.row(row)[..self.observation]
    }

    pub(super) fn next_observation_row(&self, row: usize) -> &[f32] {
        &self.next.row(row)[..self.observation]
    }

    pub(super) fn action_mut(&mut self, row: usize) -> &mut [f32] {
        let start = self.observation;
        &mut self.now.row_mut(row)[start..]
    }

    pub(super) fn next_action_mut(&mut self, row: usize) -> &mut [f32] {
        let start = self.observation;
        &mut self.next.row_mut(row)[start..]
    }
}
