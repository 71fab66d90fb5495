//! The Adam optimiser (Kingma and Ba 2015) over flat slices, step for step as in torch.

use serde::{Deserialize, Serialize};

use super::kernels::vectorised;
use super::{Mlp, flat};

const BETA_1: f32 = 0.9;
const BETA_2: f32 = 0.999;
const EPSILON: f32 = 1e-8;

/// Moments of one flat parameter slice.
#[derive(Debug, Clone)]
pub struct Adam {
    learning_rate: f32,
    state: AdamState,
}

/// What an optimiser remembers from step to step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AdamState {
    steps: u64,
    first: Vec<f32>,
    second: Vec<f32>,
}

impl Adam {
    /// An optimiser of `parameters` values with zero moments.
    pub fn new(parameters: usize, learning_rate: f32) -> Self {
        let zeros = vec![0.0; parameters];
        Self { learning_rate, state: AdamState { steps: 0, first: zeros.clone(), second: zeros } }
    }

    /// The step size from now on.
    pub fn set_learning_rate(&mut self, learning_rate: f32) {
        self.learning_rate = learning_rate;
    }

    /// The step size.
    pub fn learning_rate(&self) -> f32 {
        self.learning_rate
    }

    /// Moves `parameters` against `gradient`.
    ///
    /// # Panics
    /// When a slice has another length than the optimiser was made for.
    pub fn step(&mut self, parameters: &mut [f32], gradient: &[f32]) {
        let AdamState { steps, first, second } = &mut self.state;
        assert!(parameters.len() == first.len() && gradient.len() == first.len(), "one moment a parameter");
        *steps += 1;
        let exponent = i32::try_from(*steps).unwrap_or(i32::MAX);
        let step_size = f64::from(self.learning_rate) / (1.0 - f64::from(BETA_1).powi(exponent));
        let root = (1.0 - f64::from(BETA_2).powi(exponent)).sqrt();
        step(parameters, gradient, first, second, step_size as f32, root as f32);
    }

    /// What must be saved to continue exactly.
    pub fn state(&self) -> &AdamState {
        &self.state
    }

    /// How many parameters have ever received a gradient.
    #[cfg(test)]
    pub(crate) fn reached(&self) -> usize {
        self.state.second.iter().filter(|moment| **moment > 0.0).count()
    }

    /// Continues from a saved state; false, and nothing changes, when it is for another parameter count.
    #[must_use]
    pub fn restore(&mut self, state: AdamState) -> bool {
        let fits =
            state.first.len() == self.state.first.len() && state.second.len() == self.state.first.len();
        if fits {
            self.state = state;
        }
        fits
    }
}

/// Clips the gradient of a network at a norm (0: no limit), steps, and returns the norm before.
pub fn descend(network: &mut Mlp, adam: &mut Adam, norm_max: f32) -> f32 {
    let (parameters, gradients) = network.parameters_and_gradients();
    let norm = flat::clip_norm(gradients, norm_max);
    adam.step(parameters, gradients);
    norm
}

vectorised! {
    fn step(
        parameters: &mut [f32],
        gradient: &[f32],
        first: &mut [f32],
        second: &mut [f32],
        step_size: f32,
        bias_correction_root: f32,
    ) {
        let moments = first.iter_mut().zip(second);
        for ((parameter, gradient), (first, second)) in parameters.iter_mut().zip(gradient).zip(moments) {
            *first = BETA_1 * *first + (1.0 - BETA_1) * gradient;
            *second = BETA_2 * *second + (1.0 - BETA_2) * gradient * gradient;
            *parameter -= step_size * *first / (second.sqrt() / bias_correction_root + EPSILON);
        }
    }
}
