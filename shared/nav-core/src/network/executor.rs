//! A packed network: steps over one slice of memory.

use super::kernels::{self, Kernels, Linear};
use super::spec::Constant;
use super::step::{Source, Step};
use super::{Combine, CpuLevel, MAX_CONSTANTS, MAX_STEPS, NetworkError, NetworkSpec, Reduce, Value};
use heapless::Vec;

/// A network that is ready to run, in memory `S`: a `Vec`, a box, an array or a borrowed slice of `f32`.
///
/// All memory is given when it is packed; [`run`](Self::run) and [`repack`](Self::repack) never allocate.
#[derive(Debug)]
pub struct Network<S> {
    steps: Vec<Step, MAX_STEPS>,
    /// Where each constant starts, in floats after `base`.
    offsets: Vec<usize, MAX_CONSTANTS>,
    kernels: Kernels,
    input: Value,
    output: Value,
    memory: S,
    /// First aligned float of `memory`.
    base: usize,
    constants_len: usize,
    values_len: usize,
}

impl<S: AsRef<[f32]> + AsMut<[f32]>> Network<S> {
    /// Packs `spec` into `memory` (at least [`NetworkSpec::memory_len`] floats) for `level`.
    ///
    /// # Errors
    /// When the spec has no input or output, the memory is too small, or this machine lacks the level.
    pub fn new(spec: &NetworkSpec<'_>, mut memory: S, level: CpuLevel) -> Result<Self, NetworkError> {
        let kernels = Kernels::new(level)?;
        let input = spec.input.ok_or(NetworkError::Input)?;
        let output = spec.output.ok_or(NetworkError::Output)?;
        let (needed, given) = (spec.memory_len(level), memory.as_mut().len());
        if given < needed {
            return Err(NetworkError::Memory { needed, given });
        }
        let mut offsets = Vec::new();
        let mut constants_len = 0;
        for constant in &spec.constants {
            offsets.push(constants_len).map_err(|_| NetworkError::TooManyConstants)?;
            constants_len += constant.packed_len(level);
        }
        // The slack is part of `memory_len`, so that even the worst start fits.
        let base =
            memory.as_mut().as_ptr().align_offset(4 * kernels::ALIGN_FLOATS).min(kernels::ALIGN_FLOATS - 1);
        let steps = spec.steps.clone();
        let values_len = spec.values_len;
        let mut network =
            Self { steps, offsets, kernels, input, output, memory, base, constants_len, values_len };
        network.write_constants(spec);
        network.values_mut().fill(0.0);
        Ok(network)
    }

    /// Replaces all weights by those of `spec`, which must have the same steps and shapes.
    ///
    /// # Errors
    /// When it has not; the network is then unchanged.
    pub fn repack(&mut self, spec: &NetworkSpec<'_>) -> Result<(), NetworkError> {
        let level = self.kernels.level();
        let constants_len: usize = spec.constants.iter().map(|constant| constant.packed_len(level)).sum();
        let same = self.steps == spec.steps
            && Some(self.input) == spec.input
            && Some(self.output) == spec.output
            && self.offsets.len() == spec.constants.len()
            && self.constants_len == constants_len;
        if !same {
            return Err(NetworkError::OtherStructure);
        }
        self.write_constants(spec);
        Ok(())
    }

    /// Runs the network. `input` and `output` are row-major and have [`input_len`](Self::input_len) and
    /// [`output_len`](Self::output_len) elements.
    ///
    /// # Panics
    /// When a length is wrong.
    pub fn run(&mut self, input: &[f32], output: &mut [f32]) {
        assert_eq!(input.len(), self.input_len(), "the network's input length");
        assert_eq!(output.len(), self.output_len(), "the network's output length");
        let from = self.input.start;
        self.values_mut()[from..from + input.len()].copy_from_slice(input);
        self.run_steps();
        let from = self.output.start;
        output.copy_from_slice(&self.values_mut()[from..from + output.len()]);
    }

    /// Elements of the input, rows times columns.
    pub fn input_len(&self) -> usize {
        self.input.rows * self.input.cols
    }

    /// Elements of the output, rows times columns.
    pub fn output_len(&self) -> usize {
        self.output.rows * self.output.cols
    }

    /// Rows and columns of the input.
    pub fn input_shape(&self) -> [usize; 2] {
        [self.input.rows, self.input.cols]
    }

    /// Number of steps a run takes.
    pub fn step_count(&self) -> usize {
        self.steps.len()
    }

    /// Bytes of packed constants that a run reads.
    pub fn constants_bytes(&self) -> usize {
        self.constants_len * size_of::<f32>()
    }

    /// The instruction level it was packed for.
    pub fn level(&self) -> CpuLevel {
        self.kernels.level()
    }

    fn write_constants(&mut self, spec: &NetworkSpec<'_>) {
        let level = self.kernels.level();
        let constants = &mut self.memory.as_mut()[self.base..][..self.constants_len];
        for (constant, &offset) in spec.constants.iter().zip(&self.offsets) {
            let place = &mut constants[offset..];
            match *constant {
                Constant::Vector(values) => place[..values.len()].copy_from_slice(values),
                Constant::Matrix { weights, bias, inputs } => {
                    let len = kernels::packed_len(weights.len() / inputs, inputs, level);
                    kernels::pack(weights, bias, inputs, level, &mut place[..len]);
                }
            }
        }
    }

    fn values_mut(&mut self) -> &mut [f32] {
        &mut self.memory.as_mut()[self.base + self.constants_len..][..self.values_len]
    }

    fn run_steps(&mut self) {
        let (constants, values) = self.memory.as_mut()[self.base..].split_at_mut(self.constants_len);
        for step in &self.steps {
            execute(step, &self.kernels, &self.offsets, constants, values);
        }
    }
}

/// Runs one step. Everything it reads lies before `y`, so that the borrow splits there.
fn execute(step: &Step, kernels: &Kernels, offsets: &[usize], constants: &[f32], values: &mut [f32]) {
    match *step {
        Step::Linear { x, y, index, activation } => {
            let (before, after) = values.split_at_mut(y.start);
            let job = Linear {
                rows: x.rows,
                inputs: x.cols,
                outputs: y.cols,
                x: &before[x.start..x.end()],
                x_stride: x.stride,
                packed: &constants[offsets[index]..],
                y_stride: y.stride,
            };
            let y = &mut after[..y.rows * y.cols];
            kernels.linear(&job, y);
            kernels.apply(activation, y);
        }
        Step::Apply { x, y, activation } => {
            let (before, after) = values.split_at_mut(y.start);
            for row in 0..y.rows {
                after[row * y.stride..][..y.cols].copy_from_slice(x.row(before, row));
            }
            kernels.apply(activation, &mut after[..y.rows * y.cols]);
        }
        Step::Combine { kind, a, b, y } => {
            let (before, after) = values.split_at_mut(y.start);
            for row in 0..y.rows {
                let a = operand(a, row, offsets, constants, before);
                let b = operand(b, row, offsets, constants, before);
                combine(kind, a, b, &mut after[row * y.stride..][..y.cols]);
            }
        }
        Step::Reduce { kind, x, y } => {
            let (before, after) = values.split_at_mut(y.start);
            for (row, slot) in after[..y.rows].iter_mut().enumerate() {
                let x = x.row(before, row);
                *slot = match kind {
                    Reduce::Sum => sum(x, |v| v),
                    Reduce::Mean => mean(x),
                };
            }
        }
        Step::Normalise { x, y, epsilon, centred } => {
            let (before, after) = values.split_at_mut(y.start);
            for row in 0..y.rows {
                normalise(x.row(before, row), epsilon, centred, &mut after[row * y.stride..][..y.cols]);
            }
        }
        Step::Copy { x, y } => {
            let (before, after) = values.split_at_mut(y.start);
            for row in 0..y.rows {
                after[row * y.stride..][..y.cols].copy_from_slice(x.row(before, row));
            }
        }
    }
}

/// One row of an operand.
fn operand<'m>(
    source: Source,
    row: usize,
    offsets: &[usize],
    constants: &'m [f32],
    values: &'m [f32],
) -> &'m [f32] {
    match source {
        Source::Value(value) => value.row(values, row),
        Source::Constant { index, cols } => &constants[offsets[index]..][..cols],
    }
}

fn combine(kind: Combine, a: &[f32], b: &[f32], y: &mut [f32]) {
    match kind {
        Combine::Add => zip(a, b, y, |a, b| a + b),
        Combine::Sub => zip(a, b, y, |a, b| a - b),
        Combine::Mul => zip(a, b, y, |a, b| a * b),
        Combine::Div => zip(a, b, y, |a, b| a / b),
        // Written so that NaN on either side stays NaN.
        Combine::Max => zip(a, b, y, |a, b| if a > b || a.is_nan() { a } else { b }),
        Combine::Min => zip(a, b, y, |a, b| if a < b || a.is_nan() { a } else { b }),
    }
}

#[inline(always)]
fn zip(a: &[f32], b: &[f32], y: &mut [f32], function: impl Fn(f32, f32) -> f32) {
    match (a, b) {
        (&[a], b) if b.len() == y.len() => y.iter_mut().zip(b).for_each(|(y, &b)| *y = function(a, b)),
        (a, &[b]) if a.len() == y.len() => y.iter_mut().zip(a).for_each(|(y, &a)| *y = function(a, b)),
        _ => y.iter_mut().zip(a.iter().zip(b)).for_each(|(y, (&a, &b))| *y = function(a, b)),
    }
}

/// The sum of `term(x)` in eight interleaved partial sums, folded by halves.
fn sum(x: &[f32], term: impl Fn(f32) -> f32) -> f32 {
    let mut lanes = [0.0_f32; 8];
    let mut chunks = x.chunks_exact(8);
    for chunk in &mut chunks {
        for (lane, &value) in lanes.iter_mut().zip(chunk) {
            *lane += term(value);
        }
    }
    for (lane, &value) in lanes.iter_mut().zip(chunks.remainder()) {
        *lane += term(value);
    }
    let [a, b, c, d, e, f, g, h] = lanes;
    ((a + e) + (c + g)) + ((b + f) + (d + h))
}

#[expect(clippy::cast_precision_loss, reason = "a row has at most 65,536 elements")]
fn mean(x: &[f32]) -> f32 {
    sum(x, |v| v) / x.len() as f32
}

#[expect(clippy::cast_precision_loss, reason = "a row has at most 65,536 elements")]
fn normalise(x: &[f32], epsilon: f32, centred: bool, y: &mut [f32]) {
    let centre = if centred { mean(x) } else { 0.0 };
    let mean_square = sum(x, |v| (v - centre) * (v - centre)) / x.len() as f32;
    let factor = 1.0 / libm::sqrtf(mean_square + epsilon);
    for (y, &x) in y.iter_mut().zip(x) {
        *y = (x - centre) * factor;
    }
}
