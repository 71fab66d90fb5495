//! tract's decluttered graph to the executor's instructions.
//!
//! Every tensor is read as a matrix: its last dimension is the columns, all before it are the rows. Dimensions of one, which
//! tract adds and drops freely, then only rename a value.

use super::fold::{self, Tail};
use super::program::{Argument, Instruction, Program, Slot};
use super::{LoadError, NetworkContract, einsum};
use nav_core::network::{Activation, Combine};
use std::collections::{HashMap, HashSet};
use tract_onnx::prelude::{Datum, DatumType, OutletId, Tensor, TypedModel, TypedNode};
use tract_onnx::tract_core::ops::array::{Slice, TypedConcat};
use tract_onnx::tract_core::ops::binary::TypedBinOp;
use tract_onnx::tract_core::ops::change_axes::AxisOp;
use tract_onnx::tract_core::ops::einsum::EinSum;
use tract_onnx::tract_core::ops::element_wise::ElementWiseOp;
use tract_onnx::tract_core::ops::identity::Identity;
use tract_onnx::tract_core::ops::konst::Const;
use tract_onnx::tract_core::ops::nn::{Reduce, RmsNorm};
use tract_onnx::tract_core::ops::source::TypedSource;

/// The most elements of any value.
const MAX_VALUE_ELEMENTS: usize = 1 << 20;

/// Why one node cannot be lowered.
pub(super) type Refusal = String;

/// Lowers the whole graph.
pub(super) fn lower(model: &TypedModel, contract: &NetworkContract) -> Result<Program, LoadError> {
    let &[output] = model.output_outlets().unwrap_or_default() else {
        return Err(LoadError::Interface { problem: "the typed graph has not one output".to_owned() });
    };
    let order = model.eval_order().map_err(|error| LoadError::Tract { problem: format!("{error:#}") })?;
    let mut lowering = Lowering {
        model,
        instructions: Vec::new(),
        shapes: vec![vec![contract.input.rows, contract.input.cols]],
        slots: HashMap::new(),
        folded: HashSet::new(),
    };
    for id in order {
        let node = model.node(id);
        lowering.node(node).map_err(|problem| LoadError::Lowering {
            node: node.name.clone(),
            operator: node.op.name().into_owned(),
            problem,
        })?;
    }
    let slot = lowering.slots.get(&output).copied();
    let slot = slot.filter(|slot| lowering.shapes[*slot] == [contract.output.rows, contract.output.cols]);
    let Some(output) = slot else {
        let found = model.outlet_fact(output).map(|fact| format!("{:?}", fact.shape)).unwrap_or_default();
        let problem = format!("the model's output has shape [{found}], expected {}", contract.output);
        return Err(LoadError::Interface { problem });
    };
    let (rows, cols) = (contract.input.rows, contract.input.cols);
    Ok(Program { rows, cols, instructions: lowering.instructions, output })
}

/// What has been lowered so far.
pub(super) struct Lowering<'m> {
    pub(super) model: &'m TypedModel,
    instructions: Vec<Instruction>,
    /// The full shape of each slot.
    pub(super) shapes: Vec<Vec<usize>>,
    slots: HashMap<OutletId, Slot>,
    /// Nodes that were taken into an earlier instruction.
    folded: HashSet<usize>,
}

impl<'m> Lowering<'m> {
    fn node(&mut self, node: &'m TypedNode) -> Result<(), Refusal> {
        if self.folded.contains(&node.id) || node.op_is::<Const>() {
            return Ok(());
        }
        let shape = self.concrete_shape(node)?;
        let slot = if node.op_is::<TypedSource>() {
            0
        } else if let Some(op) = node.op_as::<EinSum>() {
            return self.linear(node, op);
        } else if let Some(op) = node.op_as::<TypedBinOp>() {
            self.binary(node, op, &shape)?
        } else if let Some(op) = node.op_as::<ElementWiseOp>() {
            return self.element_wise(node, op);
        } else if let Some(op) = node.op_as::<Reduce>() {
            self.reduce(node, op)?
        } else if let Some(op) = node.op_as::<RmsNorm>() {
            self.root_mean_square(node, op)?
        } else if let Some(op) = node.op_as::<Slice>() {
            self.slice(node, op)?
        } else if let Some(op) = node.op_as::<TypedConcat>() {
            self.concat(node, op)?
        } else if let Some(op) = node.op_as::<AxisOp>() {
            self.rename(node, op)?
        } else if node.op_is::<Identity>() {
            self.computed(node.inputs[0])?
        } else {
            return Err("the executor has no such step".to_owned());
        };
        self.bind(OutletId::new(node.id, 0), slot, shape);
        Ok(())
    }

    /// The node's output shape, if it is one bounded tensor of floats.
    pub(super) fn concrete_shape(&self, node: &TypedNode) -> Result<Vec<usize>, Refusal> {
        let [output] = &*node.outputs else {
            return Err(format!("it has {} outputs", node.outputs.len()));
        };
        if output.fact.datum_type != f32::datum_type() {
            return Err(format!("it computes {:?} instead of 32-bit floats", output.fact.datum_type));
        }
        let shape = output.fact.shape.as_concrete().ok_or("its shape is not fixed")?;
        let elements = shape.iter().try_fold(1_usize, |product, &dim| product.checked_mul(dim));
        match elements {
            Some(1..=MAX_VALUE_ELEMENTS) => Ok(shape.to_vec()),
            _ => Err(format!("its shape {shape:?} is out of bounds")),
        }
    }

    /// A matrix product with constant weights, with the bias and activation that follow it.
    fn linear(&mut self, node: &'m TypedNode, op: &EinSum) -> Result<(), Refusal> {
        let constants =
            [self.constant(node.inputs[0]), self.constant(*node.inputs.get(1).ok_or("it has one input")?)];
        let (weights_at, weights) = match constants {
            [Some(weights), None] => (0, weights),
            [None, Some(weights)] => (1, weights),
            _ => return Err("exactly one factor must be constant".to_owned()),
        };
        let x = self.computed(node.inputs[1 - weights_at])?;
        let product = einsum::product(op, weights_at, weights, &self.shapes[x])?;
        let x = self.as_matrix(x, product.rows, product.inputs);
        let whole = matrix(&self.concrete_shape(node)?) == (product.rows, product.outputs);
        let Tail { last, bias, activation } = fold::tail(self, node, whole.then_some(product.outputs));
        let shape = self.concrete_shape(self.model.node(last))?;
        let y = self.push(
            Instruction::Linear { x, weights: product.weights, bias, activation },
            vec![product.rows, product.outputs],
        );
        let (rows, cols) = matrix(&shape);
        let y = self.as_matrix(y, rows, cols);
        self.bind(OutletId::new(last, 0), y, shape);
        Ok(())
    }

    fn element_wise(&mut self, node: &'m TypedNode, op: &ElementWiseOp) -> Result<(), Refusal> {
        let x = self.computed(node.inputs[0])?;
        let shape = self.shapes[x].clone();
        if op.0.name() == "Square" {
            let (a, b) = (Argument::Slot(x), Argument::Slot(x));
            let slot = self.push(Instruction::Combine { kind: Combine::Mul, a, b }, shape.clone());
            self.bind(OutletId::new(node.id, 0), slot, shape);
            return Ok(());
        }
        let (last, activation) = match fold::activation(self, node) {
            Some(activation) => (node.id, activation),
            None => {
                (fold::softplus(self, node).ok_or("the executor has no such function")?, Activation::Softplus)
            }
        };
        let slot = self.push(Instruction::Apply { x, activation }, shape.clone());
        self.bind(OutletId::new(last, 0), slot, shape);
        Ok(())
    }

    fn binary(&mut self, node: &'m TypedNode, op: &TypedBinOp, shape: &[usize]) -> Result<Slot, Refusal> {
        let kind = match op.0.name() {
            "Add" => Combine::Add,
            "Sub" => Combine::Sub,
            "Mul" => Combine::Mul,
            "Div" => Combine::Div,
            "Max" => Combine::Max,
            "Min" => Combine::Min,
            _ => return Err("the executor has no such combination".to_owned()),
        };
        if let Some(activation) = fold::activation(self, node) {
            let x = self.computed_of(node)?;
            return Ok(self.push(Instruction::Apply { x, activation }, shape.to_vec()));
        }
        let elements: usize = shape.iter().product();
        // Equal shapes combine as one long row, whatever their dimensions mean.
        let input_shapes: Vec<_> =
            node.inputs.iter().map(|input| self.shape_of(*input)).collect::<Result<_, _>>()?;
        let flat = input_shapes.iter().all(|found| *found == shape);
        let to = |found: &[usize]| if flat { (1, elements) } else { matrix(found) };
        let mut arguments = Vec::new();
        let mut sizes = Vec::new();
        for (input, found) in node.inputs.iter().zip(&input_shapes) {
            let (rows, cols) = to(found);
            sizes.push((rows, cols));
            arguments.push(match self.constant(*input) {
                Some(constant) => Argument::Constant(one_row(constant, rows)?),
                None => {
                    let slot = self.computed(*input)?;
                    Argument::Slot(self.as_matrix(slot, rows, cols))
                }
            });
        }
        let [a, b]: [Argument; 2] = arguments.try_into().map_err(|_| "it has not two inputs")?;
        if matches!((&a, &b), (Argument::Constant(_), Argument::Constant(_))) {
            return Err("both operands are constant".to_owned());
        }
        let (rows, cols) = to(shape);
        let fits = |(r, c): (usize, usize)| (r == 1 || r == rows) && (c == 1 || c == cols);
        let is_full = sizes.iter().any(|size| size.0 == rows) && sizes.iter().any(|size| size.1 == cols);
        if !(is_full && sizes.iter().copied().all(fits)) {
            return Err(format!(
                "operands of shapes {input_shapes:?} are repeated in a way the executor cannot"
            ));
        }
        let slot = self.push(Instruction::Combine { kind, a, b }, vec![rows, cols]);
        let (rows, cols) = matrix(shape);
        Ok(self.as_matrix(slot, rows, cols))
    }

    pub(super) fn push(&mut self, instruction: Instruction, shape: Vec<usize>) -> Slot {
        self.instructions.push(instruction);
        self.shapes.push(shape);
        self.instructions.len()
    }

    /// Names `slot` as the outlet's value, with its full shape.
    fn bind(&mut self, outlet: OutletId, slot: Slot, shape: Vec<usize>) {
        let slot = if self.shapes[slot] == shape {
            slot
        } else {
            // The same matrix under another shape: a slot of its own, so that shapes stay facts of slots.
            let (rows, cols) = matrix(&shape);
            self.push(Instruction::Reshape { x: slot, rows, cols }, shape)
        };
        self.slots.insert(outlet, slot);
    }

    /// The slot's elements as `[rows, cols]`.
    pub(super) fn as_matrix(&mut self, x: Slot, rows: usize, cols: usize) -> Slot {
        if matrix(&self.shapes[x]) == (rows, cols) {
            return x;
        }
        self.push(Instruction::Reshape { x, rows, cols }, vec![rows, cols])
    }

    /// The slot of a value that depends on the input.
    pub(super) fn computed(&self, outlet: OutletId) -> Result<Slot, Refusal> {
        self.slots
            .get(&outlet)
            .copied()
            .ok_or_else(|| "it needs a computed operand, not a constant".to_owned())
    }

    /// The slot of the only computed operand.
    fn computed_of(&self, node: &TypedNode) -> Result<Slot, Refusal> {
        node.inputs
            .iter()
            .find_map(|input| self.slots.get(input).copied())
            .ok_or_else(|| "it has no computed operand".to_owned())
    }

    fn shape_of(&self, outlet: OutletId) -> Result<Vec<usize>, Refusal> {
        let fact = self.model.outlet_fact(outlet).map_err(|error| format!("{error:#}"))?;
        fact.shape
            .as_concrete()
            .map(<[usize]>::to_vec)
            .ok_or_else(|| "an operand's shape is not fixed".to_owned())
    }

    /// The tensor behind a constant outlet.
    pub(super) fn constant(&self, outlet: OutletId) -> Option<&'m Tensor> {
        self.model.node(outlet.node).op_as::<Const>().map(|op| &**op.val())
    }

    /// Takes `node` into the instruction of an earlier one.
    pub(super) fn fold(&mut self, node: usize) {
        self.folded.insert(node);
    }
}

/// Rows and columns of a shape: the last dimension and all before it.
pub(super) fn matrix(shape: &[usize]) -> (usize, usize) {
    match shape {
        [] => (1, 1),
        [rows @ .., cols] => (rows.iter().product(), *cols),
    }
}

/// A constant of one row, or one number for all.
fn one_row(tensor: &Tensor, rows: usize) -> Result<Vec<f32>, Refusal> {
    let numbers = floats(tensor)?;
    match numbers.first() {
        Some(first) if numbers.iter().all(|number| number.to_bits() == first.to_bits()) => Ok(vec![*first]),
        Some(_) if rows == 1 => Ok(numbers.to_vec()),
        _ => Err("a constant operand differs from row to row".to_owned()),
    }
}

/// The numbers of a constant of 32-bit floats.
pub(super) fn floats(tensor: &Tensor) -> Result<&[f32], Refusal> {
    if tensor.datum_type() != DatumType::F32 {
        return Err(format!("a constant operand is of {:?}", tensor.datum_type()));
    }
    let view = tensor.try_as_plain_ram().map_err(|error| format!("{error:#}"))?;
    view.as_slice::<f32>().map_err(|error| format!("{error:#}"))
}
