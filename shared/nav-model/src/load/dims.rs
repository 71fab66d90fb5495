//! Lowering of what sums, slices, joins and renames dimensions.

use super::lower::{Lowering, Refusal, matrix};
use super::program::{Instruction, Slot};
use nav_core::network::Reduce;
use tract_onnx::prelude::TypedNode;
use tract_onnx::tract_core::ops::array::{Slice, TypedConcat};
use tract_onnx::tract_core::ops::change_axes::AxisOp;
use tract_onnx::tract_core::ops::nn::{Reduce as TractReduce, Reducer, RmsNorm};

impl<'m> Lowering<'m> {
    pub(super) fn reduce(&mut self, node: &'m TypedNode, op: &TractReduce) -> Result<Slot, Refusal> {
        if op.reducer != Reducer::Sum {
            return Err("only sums and means are reduced".to_owned());
        }
        let x = self.computed(node.inputs[0])?;
        let shape = &self.shapes[x];
        let first = op.axes.iter().copied().min().ok_or("it reduces no axis")?;
        let is_trailing = (first..shape.len()).all(|axis| op.axes.contains(&axis) || shape[axis] == 1);
        if !is_trailing {
            return Err("it does not reduce the last dimensions".to_owned());
        }
        let (rows, cols) = (shape[..first].iter().product(), shape[first..].iter().product());
        let x = self.as_matrix(x, rows, cols);
        let slot = self.push(Instruction::Reduce { kind: Reduce::Sum, x }, vec![rows, 1]);
        let (rows, cols) = matrix(&self.concrete_shape(node)?);
        Ok(self.as_matrix(slot, rows, cols))
    }

    pub(super) fn root_mean_square(&mut self, node: &'m TypedNode, op: &RmsNorm) -> Result<Slot, Refusal> {
        let x = self.computed(node.inputs[0])?;
        let shape = self.shapes[x].clone();
        let (rows, cols) = trailing(&shape, op.axis).ok_or("it does not normalise the last dimension")?;
        let epsilon = op.eps.cast_to_scalar::<f32>().map_err(|error| format!("{error:#}"))?;
        let x = self.as_matrix(x, rows, cols);
        let slot = self.push(Instruction::RootMeanSquare { x, epsilon }, vec![rows, cols]);
        let (rows, cols) = matrix(&shape);
        Ok(self.as_matrix(slot, rows, cols))
    }

    pub(super) fn slice(&mut self, node: &'m TypedNode, op: &Slice) -> Result<Slot, Refusal> {
        let x = self.computed(node.inputs[0])?;
        let shape = self.shapes[x].clone();
        let bounds = (op.start.as_i64(), op.end.as_i64());
        let (Some(start), Some(end)) = bounds else { return Err("its bounds are not fixed".to_owned()) };
        let range = usize::try_from(start).ok().zip(usize::try_from(end).ok());
        let (start, end) = range
            .filter(|(start, end)| start < end && *end <= shape[op.axis])
            .ok_or("its bounds are outside")?;
        let inner: usize = shape[op.axis + 1..].iter().product();
        let outer: usize = shape[..op.axis].iter().product();
        if outer != 1 && inner != 1 {
            return Err("it slices neither rows nor columns".to_owned());
        }
        let x = self.as_matrix(x, outer, shape[op.axis] * inner);
        let (from, len) = (start * inner, (end - start) * inner);
        let slot = self.push(Instruction::Columns { x, from, len }, vec![outer, len]);
        let (rows, cols) = matrix(&self.concrete_shape(node)?);
        Ok(self.as_matrix(slot, rows, cols))
    }

    pub(super) fn concat(&mut self, node: &'m TypedNode, op: &TypedConcat) -> Result<Slot, Refusal> {
        let mut parts = Vec::new();
        let mut rows_and_cols = (1, 0);
        for input in &node.inputs {
            let x = self.computed(*input)?;
            let shape = &self.shapes[x];
            let (outer, rest) =
                (shape[..op.axis].iter().product(), shape[op.axis..].iter().product::<usize>());
            parts.push(self.as_matrix(x, outer, rest));
            rows_and_cols = (outer, rows_and_cols.1 + rest);
        }
        let slot = self.push(Instruction::Concat { parts }, vec![rows_and_cols.0, rows_and_cols.1]);
        let (rows, cols) = matrix(&self.concrete_shape(node)?);
        Ok(self.as_matrix(slot, rows, cols))
    }

    /// A change of dimensions that keeps the elements in order.
    pub(super) fn rename(&mut self, node: &'m TypedNode, op: &AxisOp) -> Result<Slot, Refusal> {
        let x = self.computed(node.inputs[0])?;
        if let AxisOp::Move(from, to) = *op {
            // Moving an axis past others keeps the order only if it or all of these have length one.
            let shape = &self.shapes[x];
            let passed = if from < to { from + 1..to + 1 } else { to..from };
            if shape[from] != 1 && shape[passed].iter().any(|dim| *dim != 1) {
                return Err("it transposes a value".to_owned());
            }
        }
        let (rows, cols) = matrix(&self.concrete_shape(node)?);
        Ok(self.as_matrix(x, rows, cols))
    }
}

/// Rows and columns when `axis` is the last dimension that is not one.
fn trailing(shape: &[usize], axis: usize) -> Option<(usize, usize)> {
    let after = shape.get(axis + 1..)?;
    after.iter().all(|dim| *dim == 1).then(|| (shape[..axis].iter().product(), shape[axis]))
}
