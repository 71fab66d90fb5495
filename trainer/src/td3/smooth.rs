//! CAPS: conditioning for action policy smoothness (Mysore, Mabsout, Mancuso and Saenko 2021).
//!
//! With actions `a` at the observations, `b` at the next ones and `c` at perturbed ones, the loss is
//! `temporal * mean((a - b)^2) + spatial * mean((a - c)^2)` over batch and action dimensions. All three pass
//! through the actor as one batch, and the gradient flows into all of them.

use nav_sim::normal::standard_normal;

use super::{Batch, Td3Config};
use crate::nn::{Buffer, Rng, View};

#[derive(Debug)]
pub(super) struct Smoothness {
    temporal: f32,
    spatial: f32,
    noise: f32,
    observation: usize,
    action: usize,
    input: Buffer,
}

impl Smoothness {
    /// Nothing when both weights are zero.
    pub(super) fn new(config: &Td3Config, observation: usize, action: usize) -> Option<Self> {
        let (temporal, spatial) = (config.smooth_temporal, config.smooth_spatial);
        (temporal > 0.0 || spatial > 0.0).then(|| Self {
            temporal,
            spatial,
            noise: config.smooth_spatial_noise,
            observation,
            action,
            input: Buffer::zeros(0, observation),
        })
    }

    /// Lays out observations, then next observations and perturbed observations as the weights ask for.
    pub(super) fn fill(&mut self, batch: &Batch, rng: &mut Rng) {
        let rows = batch.rows();
        let blocks = 1 + usize::from(self.temporal > 0.0) + usize::from(self.spatial > 0.0);
        if self.input.rows() != blocks * rows {
            self.input = Buffer::zeros(blocks * rows, self.observation);
        }
        for row in 0..rows {
            self.input.row_mut(row).copy_from_slice(batch.observation_row(row));
            if self.temporal > 0.0 {
                self.input.row_mut(rows + row).copy_from_slice(batch.next_observation_row(row));
            }
            if self.spatial > 0.0 {
                let perturbed = self.input.row_mut((blocks - 1) * rows + row);
                for (slot, value) in perturbed.iter_mut().zip(batch.observation_row(row)) {
                    *slot = value + self.noise * standard_normal(rng);
                }
            }
        }
    }

    /// What [`Smoothness::fill`] has laid out.
    pub(super) fn input(&self) -> View<'_> {
        self.input.view(self.input.rows())
    }

    /// Appends and adds the gradient by the actions of [`Smoothness::input`], given the `[rows, action]`
    /// gradient of the other losses; returns the temporal and the spatial loss, unweighted.
    pub(super) fn add_gradient(&self, actions: &[f32], rows: usize, gradient: &mut Vec<f32>) -> (f32, f32) {
        let count = rows * self.action;
        gradient.resize(actions.len(), 0.0);
        let (here, other) = actions.split_at(count);
        let (here_gradient, other_gradient) = gradient.split_at_mut(count);
        let terms = [self.temporal, self.spatial];
        let mut losses = [0.0; 2];
        let mut blocks = other.chunks_exact(count).zip(other_gradient.chunks_exact_mut(count));
        for (weight, loss) in terms.into_iter().zip(&mut losses).filter(|(weight, _)| *weight > 0.0) {
            let Some((there, there_gradient)) = blocks.next() else { break };
            for i in 0..count {
                let difference = here[i] - there[i];
                *loss += difference * difference / count as f32;
                let slope = 2.0 * weight * difference / count as f32;
                here_gradient[i] += slope;
                there_gradient[i] -= slope;
            }
        }
        (losses[0], losses[1])
    }
}
