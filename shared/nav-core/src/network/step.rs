//! What a network does, one step at a time.

use super::{Activation, NetworkError};

/// A matrix `[rows, cols]` inside the network's memory: what a step reads or writes.
///
/// Made by [`NetworkSpec`](super::NetworkSpec). A slice of columns and a reshape are other views of the same numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Value {
    pub(super) start: usize,
    pub(super) rows: usize,
    pub(super) cols: usize,
    /// Floats from one row to the next.
    pub(super) stride: usize,
}

impl Value {
    /// Number of rows.
    pub fn rows(self) -> usize {
        self.rows
    }

    /// Number of columns.
    pub fn cols(self) -> usize {
        self.cols
    }

    /// Whether the rows follow each other without gaps.
    pub fn is_contiguous(self) -> bool {
        self.rows == 1 || self.stride == self.cols
    }

    /// The columns `from..from + len` of every row, without copying.
    ///
    /// # Errors
    /// When the columns are not inside the value or there are none.
    pub fn columns(self, from: usize, len: usize) -> Result<Self, NetworkError> {
        match from.checked_add(len) {
            Some(end) if end <= self.cols && len > 0 => {
                Ok(Self { start: self.start + from, cols: len, ..self })
            }
            _ => Err(NetworkError::Length {
                what: "the slice's end",
                expected: self.cols,
                found: from.saturating_add(len),
            }),
        }
    }

    /// The same numbers in the same order as `[rows, cols]`, without copying.
    ///
    /// # Errors
    /// When the number of elements differs, or the value is a slice of columns over several rows.
    pub fn reshaped(self, rows: usize, cols: usize) -> Result<Self, NetworkError> {
        let (expected, found) = (self.rows * self.cols, rows.saturating_mul(cols));
        if expected != found || !self.is_contiguous() {
            return Err(NetworkError::Length { what: "the reshaped value", expected, found });
        }
        Ok(Self { start: self.start, rows, cols, stride: cols })
    }

    /// The position just after the last element.
    pub(super) fn end(self) -> usize {
        self.start + (self.rows - 1) * self.stride + self.cols
    }

    /// The row `index` of this value; row 0 when it has only one (a row that is repeated).
    pub(super) fn row(self, memory: &[f32], index: usize) -> &[f32] {
        let start = self.start + if self.rows == 1 { 0 } else { index * self.stride };
        &memory[start..start + self.cols]
    }
}

/// An element-wise function of two matrices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Combine {
    /// `a + b`
    Add,
    /// `a - b`
    Sub,
    /// `a * b`
    Mul,
    /// `a / b`
    Div,
    /// The larger; NaN if either is.
    Max,
    /// The smaller; NaN if either is.
    Min,
}

/// A reduction of each row to one number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reduce {
    /// Sum of the row.
    Sum,
    /// Mean of the row.
    Mean,
}

/// An operand as a step stores it: constants by index, so that a refresh keeps the steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Source {
    /// A value computed before.
    Value(Value),
    /// Constant number `index`, one row of `cols`.
    Constant { index: usize, cols: usize },
}

impl Source {
    pub(super) fn cols(self) -> usize {
        match self {
            Self::Value(value) => value.cols,
            Self::Constant { cols, .. } => cols,
        }
    }
}

/// One step. `y` is always a fresh matrix that lies after everything the step reads.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Step {
    /// `y = activation(x * weights^T + bias)`, constant number `index`.
    Linear { x: Value, y: Value, index: usize, activation: Activation },
    /// `y = activation(x)`
    Apply { x: Value, y: Value, activation: Activation },
    /// `y = a (+) b`, rows and columns of length one repeated.
    Combine { kind: Combine, a: Source, b: Source, y: Value },
    /// `y[r, 0] = sum or mean of x[r, ..]`
    Reduce { kind: Reduce, x: Value, y: Value },
    /// `y = (x - mean(x)) / sqrt(variance(x) + epsilon)` a row, without the mean when not `centred`.
    Normalise { x: Value, y: Value, epsilon: f32, centred: bool },
    /// `y = x`; the parts of a concatenation.
    Copy { x: Value, y: Value },
}
