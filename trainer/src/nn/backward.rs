//! The hand-written backward pass of a [`Mlp`].
//!
//! # The flat ends of tanh
//! An actor whose pre-activations have grown to 15 or 30 gives actions of exactly ±1 and, because `1 - y^2` is then
//! 0 in `f32`, receives no gradient any more: whatever its critic says, it never changes again. On some seeds a whole
//! policy ends there and stands still for ever. [`Mlp::backward_with_slope_floor`] therefore counts the slope of tanh
//! as at least a floor *where the descent moves the output inwards*, away from the end that it sits at; where it moves
//! outwards the slope stays exact, so that nothing is driven into saturation by the floor. The sign of every component
//! of the gradient is that of the exact one.
//!
//! Other known ways are inverting gradients (Hausknecht and Stone 2016), which scale by the room that is left and need
//! an output without tanh, and a penalty on the pre-activation, which also moves actors that are rightly at full speed.

use std::ops::Range;
use tch::Tensor;

use super::buffer::View;
use super::mlp::{Activation, Layer, Mlp};
use super::tape::TapeLayer;
use super::{kernels, layer_norm};

impl Mlp {
    /// Adds the derivative of the loss by every parameter to the gradients, given that by the output of the
    /// last forward pass, `[rows, outputs]`, which was on the same `x`.
    ///
    /// # Panics
    /// When `output_gradient` has another size than the output.
    pub fn backward(&mut self, x: &View<'_>, output_gradient: &[f32]) {
        self.backward_with_slope_floor(x, output_gradient, 0.0);
    }

    /// As [`Mlp::backward`], with the slope of a tanh output counted as `slope_min` at least where descending moves
    /// the output inwards (see the module); 0 is the exact derivative.
    ///
    /// # Panics
    /// As [`Mlp::backward`].
    pub fn backward_with_slope_floor(&mut self, x: &View<'_>, output_gradient: &[f32], slope_min: f32) {
        assert_eq!(x.rows(), self.tape.rows, "a backward pass is on the input of the forward pass before");
        self.propagate(output_gradient, Some(x.tensor()), slope_min);
    }

    /// Derivative by some input columns, `[rows, columns]`; the parameter gradients stay as they are.
    ///
    /// # Panics
    /// As [`Mlp::backward`].
    pub fn input_gradient(&mut self, output_gradient: &[f32], columns: Range<usize>) -> &[f32] {
        self.propagate(output_gradient, None, 0.0);
        let (rows, start, length) = (self.tape.rows, columns.start as i64, columns.len() as i64);
        let out = self.tape.input_gradient.matrix_at(0, rows, columns.len());
        let weight = self.layers[0].weight_view.narrow(1, start, length);
        let _ = self.tape.layers[0].gradient_view.mm_out(&out, &weight);
        &self.tape.input_gradient.as_slice()[..rows * columns.len()]
    }

    /// Down to the product of the first layer; with the input given, adds to the parameter gradients on the way.
    fn propagate(&mut self, output_gradient: &[f32], x: Option<&Tensor>, slope_min: f32) {
        let rows = self.tape.rows;
        assert_eq!(output_gradient.len(), rows * self.outputs(), "one gradient an output");
        let parameters = self.parameters.as_slice();
        let last = self.layers.len() - 1;
        start_gradient(&mut self.tape.layers[last], output_gradient, self.shape.output, slope_min);
        for index in (0..=last).rev() {
            let (before, rest) = self.tape.layers.split_at_mut(index);
            let (layer, tape) = (&self.layers[index], &mut rest[0]);
            let gradients = self.gradients.as_mut_slice();
            if index < last {
                hidden_gradient(tape, layer, rows, parameters, gradients, x.is_some());
            }
            if let Some(x) = x {
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
    }
}

/// Derivative of the output activation, with the floor of [`Mlp::backward_with_slope_floor`].
fn start_gradient(tape: &mut TapeLayer, output_gradient: &[f32], output: Activation, slope_min: f32) {
    let gradient = &mut tape.gradient.as_mut_slice()[..output_gradient.len()];
    gradient.copy_from_slice(output_gradient);
    if output == Activation::Tanh {
        for (gradient, y) in gradient.iter_mut().zip(tape.activation.as_slice()) {
            let slope = 1.0 - y * y;
            // A descent goes against the gradient: of the same sign as y, it moves y towards 0.
            let moves_inwards = *gradient * y > 0.0;
            *gradient *= if moves_inwards { slope.max(slope_min) } else { slope };
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
