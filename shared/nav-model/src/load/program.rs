//! A lowered network that owns its weights, between tract's graph and the executor's borrowed description.

use nav_core::network::{Activation, Combine, NetworkError, NetworkSpec, Operand, Reduce, Value};

/// A value, by the instruction that makes it. Slot 0 is the input.
pub(super) type Slot = usize;

/// An operand of an element-wise combination.
#[derive(Clone, Debug)]
pub(super) enum Argument {
    Slot(Slot),
    Constant(Vec<f32>),
}

/// One instruction; number `i` makes slot `i + 1`. Every slot is a matrix `[rows, cols]`.
#[derive(Clone, Debug)]
pub(super) enum Instruction {
    /// Weights row-major `[outputs][inputs]`.
    Linear {
        x: Slot,
        weights: Vec<f32>,
        bias: Option<Vec<f32>>,
        activation: Activation,
    },
    Apply {
        x: Slot,
        activation: Activation,
    },
    Combine {
        kind: Combine,
        a: Argument,
        b: Argument,
    },
    Reduce {
        kind: Reduce,
        x: Slot,
    },
    /// Division by the root mean square of the row.
    RootMeanSquare {
        x: Slot,
        epsilon: f32,
    },
    Columns {
        x: Slot,
        from: usize,
        len: usize,
    },
    Reshape {
        x: Slot,
        rows: usize,
        cols: usize,
    },
    Concat {
        parts: Vec<Slot>,
    },
}

/// Instructions from slot 0 to the output slot.
#[derive(Clone, Debug)]
pub(super) struct Program {
    pub(super) rows: usize,
    pub(super) cols: usize,
    pub(super) instructions: Vec<Instruction>,
    pub(super) output: Slot,
}

impl Program {
    /// The executor's description, borrowing the weights.
    pub(super) fn spec(&self) -> Result<NetworkSpec<'_>, NetworkError> {
        let mut spec = NetworkSpec::new();
        let mut values = vec![spec.input(self.rows, self.cols)?];
        for instruction in &self.instructions {
            let value = emit(&mut spec, instruction, &values)?;
            values.push(value);
        }
        let output = whole(&mut spec, values[self.output])?;
        spec.output(output)?;
        Ok(spec)
    }
}

fn emit<'p>(
    spec: &mut NetworkSpec<'p>,
    instruction: &'p Instruction,
    values: &[Value],
) -> Result<Value, NetworkError> {
    let operand = |argument: &'p Argument| match argument {
        Argument::Slot(slot) => Operand::Value(values[*slot]),
        Argument::Constant(constant) => Operand::Constant(constant),
    };
    match instruction {
        Instruction::Linear { x, weights, bias, activation } => {
            spec.linear(values[*x], weights, bias.as_deref(), *activation)
        }
        Instruction::Apply { x, activation } => spec.apply(values[*x], *activation),
        Instruction::Combine { kind, a, b } => spec.combine(*kind, operand(a), operand(b)),
        Instruction::Reduce { kind, x } => spec.reduce(*kind, values[*x]),
        Instruction::RootMeanSquare { x, epsilon } => spec.normalise(values[*x], *epsilon, false),
        Instruction::Columns { x, from, len } => values[*x].columns(*from, *len),
        Instruction::Reshape { x, rows, cols } => whole(spec, values[*x])?.reshaped(*rows, *cols),
        Instruction::Concat { parts } => {
            let parts: Vec<Value> = parts.iter().map(|slot| values[*slot]).collect();
            spec.concat(&parts)
        }
    }
}

/// The value itself, or a copy when it is a slice of columns with gaps between its rows.
fn whole(spec: &mut NetworkSpec<'_>, value: Value) -> Result<Value, NetworkError> {
    if value.is_contiguous() { Ok(value) } else { spec.apply(value, Activation::Identity) }
}
