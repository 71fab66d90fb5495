//! What a model must look like from outside.

use std::fmt;

/// A tensor that a network takes or gives: a name and a matrix shape.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Port {
    /// Name in the ONNX graph.
    pub name: String,
    /// Rows, one for an actor, one a candidate for a scorer.
    pub rows: usize,
    /// Columns.
    pub cols: usize,
}

impl Port {
    /// A tensor of `f32` called `name` with shape `[rows, cols]`.
    pub fn new(name: impl Into<String>, rows: usize, cols: usize) -> Self {
        Self { name: name.into(), rows, cols }
    }

    /// Number of elements.
    pub fn elements(&self) -> usize {
        self.rows * self.cols
    }
}

impl fmt::Display for Port {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "`{}` [{}, {}]", self.name, self.rows, self.cols)
    }
}

/// The one input and the one output that a model must have, by exact name and shape.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NetworkContract {
    /// What the controller feeds.
    pub input: Port,
    /// What the controller reads.
    pub output: Port,
}

impl NetworkContract {
    /// A network from `input` to `output`.
    pub fn new(input: Port, output: Port) -> Self {
        Self { input, output }
    }
}
