//! DQN with a shared candidate scorer: double, masked, for decisions that last several steps.
//!
//! The network scores one candidate at a time: `Q(s, a)` is the output for candidate row `a` of `s`, so that
//! one network serves all candidates. Mnih et al. (2015) and van Hasselt et al. (2016), with these
//! differences:
//! 1. The discount is a column of the batch: `gamma` to the number of environment steps between the two
//!    decisions, 0 after a terminated episode (a semi-Markov decision process, n-step).
//! 2. Illegal candidates take part neither in the argmax nor in the target; they are not even computed.
//! 3. The target network moves by Polyak averaging.
//! 4. Huber loss; gradients may be clipped by norm.

mod batch;
#[cfg(test)]
mod tests;

use rand::SeedableRng;
use serde::{Deserialize, Serialize};

pub use self::batch::{Decision, DecisionBatch, Mirror};
use crate::nn::flat::mean;
use crate::nn::{Activation, Adam, AdamState, Buffer, EXPLODED, Mlp, MlpShape, Rng, descend, flat};

/// Hyper-parameters.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DqnConfig {
    /// Hidden widths of the scorer.
    pub hidden: Vec<usize>,
    /// Adam step size.
    pub learning_rate: f32,
    /// Polyak rate of the target.
    pub tau: f32,
    /// TD error at which the loss turns from quadratic to linear.
    pub huber_delta: f32,
    /// Largest gradient norm; 0 means no limit.
    pub gradient_norm_max: f32,
}

impl Default for DqnConfig {
    fn default() -> Self {
        Self {
            hidden: vec![128, 128],
            learning_rate: 5e-4,
            tau: 0.005,
            huber_delta: 1.0,
            gradient_norm_max: 10.0,
        }
    }
}

/// How an observation becomes the rows the scorer reads.
#[derive(Debug, Clone, Copy)]
pub struct Candidates {
    /// Values in a compact observation.
    pub observation: usize,
    /// Number of candidates, at most 32.
    pub count: usize,
    /// Values in a candidate row.
    pub width: usize,
    /// Expands one compact observation into `count * width` values, candidate after candidate.
    pub expand: fn(observation: &[f32], rows: &mut [f32]),
}

/// What one update tells.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct DqnLosses {
    /// Mean Huber loss.
    pub loss: f32,
    /// Mean value of the chosen candidates.
    pub q_mean: f32,
    /// Largest value of a chosen candidate.
    pub q_max: f32,
    /// Mean of the TD target.
    pub target_mean: f32,
    /// Mean absolute TD error.
    pub error_mean: f32,
    /// Norm of the gradient before clipping.
    pub gradient_norm: f32,
}

impl DqnLosses {
    /// Whether every number is finite and no value has exploded; a run that is not sane must be rolled back.
    pub fn is_sane(&self) -> bool {
        let Self { loss, q_mean, q_max, target_mean, error_mean, gradient_norm } = *self;
        [q_mean, q_max, target_mean].iter().all(|value| value.abs() < EXPLODED)
            && [loss, error_mean, gradient_norm].iter().all(|value| value.is_finite())
    }
}

/// The learner.
#[derive(Debug)]
pub struct Dqn {
    config: DqnConfig,
    candidates: Candidates,
    online: Mlp,
    target: Mlp,
    adam: Adam,
    updates: u64,
    /// All candidate rows of one observation.
    expanded: Vec<f32>,
    /// Candidate rows gathered for one pass.
    rows: Buffer,
    chosen: Buffer,
    returns: Vec<f32>,
    gradient: Vec<f32>,
}

/// Everything that must be saved to continue exactly.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DqnState {
    online: Vec<f32>,
    target: Vec<f32>,
    adam: AdamState,
    learning_rate: f32,
    updates: u64,
}

impl Dqn {
    /// A learner with fresh weights.
    ///
    /// # Panics
    /// When there are more than 32 candidates, or none.
    pub fn new(candidates: Candidates, config: DqnConfig, seed: u64) -> Self {
        assert!((1..=32).contains(&candidates.count), "a mask has 32 bits");
        let mut rng = Rng::seed_from_u64(seed);
        let shape = MlpShape::new(candidates.width, &config.hidden, 1, Activation::Identity);
        let online = Mlp::new(shape, &mut rng);
        Self {
            target: online.twin(),
            adam: Adam::new(online.parameters().len(), config.learning_rate),
            online,
            updates: 0,
            expanded: vec![0.0; candidates.count * candidates.width],
            rows: Buffer::zeros(0, candidates.width),
            chosen: Buffer::zeros(0, candidates.width),
            returns: Vec::new(),
            gradient: Vec::new(),
            candidates,
            config,
        }
    }

    /// The scorer.
    pub fn scorer(&self) -> &Mlp {
        &self.online
    }

    /// Updates made.
    pub fn updates(&self) -> u64 {
        self.updates
    }

    /// The Adam step size from now on.
    pub fn set_learning_rate(&mut self, learning_rate: f32) {
        self.adam.set_learning_rate(learning_rate);
    }

    /// Values of all candidates of some compact observations, `[observations, count]`, for acting.
    pub fn values(&mut self, observations: &[f32]) -> &[f32] {
        let Candidates { observation, count, width, expand } = self.candidates;
        let number = observations.len() / observation;
        reserve(&mut self.rows, number * count);
        for (index, observation) in observations.chunks_exact(observation).enumerate() {
            expand(observation, &mut self.rows.as_mut_slice()[index * count * width..][..count * width]);
        }
        self.online.forward(&self.rows.view(number * count))
    }

    /// One update of the scorer and its target.
    ///
    /// # Panics
    /// When the batch has another observation width, or an action that is no candidate.
    pub fn update(&mut self, batch: &DecisionBatch) -> DqnLosses {
        assert_eq!(batch.observation(), self.candidates.observation, "batch and learner agree on widths");
        self.compute_returns(batch);
        let Candidates { width, expand, .. } = self.candidates;
        reserve(&mut self.chosen, batch.rows());
        for row in 0..batch.rows() {
            expand(batch.observation_row(row), &mut self.expanded);
            let from = &self.expanded[batch.actions()[row] as usize * width..][..width];
            self.chosen.row_mut(row).copy_from_slice(from);
        }
        let losses = self.descend(batch.rows());
        flat::polyak(self.target.parameters_mut(), self.online.parameters(), self.config.tau);
        self.updates += 1;
        losses
    }

    /// `y = R + discount * Q'(s', argmax over legal a of Q(s', a))`
    fn compute_returns(&mut self, batch: &DecisionBatch) {
        let Candidates { count, width, expand, .. } = self.candidates;
        self.returns.clear();
        self.returns.extend_from_slice(batch.returns());
        // Gather the legal candidates of every decision that bootstraps, one block a decision.
        reserve(&mut self.rows, batch.rows() * count);
        let mut legal = 0;
        for (observation, mask) in batch.bootstraps() {
            expand(observation, &mut self.expanded);
            for candidate in (0..count).filter(|candidate| mask >> candidate & 1 == 1) {
                let from = &self.expanded[candidate * width..][..width];
                self.rows.row_mut(legal).copy_from_slice(from);
                legal += 1;
            }
        }
        if legal == 0 {
            return;
        }
        let values = self.online.forward(&self.rows.view(legal));
        // Keep the best of each block, at the front of the same rows.
        let (mut start, mut best) = (0, Vec::with_capacity(batch.rows()));
        for (_, mask) in batch.bootstraps() {
            let block = &values[start..start + (mask & low_bits(count)).count_ones() as usize];
            best.extend(argmax(block).map(|offset| start + offset));
            start += block.len();
        }
        let rows = self.rows.as_mut_slice();
        for (slot, &row) in best.iter().enumerate() {
            rows.copy_within(row * width..(row + 1) * width, slot * width);
        }
        let next = self.target.forward(&self.rows.view(best.len()));
        let bootstrapped = batch.discounts().iter().zip(&mut self.returns).zip(batch.next_masks());
        let bootstrapped = bootstrapped.filter(|((discount, _), mask)| batch::counts(**discount, *mask));
        for (((discount, value), _), next) in bootstrapped.zip(next) {
            *value += discount * next;
        }
    }

    /// Huber loss of the chosen candidates to `returns`.
    fn descend(&mut self, rows: usize) -> DqnLosses {
        let delta = self.config.huber_delta;
        let input = self.chosen.view(rows);
        let q = self.online.forward(&input);
        let mut losses = DqnLosses {
            q_mean: mean(q),
            q_max: q.iter().copied().fold(f32::NEG_INFINITY, f32::max),
            target_mean: mean(&self.returns),
            ..DqnLosses::default()
        };
        self.gradient.clear();
        for (q, y) in q.iter().zip(&self.returns) {
            let error = q - y;
            let inside = error.abs().min(delta);
            losses.loss += inside * (error.abs() - 0.5 * inside) / rows as f32;
            losses.error_mean += error.abs() / rows as f32;
            self.gradient.push(error.clamp(-delta, delta) / rows as f32);
        }
        self.online.zero_gradients();
        self.online.backward(&input, &self.gradient);
        losses.gradient_norm = descend(&mut self.online, &mut self.adam, self.config.gradient_norm_max);
        losses
    }

    /// What must be saved to continue exactly.
    pub fn state(&self) -> DqnState {
        DqnState {
            online: self.online.parameters().to_vec(),
            target: self.target.parameters().to_vec(),
            adam: self.adam.state().clone(),
            learning_rate: self.adam.learning_rate(),
            updates: self.updates,
        }
    }

    /// Continues from a saved state; false when it is of another network size (the learner is then useless).
    #[must_use]
    pub fn restore(&mut self, state: DqnState) -> bool {
        self.adam.set_learning_rate(state.learning_rate);
        self.updates = state.updates;
        self.online.set_parameters(&state.online)
            && self.target.set_parameters(&state.target)
            && self.adam.restore(state.adam)
    }
}

/// Makes room for at least `rows` rows; what they held is lost when there was none.
fn reserve(buffer: &mut Buffer, rows: usize) {
    if buffer.rows() < rows {
        *buffer = Buffer::zeros(rows, buffer.columns());
    }
}

/// A mask of the lowest `count` bits.
fn low_bits(count: usize) -> u32 {
    u32::MAX >> (32 - count)
}

/// Position of the largest value, the first of equals.
fn argmax(values: &[f32]) -> Option<usize> {
    (0..values.len()).reduce(|best, index| if values[index] > values[best] { index } else { best })
}
