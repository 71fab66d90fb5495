//! Decisions as rows of the replay buffer, and batches of them.

use crate::nn::Rng;
use crate::replay::ReplayBuffer;

/// One decision, over as many environment steps as it took. A row of the replay buffer holds its fields in
/// this order, integers as their bits.
#[derive(Debug, Clone, Copy)]
pub struct Decision<'a> {
    /// Compact observation when deciding.
    pub observation: &'a [f32],
    /// The candidate chosen.
    pub action: u32,
    /// Discounted sum of the rewards until the next observation, over n decisions.
    pub reward: f32,
    /// Factor on the value of the next observation: gamma to the number of environment steps until then, 0
    /// when the episode terminated. A truncated episode keeps its discount: it bootstraps.
    pub discount: f32,
    /// Compact observation n decisions later.
    pub next_observation: &'a [f32],
    /// Which candidates are legal there: bit `i` for candidate `i`. With no bit set nothing is bootstrapped.
    pub next_mask: u32,
}

impl Decision<'_> {
    /// Values in a row.
    pub const fn row_length(observation: usize) -> usize {
        2 * observation + 4
    }

    /// Stores the decision.
    ///
    /// # Panics
    /// When the width is not that of the replay buffer.
    pub fn store(&self, replay: &mut ReplayBuffer) {
        let middle = [f32::from_bits(self.action), self.reward, self.discount];
        let last = [f32::from_bits(self.next_mask)];
        replay.push(&[self.observation, &middle, self.next_observation, &last]);
    }
}

/// How a decision becomes that of the scene's mirror image.
#[derive(Debug, Clone, Copy)]
pub struct Mirror {
    /// Of what the policy sees, in place.
    pub observation: fn(&mut [f32]),
    /// Of a candidate.
    pub candidate: fn(usize) -> usize,
}

impl Mirror {
    fn mask(self, mask: u32) -> u32 {
        let bits = (0..32).filter(|candidate| mask >> candidate & 1 == 1);
        bits.fold(0, |mirrored, candidate| mirrored | 1 << (self.candidate)(candidate))
    }
}

/// A batch, allocated once and filled again and again.
#[derive(Debug)]
pub struct DecisionBatch {
    mirror: Option<Mirror>,
    observation: usize,
    now: Vec<f32>,
    actions: Vec<u32>,
    returns: Vec<f32>,
    discounts: Vec<f32>,
    pub(super) next: Vec<f32>,
    next_masks: Vec<u32>,
}

/// Whether a decision looks beyond itself.
pub(super) fn counts(discount: f32, next_mask: u32) -> bool {
    discount > 0.0 && next_mask != 0
}

impl DecisionBatch {
    /// Room for `rows` decisions.
    pub fn new(rows: usize, observation: usize) -> Self {
        Self {
            mirror: None,
            observation,
            now: vec![0.0; rows * observation],
            actions: vec![0; rows],
            returns: vec![0.0; rows],
            discounts: vec![0.0; rows],
            next: vec![0.0; rows * observation],
            next_masks: vec![0; rows],
        }
    }

    /// Every other decision becomes its mirror image when it is sampled.
    pub fn with_mirror(self, mirror: Option<Mirror>) -> Self {
        Self { mirror, ..self }
    }

    /// Number of decisions.
    pub fn rows(&self) -> usize {
        self.actions.len()
    }

    /// Fills all rows from a replay buffer.
    ///
    /// # Panics
    /// When the replay buffer is empty or holds rows of another length.
    pub fn sample(&mut self, replay: &ReplayBuffer, rng: &mut Rng) {
        let width = self.observation;
        assert_eq!(
            replay.position().row_length,
            Decision::row_length(width),
            "replay buffer and batch agree on the row"
        );
        for index in 0..self.rows() {
            let (now, rest) = replay.draw(rng).split_at(width);
            let place = index * width..(index + 1) * width;
            self.now[place.clone()].copy_from_slice(now);
            self.actions[index] = rest[0].to_bits();
            self.returns[index] = rest[1];
            self.discounts[index] = rest[2];
            self.next[place.clone()].copy_from_slice(&rest[3..3 + width]);
            self.next_masks[index] = rest[3 + width].to_bits();
            if let Some(mirror) = self.mirror.filter(|_| index % 2 == 1) {
                (mirror.observation)(&mut self.now[place.clone()]);
                (mirror.observation)(&mut self.next[place]);
                self.actions[index] = (mirror.candidate)(self.actions[index] as usize) as u32;
                self.next_masks[index] = mirror.mask(self.next_masks[index]);
            }
        }
    }

    pub(super) fn observation(&self) -> usize {
        self.observation
    }

    pub(super) fn observation_row(&self, row: usize) -> &[f32] {
        &self.now[row * self.observation..][..self.observation]
    }

    pub(super) fn actions(&self) -> &[u32] {
        &self.actions
    }

    pub(super) fn returns(&self) -> &[f32] {
        &self.returns
    }

    pub(super) fn discounts(&self) -> &[f32] {
        &self.discounts
    }

    pub(super) fn next_masks(&self) -> impl Iterator<Item = u32> {
        self.next_masks.iter().copied()
    }

    /// Next observations and masks of the decisions that look beyond themselves.
    pub(super) fn bootstraps(&self) -> impl Iterator<Item = (&[f32], u32)> {
        let next = self.next.chunks_exact(self.observation).zip(self.next_masks());
        let bootstraps = next.zip(&self.discounts).filter(|((_, mask), discount)| counts(**discount, *mask));
        bootstraps.map(|(next, _)| next)
    }
}
