//! Multi-layer perceptrons without an ONNX file, for a trainer that refreshes its policy between steps.

use super::{Activation, Combine, MAX_STEPS, NetworkError, NetworkSpec, Value};
use heapless::Vec;

/// The most linear layers of an [`MlpSpec`].
pub const MAX_LAYERS: usize = 8;

/// The shape of a multi-layer perceptron: `sizes[0] -> sizes[1] -> ... -> sizes[last]`.
#[derive(Clone, Debug, PartialEq)]
pub struct MlpSpec {
    sizes: Vec<usize, { MAX_LAYERS + 1 }>,
    hidden: Activation,
    output: Activation,
    rows: usize,
}

/// One linear layer.
#[derive(Clone, Copy, Debug)]
pub struct Layer<'w> {
    /// Row-major `[outputs][inputs]`, as PyTorch's `Linear.weight`.
    pub weights: &'w [f32],
    /// One number an output.
    pub bias: &'w [f32],
}

/// The numbers of a multi-layer perceptron.
#[derive(Clone, Copy, Debug)]
pub struct MlpWeights<'w> {
    layers: &'w [Layer<'w>],
    normalisation: Option<(&'w [f32], &'w [f32])>,
}

impl<'w> MlpWeights<'w> {
    /// Layers from input to output.
    pub fn new(layers: &'w [Layer<'w>]) -> Self {
        Self { layers, normalisation: None }
    }

    /// Normalises the input first: `(x - mean) * inverse_deviation`, one number a column each. Rounds as the exported
    /// graph does.
    #[must_use]
    pub fn normalisation(self, mean: &'w [f32], inverse_deviation: &'w [f32]) -> Self {
        Self { normalisation: Some((mean, inverse_deviation)), ..self }
    }
}

impl MlpSpec {
    /// A perceptron with ReLU between its layers, no output activation and one row.
    ///
    /// # Errors
    /// When there are fewer than two or more than [`MAX_LAYERS`] + 1 sizes.
    pub fn new(sizes: &[usize]) -> Result<Self, NetworkError> {
        if sizes.len() < 2 {
            return Err(NetworkError::Length {
                what: "the list of layer sizes",
                expected: 2,
                found: sizes.len(),
            });
        }
        let sizes = Vec::from_slice(sizes).map_err(|_| NetworkError::TooManySteps)?;
        Ok(Self { sizes, hidden: Activation::Relu, output: Activation::Identity, rows: 1 })
    }

    /// Sets the function between layers.
    #[must_use]
    pub fn hidden(self, activation: Activation) -> Self {
        Self { hidden: activation, ..self }
    }

    /// Sets the function after the last layer.
    #[must_use]
    pub fn output(self, activation: Activation) -> Self {
        Self { output: activation, ..self }
    }

    /// Sets how many rows a run takes, for example one a candidate.
    #[must_use]
    pub fn rows(self, rows: usize) -> Self {
        Self { rows, ..self }
    }

    /// Layer sizes, input first.
    pub fn sizes(&self) -> &[usize] {
        &self.sizes
    }

    /// Describes the perceptron with these weights, to pack or to repack a network.
    ///
    /// # Errors
    /// When the number of layers or a length differs from the shape.
    pub fn spec<'w>(&self, weights: &MlpWeights<'w>) -> Result<NetworkSpec<'w>, NetworkError> {
        const { assert!(MAX_LAYERS + 4 <= MAX_STEPS, "a perceptron always fits") };
        let expected = self.sizes.len() - 1;
        let found = weights.layers.len();
        if expected != found {
            return Err(NetworkError::Length { what: "the list of layers", expected, found });
        }
        let mut spec = NetworkSpec::new();
        let mut x = spec.input(self.rows, self.sizes[0])?;
        if let Some((mean, inverse_deviation)) = weights.normalisation {
            x = keep_cols(spec.combine(Combine::Sub, x, mean)?, x.cols())?;
            x = keep_cols(spec.combine(Combine::Mul, x, inverse_deviation)?, x.cols())?;
        }
        for (index, layer) in weights.layers.iter().enumerate() {
            let outputs = self.sizes[index + 1];
            let (expected, found) = (outputs.saturating_mul(x.cols()), layer.weights.len());
            if expected != found {
                return Err(NetworkError::Length { what: "a layer's weights", expected, found });
            }
            let activation = if index + 1 == weights.layers.len() { self.output } else { self.hidden };
            x = spec.linear(x, layer.weights, Some(layer.bias), activation)?;
        }
        spec.output(x)?;
        Ok(spec)
    }
}

/// Refuses a vector that would widen a one-column value.
fn keep_cols(value: Value, expected: usize) -> Result<Value, NetworkError> {
    let found = value.cols();
    if expected == found {
        Ok(value)
    } else {
        Err(NetworkError::Length { what: "a scale or shift", expected, found })
    }
}
