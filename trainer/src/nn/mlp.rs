//! A multi-layer perceptron with a hand-written backward pass.
//!
//! Hidden layer: `relu(norm(W x + b))`, where `norm` is layer normalisation or nothing. Output layer:
//! `output(W x + b)`. The rectifier's derivative at zero is zero.

use std::ops::Range;

use rand::RngExt;
use serde::{Deserialize, Serialize};
use tch::Tensor;

use super::buffer::Buffer;
use super::tape::{Tape, TapeLayer};
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
struct Layer {
    inputs: usize,
    outputs: usize,
    weight: Range<usize>,
    bias: Range<usize>,
    norm: Option<(Range<usize>, Range<usize>)>,
    weight_view: Tensor,
    weight_view_transposed: Tensor,
    weight_gradient_view: Tensor,
}

/// A network, its gradients, and the activations of its last forward pass.
#[derive(Debug)]
pub struct Mlp {
    shape: MlpShape,
    layers: Vec<Layer>,
    parameters: Buffer,
    gradients: Buffer,
    tape: Tape,
}

/// How far a backward pass goes.
#[derive(Clone)]
enum Reach {
    Parameters,
    ParametersAndInput,
    InputColumns(Range<usize>),
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
    ///
    /// `x` is kept, not copied: it must not change before the backward pass.
    pub fn forward(&mut self, x: &Tensor) -> &[f32] {
        let rows = x.size()[0] as usize;
        let parameters = self.parameters.as_slice();
        self.tape.resize(rows);
        self.tape.input = Some(x.shallow_clone());
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
                    values.iter_mut().for_each(|value| *value = value.tanh());
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

    /// Adds the derivative of the loss by every parameter to the gradients, given that by the output of the
    /// last forward pass, `[rows, outputs]`.
    ///
    /// # Panics
    /// When there was no forward pass or `output_gradient` has another size.
    pub fn backward(&mut self, output_gradient: &[f32]) {
        self.propagate(output_gradient, &Reach::Parameters);
    }

    /// As [`Mlp::backward`], and returns the derivative by the input, `[rows, inputs]`.
    pub fn backward_to_input(&mut self, output_gradient: &[f32]) -> &[f32] {
        self.propagate(output_gradient, &Reach::ParametersAndInput);
        &self.tape.input_gradient.as_slice()[..self.tape.rows * self.shape.sizes[0]]
    }

    /// Derivative by some input columns only, `[rows, columns]`; the parameter gradients stay as they are.
    pub fn input_gradient(&mut self, output_gradient: &[f32], columns: Range<usize>) -> &[f32] {
        let count = self.tape.rows * columns.len();
        self.propagate(output_gradient, &Reach::InputColumns(columns));
        &self.tape.input_gradient.as_slice()[..count]
    }

    fn propagate(&mut self, output_gradient: &[f32], reach: &Reach) {
        let rows = self.tape.rows;
        let x = self.tape.input.as_ref().expect("a backward pass follows a forward pass");
        assert_eq!(output_gradient.len(), rows * self.outputs(), "one gradient an output");
        let parameters = self.parameters.as_slice();
        let last = self.layers.len() - 1;
        let with_parameters = !matches!(reach, Reach::InputColumns(_));
        start_gradient(&mut self.tape.layers[last], output_gradient, self.shape.output);
        for index in (0..=last).rev() {
            let (before, rest) = self.tape.layers.split_at_mut(index);
            let (layer, tape) = (&self.layers[index], &mut rest[0]);
            let gradients = self.gradients.as_mut_slice();
            if index < last {
                hidden_gradient(tape, layer, rows, parameters, gradients, with_parameters);
            }
            if with_parameters {
                let flat = &tape.gradient.as_slice()[..rows * layer.outputs];
                kernels::add_column_sums(&mut gradients[layer.bias.clone()], flat);
                let input = before.last().map_or(x, |tape| &tape.activation_view);
                let sum = &layer.weight_gradient_view;
                let _ = sum.addmm_out(sum, &tape.gradient_view_transposed, input);
            }
            if let Some(below) = before.last() {
                let _ = tape.gradient_view.mm_out(&below.gradient_view, &layer.weight_view);
            }
        }
        let (columns, weight) = match reach {
            Reach::Parameters => return,
            Reach::ParametersAndInput => (self.shape.sizes[0], self.layers[0].weight_view.shallow_clone()),
            Reach::InputColumns(range) => {
                let (start, length) = (range.start as i64, range.len() as i64);
                (range.len(), self.layers[0].weight_view.narrow(1, start, length))
            }
        };
        let out = self.tape.input_gradient.matrix_at(0, rows, columns);
        let _ = self.tape.layers[0].gradient_view.mm_out(&out, &weight);
    }
}

/// Derivative of the output activation.
fn start_gradient(tape: &mut TapeLayer, output_gradient: &[f32], output: Activation) {
    let gradient = &mut tape.gradient.as_mut_slice()[..output_gradient.len()];
    gradient.copy_from_slice(output_gradient);
    if output == Activation::Tanh {
        for (gradient, y) in gradient.iter_mut().zip(tape.activation.as_slice()) {
            *gradient *= 1.0 - y * y;
        }
    }
}

/// Turns the derivative by a hidden activation into that by its matrix product, in place.
fn hidden_gradient(
    tape: &mut TapeLayer,
    layer: &Layer,
    rows: usize,
    parameters: &[f32],
    gradients: &mut [f32],
    with_parameters: bool,
) {
    let count = rows * layer.outputs;
    let gradient = &mut tape.gradient.as_mut_slice()[..count];
    kernels::relu_backward(gradient, &tape.activation.as_slice()[..count]);
    if let (Some((scale, shift)), Some((normal, inverse))) = (&layer.norm, &tape.normal) {
        let normal = &normal.as_slice()[..count];
        let weights = &parameters[scale.clone()];
        if with_parameters {
            let (scales, shifts) = gradients.split_at_mut(shift.start);
            let (scales, shifts) = (&mut scales[scale.clone()], &mut shifts[..shift.len()]);
            layer_norm::backward(gradient, normal, &inverse[..rows], weights, scales, shifts);
        } else {
            let (mut scales, mut shifts) = (vec![0.0; layer.outputs], vec![0.0; layer.outputs]);
            layer_norm::backward(gradient, normal, &inverse[..rows], weights, &mut scales, &mut shifts);
        }
    }
}
