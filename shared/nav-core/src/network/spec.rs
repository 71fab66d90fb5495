//! The description of a network: steps, shapes and borrowed weights, independent of the machine.

use super::step::{Source, Step};
use super::{
    Activation, Combine, CpuLevel, MAX_CONSTANTS, MAX_MEMORY_FLOATS, MAX_SIDE, MAX_STEPS, NetworkError,
    Reduce, Value, kernels,
};
use heapless::Vec;

/// An operand of [`NetworkSpec::combine`].
#[derive(Clone, Copy, Debug)]
pub enum Operand<'w> {
    /// A value of the same spec.
    Value(Value),
    /// One row of constants: one number, or one a column.
    Constant(&'w [f32]),
}

impl From<Value> for Operand<'_> {
    fn from(value: Value) -> Self {
        Self::Value(value)
    }
}

impl<'w> From<&'w [f32]> for Operand<'w> {
    fn from(constants: &'w [f32]) -> Self {
        Self::Constant(constants)
    }
}

/// Borrowed numbers that packing copies into the network's memory.
#[derive(Clone, Copy, Debug)]
pub(super) enum Constant<'w> {
    Vector(&'w [f32]),
    /// Row-major `[outputs][inputs]`.
    Matrix {
        weights: &'w [f32],
        bias: Option<&'w [f32]>,
        inputs: usize,
    },
}

impl Constant<'_> {
    /// Floats this takes once packed, whole cache lines.
    pub(super) fn packed_len(&self, level: CpuLevel) -> usize {
        kernels::aligned(match self {
            Self::Vector(values) => values.len(),
            Self::Matrix { weights, inputs, .. } => {
                kernels::packed_len(weights.len() / inputs, *inputs, level)
            }
        })
    }
}

/// A network as a list of steps. Call [`input`](Self::input) first and [`output`](Self::output) last.
///
/// Every method that makes a value checks the shapes, so that a spec that was built can be packed and run.
#[derive(Clone, Debug, Default)]
pub struct NetworkSpec<'w> {
    pub(super) steps: Vec<Step, MAX_STEPS>,
    pub(super) constants: Vec<Constant<'w>, MAX_CONSTANTS>,
    pub(super) input: Option<Value>,
    pub(super) output: Option<Value>,
    /// Floats of all values so far.
    pub(super) values_len: usize,
    /// Upper bound of the floats of all constants so far.
    constants_len: usize,
}

impl<'w> NetworkSpec<'w> {
    /// An empty description.
    pub fn new() -> Self {
        Self::default()
    }

    /// The network's only input, `[rows, cols]`.
    ///
    /// # Errors
    /// When there is one already, or a side is out of bounds.
    pub fn input(&mut self, rows: usize, cols: usize) -> Result<Value, NetworkError> {
        if self.input.is_some() {
            return Err(NetworkError::Input);
        }
        let value = self.fresh(rows, cols)?;
        self.input = Some(value);
        Ok(value)
    }

    /// Names the result, which must be contiguous.
    ///
    /// # Errors
    /// When there is no input, the value is not of this spec, or has gaps between its rows.
    pub fn output(&mut self, value: Value) -> Result<(), NetworkError> {
        self.check(value)?;
        if self.input.is_none() {
            return Err(NetworkError::Input);
        }
        if !value.is_contiguous() || self.output.is_some() {
            return Err(NetworkError::Output);
        }
        self.output = Some(value);
        Ok(())
    }

    /// `activation(x * weights^T + bias)`: `weights` is row-major `[outputs][inputs]`, as PyTorch's `Linear.weight` and
    /// ONNX `Gemm` with `transB = 1` store it.
    ///
    /// # Errors
    /// When a length does not fit `x`.
    pub fn linear(
        &mut self,
        x: Value,
        weights: &'w [f32],
        bias: Option<&'w [f32]>,
        activation: Activation,
    ) -> Result<Value, NetworkError> {
        self.check(x)?;
        let outputs = weights.len() / x.cols;
        same_length("a weight matrix", outputs.max(1) * x.cols, weights.len())?;
        if let Some(bias) = bias {
            same_length("a bias", outputs, bias.len())?;
        }
        let index = self.constant(Constant::Matrix { weights, bias, inputs: x.cols })?;
        let y = self.fresh(x.rows, outputs)?;
        self.push(Step::Linear { x, y, index, activation }, y)
    }

    /// `activation(x)`, element by element.
    ///
    /// # Errors
    /// When the spec is full.
    pub fn apply(&mut self, x: Value, activation: Activation) -> Result<Value, NetworkError> {
        self.check(x)?;
        let y = self.fresh(x.rows, x.cols)?;
        self.push(Step::Apply { x, y, activation }, y)
    }

    /// `a (+) b`, element by element. Rows and columns of length one are repeated.
    ///
    /// # Errors
    /// When the shapes do not fit.
    pub fn combine(
        &mut self,
        kind: Combine,
        a: impl Into<Operand<'w>>,
        b: impl Into<Operand<'w>>,
    ) -> Result<Value, NetworkError> {
        let (a, a_rows) = self.source(a.into())?;
        let (b, b_rows) = self.source(b.into())?;
        let rows = broadcast("the rows of an operand", a_rows, b_rows)?;
        let cols = broadcast("the columns of an operand", a.cols(), b.cols())?;
        let y = self.fresh(rows, cols)?;
        self.push(Step::Combine { kind, a, b, y }, y)
    }

    /// The sum or mean of each row: `[rows, 1]`.
    ///
    /// # Errors
    /// When the spec is full.
    pub fn reduce(&mut self, kind: Reduce, x: Value) -> Result<Value, NetworkError> {
        self.check(x)?;
        let y = self.fresh(x.rows, 1)?;
        self.push(Step::Reduce { kind, x, y }, y)
    }

    /// Each row divided by its root mean square, `x / sqrt(mean(x^2) + epsilon)`, after its mean is taken away if `centred`.
    ///
    /// # Errors
    /// When the spec is full.
    pub fn normalise(&mut self, x: Value, epsilon: f32, centred: bool) -> Result<Value, NetworkError> {
        self.check(x)?;
        let y = self.fresh(x.rows, x.cols)?;
        self.push(Step::Normalise { x, y, epsilon, centred }, y)
    }

    /// Layer normalisation over each row, times `gain`, plus `bias`, both one number a column.
    ///
    /// # Errors
    /// When a length does not fit `x`.
    pub fn layer_norm(
        &mut self,
        x: Value,
        gain: &'w [f32],
        bias: &'w [f32],
        epsilon: f32,
    ) -> Result<Value, NetworkError> {
        same_length("a layer norm's gain", x.cols, gain.len())?;
        same_length("a layer norm's bias", x.cols, bias.len())?;
        let normal = self.normalise(x, epsilon, true)?;
        let scaled = self.combine(Combine::Mul, normal, gain)?;
        self.combine(Combine::Add, scaled, bias)
    }

    /// The parts side by side, all with the same number of rows.
    ///
    /// # Errors
    /// When the rows differ or there are no parts.
    pub fn concat(&mut self, parts: &[Value]) -> Result<Value, NetworkError> {
        let rows = parts.first().ok_or(NetworkError::Side { length: 0 })?.rows;
        for part in parts {
            self.check(*part)?;
            same_length("the rows of a concatenation", rows, part.rows)?;
        }
        let whole = self.fresh(rows, parts.iter().map(|part| part.cols).sum())?;
        let mut from = 0;
        for &x in parts {
            let y = whole.columns(from, x.cols)?;
            from += x.cols;
            self.push(Step::Copy { x, y }, y)?;
        }
        Ok(whole)
    }

    /// Floats of memory that packing for `level` needs, with room to align.
    pub fn memory_len(&self, level: CpuLevel) -> usize {
        let constants: usize = self.constants.iter().map(|constant| constant.packed_len(level)).sum();
        kernels::ALIGN_FLOATS - 1 + constants + self.values_len
    }

    /// A matrix that nothing else uses.
    fn fresh(&mut self, rows: usize, cols: usize) -> Result<Value, NetworkError> {
        for length in [rows, cols] {
            if length == 0 || length > MAX_SIDE {
                return Err(NetworkError::Side { length });
            }
        }
        let value = Value { start: self.values_len, rows, cols, stride: cols };
        self.values_len += kernels::aligned(rows * cols);
        self.check_size()?;
        Ok(value)
    }

    fn constant(&mut self, constant: Constant<'w>) -> Result<usize, NetworkError> {
        let longest =
            [CpuLevel::Portable, CpuLevel::Avx2, CpuLevel::Avx512].map(|level| constant.packed_len(level));
        self.constants_len += longest.into_iter().max().unwrap_or(0);
        self.check_size()?;
        self.constants.push(constant).map_err(|_| NetworkError::TooManyConstants)?;
        Ok(self.constants.len() - 1)
    }

    fn check_size(&self) -> Result<(), NetworkError> {
        if self.values_len + self.constants_len > MAX_MEMORY_FLOATS {
            return Err(NetworkError::TooLarge);
        }
        Ok(())
    }

    /// The operand as a step stores it, and its rows.
    fn source(&mut self, operand: Operand<'w>) -> Result<(Source, usize), NetworkError> {
        match operand {
            Operand::Value(value) => {
                self.check(value)?;
                Ok((Source::Value(value), value.rows))
            }
            Operand::Constant(values) => {
                let cols = values.len();
                if cols == 0 || cols > MAX_SIDE {
                    return Err(NetworkError::Side { length: cols });
                }
                Ok((Source::Constant { index: self.constant(Constant::Vector(values))?, cols }, 1))
            }
        }
    }

    fn push(&mut self, step: Step, y: Value) -> Result<Value, NetworkError> {
        self.steps.push(step).map_err(|_| NetworkError::TooManySteps)?;
        Ok(y)
    }

    fn check(&self, value: Value) -> Result<(), NetworkError> {
        if value.end() > self.values_len {
            return Err(NetworkError::ForeignValue);
        }
        Ok(())
    }
}

fn same_length(what: &'static str, expected: usize, found: usize) -> Result<(), NetworkError> {
    if expected == found { Ok(()) } else { Err(NetworkError::Length { what, expected, found }) }
}

fn broadcast(what: &'static str, a: usize, b: usize) -> Result<usize, NetworkError> {
    match (a, b) {
        (1, n) | (n, 1) => Ok(n),
        _ => same_length(what, a, b).map(|()| a),
    }
}
