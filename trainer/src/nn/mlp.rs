//! A multi-layer perceptron: shape, parameters and forward pass; the file `backward` has the derivatives.
//!
//! Hidden layer: `relu(norm(W x + b))`, where `norm` is layer normalisation or nothing. Output layer:
//! `output(W x + b)`. The rectifier's derivative at zero is zero.

use std::ops::Range;

use rand::RngExt;
use serde::{Deserialize, Serialize};
use tch::Tensor;

use super::buffer::{Buffer, View};
use super::tape::Tape;
use super::{Rng, kernels, layer_norm};

/// Blocks of the flat buffer start at multiples of this many values (64 bytes), so that the kernels of the
/// matrix product always see the same alignment and repeat to the bit.
const ALIGNMENT: usize = 16;

/// What follows the last matrix product.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Activation {
    /// Nothing: values.
    Identity,
    /// Hyperbolic tangent: actions in `[-1, 1]`.
    Tanh,
}

/// What a network is, apart from its weights.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MlpShape {
    /// Widths from input to output, at least two.
    pub sizes: Vec<usize>,
    /// What follows the last layer.
    pub output: Activation,
    /// Whether hidden layers are normalised before the rectifier.
    pub layer_norm: bool,
    /// Factor on the initial weights of the last layer; small means that a fresh network gives about zero.
    pub output_gain: f32,
}

impl MlpShape {
    /// A shape without normalisation and with an output gain of one.
    pub fn new(inputs: usize, hidden: &[usize], outputs: usize, output: Activation) -> Self {
        let sizes = [&[inputs], hidden, &[outputs]].concat();
        Self { sizes, output, layer_norm: false, output_gain: 1.0 }
    }
}

/// One layer's weights, read-only.
#[derive(Debug, Clone, Copy)]
pub struct Dense<'a> {
    /// Width of the input.
    pub inputs: usize,
    /// Width of the output.
    pub outputs: usize,
    /// `[outputs][inputs]`, row-major.
    pub weight: &'a [f32],
    /// `[outputs]`.
    pub bias: &'a [f32],
    /// Scale and shift `[outputs]` of a normalised layer.
    pub norm: Option<(&'a [f32], &'a [f32])>,
}

/// Where one layer lives in the flat buffers, and views of it.
#[derive(Debug)]
pub(super) struct Layer {
    pub(super) inputs: usize,
    pub(super) outputs: usize,
    pub(super) weight: Range<usize>,
    pub(super) bias: Range<usize>,
    pub(super) norm: Option<(Range<usize>, Range<usize>)>,
    pub(super) weight_view: Tensor,
    pub(super) weight_view_transposed: Tensor,
    pub(super) weight_gradient_view: Tensor,
}

/// A network, its gradients, and the activations of its last forward pass.
#[derive(Debug)]
pub struct Mlp {
    pub(super) shape: MlpShape,
    pub(super) layers: Vec<Layer>,
    pub(super) parameters: Buffer,
    pub(super) gradients: Buffer,
    pub(super) tape: Tape,
}

impl Mlp {
    /// A network with fresh weights: uniform in `±1 / sqrt(inputs)` for weights and biases (torch's default),
    /// times the output gain in the last layer.
    ///
    /// # Panics
    /// When the shape has fewer than two sizes or one of them is zero.
    pub fn new(shape: MlpShape, rng: &mut Rng) -> Self {
        let mut mlp = Self::zeroed(shape);
        let last = mlp.layers.len() - 1;
        let values = mlp.parameters.as_mut_slice();
        for (index, layer) in mlp.layers.iter().enumerate() {
            let gain = if index == last { mlp.shape.output_gain } else { 1.0 };
            let bound = gain / (layer.inputs as f32).sqrt();
            for range in [&layer.weight, &layer.bias] {
                for value in &mut values[range.clone()] {
                    *value = bound * (2.0 * rng.random::<f32>() - 1.0);
                }
            }
            if let Some((scale, _)) = &layer.norm {
                values[scale.clone()].fill(1.0);
            }
        }
        mlp
    }

    fn zeroed(shape: MlpShape) -> Self {
        assert!(shape.sizes.len() >= 2 && !shape.sizes.contains(&0), "a network has an input and an output");
        let mut end = 0;
        let mut block = |length: usize| {
            let start = end;
            end += length.next_multiple_of(ALIGNMENT);
            start..start + length
        };
        let count = shape.sizes.len() - 1;
        let ranges: Vec<_> = (0..count)
            .map(|index| {
                let (inputs, outputs) = (shape.sizes[index], shape.sizes[index + 1]);
                let (weight, bias) = (block(inputs * outputs), block(outputs));
                let norm = (shape.layer_norm && index + 1 < count).then(|| (block(outputs), block(outputs)));
                (inputs, outputs, weight, bias, norm)
            })
            .collect();
        let (parameters, gradients) = (Buffer::zeros(1, end), Buffer::zeros(1, end));
        let layers: Vec<_> = ranges
            .into_iter()
            .map(|(inputs, outputs, weight, bias, norm)| {
                let weight_view = parameters.matrix_at(weight.start, outputs, inputs);
                Layer {
                    weight_view_transposed: weight_view.tr(),
                    weight_gradient_view: gradients.matrix_at(weight.start, outputs, inputs),
                    inputs,
                    outputs,
                    weight,
                    bias,
                    norm,
                    weight_view,
                }
            })
            .collect();
        let tape =
            Tape::new(shape.sizes[0], layers.iter().map(|layer| (layer.outputs, layer.norm.is_some())));
        Self { shape, layers, parameters, gradients, tape }
    }

    /// What the network is.
    pub fn shape(&self) -> &MlpShape {
        &self.shape
    }

    /// Width of the output.
    pub fn outputs(&self) -> usize {
        self.layers[self.layers.len() - 1].outputs
    }

    /// All parameters, flat; a few zeros pad each block.
    pub fn parameters(&self) -> &[f32] {
        self.parameters.as_slice()
    }

    /// All parameters, flat.
    pub fn parameters_mut(&mut self) -> &mut [f32] {
        self.parameters.as_mut_slice()
    }

    /// The sum of all gradients since [`Mlp::zero_gradients`], flat, placed as the parameters.
    pub fn gradients(&self) -> &[f32] {
        self.gradients.as_slice()
    }

    /// Takes over saved parameters; false, and nothing changes, when their number is another.
    #[must_use]
    pub fn set_parameters(&mut self, parameters: &[f32]) -> bool {
        let fits = parameters.len() == self.parameters().len();
        if fits {
            self.parameters_mut().copy_from_slice(parameters);
        }
        fits
    }

    /// Number of parameters without the padding.
    #[cfg(test)]
    pub(crate) fn parameter_count(&self) -> usize {
        let norm = |layer: &Layer| layer.norm.as_ref().map_or(0, |(scale, shift)| scale.len() + shift.len());
        self.layers.iter().map(|layer| layer.weight.len() + layer.bias.len() + norm(layer)).sum()
    }

    /// Lifts every hidden unit off the flat side of its rectifier, so that a test sees all of them work.
    #[cfg(test)]
    pub(crate) fn lift_hidden_units(&mut self) {
        let last = self.layers.len() - 1;
        let values = self.parameters.as_mut_slice();
        for (index, layer) in self.layers[..last].iter().enumerate() {
            values[layer.bias.clone()].fill(0.5);
            if index > 0 && layer.norm.is_none() {
                values[layer.weight.clone()].iter_mut().for_each(|weight| *weight = weight.abs());
            }
        }
    }

    /// Adds to the bias of every output, so that a test can start from a saturated network.
    #[cfg(test)]
    pub(crate) fn shift_outputs(&mut self, by: f32) {
        let bias = self.layers[self.layers.len() - 1].bias.clone();
        self.parameters.as_mut_slice()[bias].iter_mut().for_each(|bias| *bias += by);
    }

    /// A network of the same shape with the same weights, as a target.
    pub fn twin(&self) -> Self {
        let mut twin = Self::zeroed(self.shape.clone());
        twin.parameters_mut().copy_from_slice(self.parameters());
        twin
    }

    /// Parameters and gradients, for an optimiser.
    pub fn parameters_and_gradients(&mut self) -> (&mut [f32], &mut [f32]) {
        (self.parameters.as_mut_slice(), self.gradients.as_mut_slice())
    }

    /// Forgets all gradients.
    pub fn zero_gradients(&mut self) {
        self.gradients.as_mut_slice().fill(0.0);
    }

    /// The weights layer by layer.
    pub fn layers(&self) -> impl Iterator<Item = Dense<'_>> {
        let values = self.parameters();
        self.layers.iter().map(|layer| Dense {
            inputs: layer.inputs,
            outputs: layer.outputs,
            weight: &values[layer.weight.clone()],
            bias: &values[layer.bias.clone()],
            norm: layer.norm.as_ref().map(|(a, b)| (&values[a.clone()], &values[b.clone()])),
        })
    }

    /// Runs the network on `x` `[rows, inputs]` (rows may be strided) and returns `[rows, outputs]`.
    pub fn forward(&mut self, x: &View<'_>) -> &[f32] {
        let (x, rows) = (x.tensor(), x.rows());
        let parameters = self.parameters.as_slice();
        self.tape.resize(rows);
        for index in 0..self.layers.len() {
            let (before, rest) = self.tape.layers.split_at_mut(index);
            let (layer, tape) = (&self.layers[index], &mut rest[0]);
            let input = before.last().map_or(x, |tape| &tape.activation_view);
            let _ = input.mm_out(&tape.activation_view, &layer.weight_view_transposed);
            let values = &mut tape.activation.as_mut_slice()[..rows * layer.outputs];
            let bias = &parameters[layer.bias.clone()];
            if index + 1 == self.layers.len() {
                kernels::add_bias(values, bias);
                if self.shape.output == Activation::Tanh {
                    values.iter_mut().for_each(|value| *value = libm::tanhf(*value));
                }
            } else if let (Some((scale, shift)), Some((normal, inverse))) = (&layer.norm, &mut tape.normal) {
                let normal = &mut normal.as_mut_slice()[..rows * layer.outputs];
                let (scale, shift) = (&parameters[scale.clone()], &parameters[shift.clone()]);
                layer_norm::forward(values, normal, &mut inverse[..rows], bias, scale, shift);
            } else {
                kernels::add_bias_relu(values, bias);
            }
        }
        self.output()
    }

    /// What the last forward pass gave, `[rows, outputs]`.
    pub fn output(&self) -> &[f32] {
        let last = &self.tape.layers[self.layers.len() - 1].activation;
        &last.as_slice()[..self.tape.rows * last.columns()]
    }
}
