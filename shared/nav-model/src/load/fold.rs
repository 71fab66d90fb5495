//! Nodes that join the step before them: biases, activations, and functions that tract spells out.

use super::lower::{Lowering, floats};
use nav_core::network::Activation;
use tract_onnx::prelude::{OutletId, TypedNode};
use tract_onnx::tract_core::ops::binary::TypedBinOp;
use tract_onnx::tract_core::ops::element_wise::ElementWiseOp;
use tract_onnx::tract_core::ops::nn::LeakyRelu;

/// What follows a matrix product directly and can be computed with it.
pub(super) struct Tail {
    /// The last node taken in.
    pub(super) last: usize,
    pub(super) bias: Option<Vec<f32>>,
    pub(super) activation: Activation,
}

/// The bias and activation behind the product `node`; its outputs are the last dimension if `outputs` says how many.
pub(super) fn tail(lowering: &mut Lowering<'_>, node: &TypedNode, outputs: Option<usize>) -> Tail {
    let mut tail = Tail { last: node.id, bias: None, activation: Activation::Identity };
    let Some(outputs) = outputs else { return tail };
    if let Some(next) = only_successor(lowering, tail.last)
        && let Some(bias) = added_constant(lowering, next, outputs)
    {
        tail.bias = Some(bias);
        lowering.fold(next.id);
        tail.last = next.id;
    }
    if let Some(next) = only_successor(lowering, tail.last)
        && let Some(activation) = activation(lowering, next)
    {
        tail.activation = activation;
        lowering.fold(next.id);
        tail.last = next.id;
    }
    tail
}

/// The node as a function of one value: element-wise operators, and `Max` or `Min` with one constant number.
pub(super) fn activation(lowering: &Lowering<'_>, node: &TypedNode) -> Option<Activation> {
    if let Some(op) = node.op_as::<ElementWiseOp>() {
        return match op.0.name().as_str() {
            "Tanh" => Some(Activation::Tanh),
            "Sigmoid" => Some(Activation::Sigmoid),
            "Silu" => Some(Activation::Silu),
            _ => op.0.downcast_ref::<LeakyRelu>().map(|op| Activation::LeakyRelu { slope: op.alpha }),
        };
    }
    let op = node.op_as::<TypedBinOp>()?;
    let limit = uniform_constant(lowering, node)?;
    match op.0.name() {
        "Max" if limit.abs() == 0.0 => Some(Activation::Relu),
        "Max" => Some(Activation::Clip { min: limit, max: f32::INFINITY }),
        "Min" => Some(Activation::Clip { min: f32::NEG_INFINITY, max: limit }),
        _ => None,
    }
}

/// The last node of `ln(exp(x) + 1)`, if `node` is its `exp`.
pub(super) fn softplus(lowering: &mut Lowering<'_>, node: &TypedNode) -> Option<usize> {
    let is =
        |node: &TypedNode, name: &str| node.op_as::<ElementWiseOp>().is_some_and(|op| op.0.name() == name);
    let plus_one = only_successor(lowering, node.id)?;
    let ln = only_successor(lowering, plus_one.id)?;
    let adds_one = plus_one.op_as::<TypedBinOp>()?.0.name() == "Add"
        && uniform_constant(lowering, plus_one).is_some_and(|one| one.to_bits() == 1.0_f32.to_bits());
    if !(is(node, "Exp") && adds_one && is(ln, "Ln")) {
        return None;
    }
    let (plus_one, ln) = (plus_one.id, ln.id);
    lowering.fold(plus_one);
    lowering.fold(ln);
    Some(ln)
}

/// The node that alone reads this one's result, if the result is not the model's output.
fn only_successor<'m>(lowering: &Lowering<'m>, node: usize) -> Option<&'m TypedNode> {
    let model = lowering.model;
    let is_output = model.output_outlets().is_ok_and(|outputs| outputs.contains(&OutletId::new(node, 0)));
    match &*model.node(node).outputs[0].successors {
        [inlet] if !is_output => Some(model.node(inlet.node)),
        _ => None,
    }
}

/// The constant that `node` adds, as one number an output.
fn added_constant(lowering: &Lowering<'_>, node: &TypedNode, outputs: usize) -> Option<Vec<f32>> {
    if node.op_as::<TypedBinOp>()?.0.name() != "Add" {
        return None;
    }
    let tensor = node.inputs.iter().find_map(|input| lowering.constant(*input))?;
    // One row: all its elements lie in the last dimension.
    if tensor.shape().last().copied().unwrap_or(1) != tensor.len() {
        return None;
    }
    let numbers = floats(tensor).ok()?;
    match numbers {
        [one] => Some(vec![*one; outputs]),
        row if row.len() == outputs => Some(row.to_vec()),
        _ => None,
    }
}

/// The number that every element of the node's constant operand has.
fn uniform_constant(lowering: &Lowering<'_>, node: &TypedNode) -> Option<f32> {
    let tensor = node.inputs.iter().find_map(|input| lowering.constant(*input))?;
    let numbers = floats(tensor).ok()?;
    let first = *numbers.first()?;
    numbers.iter().all(|number| number.to_bits() == first.to_bits()).then_some(first)
}
