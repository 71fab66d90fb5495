//! tract's `EinSum` with constant weights as a plain matrix product.

use super::lower::{Refusal, floats};
use tract_onnx::prelude::Tensor;
use tract_onnx::tract_core::ops::einsum::EinSum;

/// `[rows, inputs] x [inputs, outputs]`, weights row-major `[outputs][inputs]`.
pub(super) struct Product {
    pub(super) rows: usize,
    pub(super) inputs: usize,
    pub(super) outputs: usize,
    pub(super) weights: Vec<f32>,
}

/// One axis of the sum that is longer than one, by its places in the operands.
struct Long {
    dim: usize,
    in_x: Option<usize>,
    in_weights: Option<usize>,
    in_output: Option<usize>,
}

/// Reads `op`, whose operand `weights_at` is constant and whose other operand has shape `x_shape`.
///
/// Axes of length one carry no order and are left out. Of the rest, those of `x` and the output are rows, those of `x` and
/// the weights are inputs, those of the weights and the output are outputs.
pub(super) fn product(
    op: &EinSum,
    weights_at: usize,
    weights: &Tensor,
    x_shape: &[usize],
) -> Result<Product, Refusal> {
    if op.q_params.is_some() {
        return Err("it is quantised".to_owned());
    }
    let long = long_axes(op, weights_at, weights.shape(), x_shape)?;
    let mut rows: Vec<&Long> = Vec::new();
    let mut inputs: Vec<&Long> = Vec::new();
    let mut outputs: Vec<&Long> = Vec::new();
    for axis in &long {
        match (axis.in_x, axis.in_weights, axis.in_output) {
            (Some(_), None, Some(_)) => rows.push(axis),
            (Some(_), Some(_), None) => inputs.push(axis),
            (None, Some(_), Some(_)) => outputs.push(axis),
            _ => return Err("it is not a matrix product with constant weights".to_owned()),
        }
    }
    rows.sort_by_key(|axis| axis.in_x);
    inputs.sort_by_key(|axis| axis.in_x);
    outputs.sort_by_key(|axis| axis.in_output);
    let in_order = |places: Vec<Option<usize>>| places.is_sorted();
    let x_order = rows.iter().chain(&inputs).map(|axis| axis.in_x).collect();
    let output_order = rows.iter().chain(&outputs).map(|axis| axis.in_output).collect();
    if !in_order(x_order) || !in_order(output_order) {
        return Err("it transposes a value".to_owned());
    }
    let numbers = floats(weights)?;
    let strides = strides(weights.shape());
    let output_offsets = offsets(&outputs, &strides);
    let input_offsets = offsets(&inputs, &strides);
    let weights = output_offsets
        .iter()
        .flat_map(|output| input_offsets.iter().map(move |input| numbers[output + input]))
        .collect();
    let rows = rows.iter().map(|axis| axis.dim).product();
    Ok(Product { rows, inputs: input_offsets.len(), outputs: output_offsets.len(), weights })
}

fn long_axes(
    op: &EinSum,
    weights_at: usize,
    weights_shape: &[usize],
    x_shape: &[usize],
) -> Result<Vec<Long>, Refusal> {
    let mut long = Vec::new();
    for axis in op.axes.iter_all_axes() {
        let place = |places: &[usize]| match places {
            [] => Ok(None),
            [place] => Ok(Some(*place)),
            _ => Err("it takes a diagonal".to_owned()),
        };
        let in_x = place(&axis.inputs[1 - weights_at])?;
        let in_weights = place(&axis.inputs[weights_at])?;
        let in_output = place(&axis.outputs[0])?;
        let dim_x = in_x.map_or(1, |place| x_shape[place]);
        let dim_weights = in_weights.map_or(1, |place| weights_shape[place]);
        let dim = dim_x.max(dim_weights);
        if dim == 1 {
            continue;
        }
        if in_x.is_some() && in_weights.is_some() && dim_x != dim_weights {
            return Err("it repeats an operand".to_owned());
        }
        long.push(Long { dim, in_x, in_weights, in_output });
    }
    Ok(long)
}

/// Row-major strides of a shape.
fn strides(shape: &[usize]) -> Vec<usize> {
    let mut strides = vec![1; shape.len()];
    for axis in (1..shape.len()).rev() {
        strides[axis - 1] = strides[axis] * shape[axis];
    }
    strides
}

/// Offsets into the weights of all combinations of the axes, the last running fastest.
fn offsets(axes: &[&Long], strides: &[usize]) -> Vec<usize> {
    axes.iter().fold(vec![0], |offsets, axis| {
        let stride = axis.in_weights.map_or(0, |place| strides[place]);
        offsets.iter().flat_map(|offset| (0..axis.dim).map(move |index| offset + index * stride)).collect()
    })
}
