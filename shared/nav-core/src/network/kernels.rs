//! Inner products for each instruction level: the only `unsafe` code of this crate's networks.
//!
//! # Layout
//! A packed matrix of `outputs x inputs` is `[bias, padded to 16 | panels | single rows]`. A panel holds 8, 4, 2 or 1 vector
//! registers' worth of outputs as `[input][outputs of the panel]`: for each input one broadcast is multiplied into all of the
//! panel's outputs, whose sums stay in registers. Eight sums are always in flight: a panel of fewer registers takes several
//! inputs at once. Outputs that do not fill a register are stored as rows, padded with zeros, and taken as dot products.
//! With AVX-512 the widest panel is 128 outputs, with AVX2 64, else 32.
//!
//! # Safety
//! [`linear`] checks every length before it enters a kernel, and [`CpuLevel::is_available`] is checked when a
//! [`Kernels`] is made. The kernels rely on these two facts and nothing else.
#![allow(unsafe_code, reason = "vector instructions; see the safety section")]

mod cpu;
mod panels;
mod lanes;

pub use cpu::CpuLevel;

use super::functions;
use super::{Activation, NetworkError};
#[cfg(target_arch = "x86_64")]
use lanes::{Avx2, Avx512};
use lanes::{Lanes, Portable};

/// Floats that everything in memory is aligned to (64 bytes).
pub(super) const ALIGN_FLOATS: usize = 16;

/// `length` rounded up to whole cache lines.
pub(super) fn aligned(length: usize) -> usize {
    length.next_multiple_of(ALIGN_FLOATS)
}

/// A checked linear job: `rows` rows of `x` times one packed matrix.
pub(super) struct Linear<'a> {
    pub(super) rows: usize,
    pub(super) inputs: usize,
    pub(super) outputs: usize,
    pub(super) x: &'a [f32],
    pub(super) x_stride: usize,
    pub(super) packed: &'a [f32],
    pub(super) y_stride: usize,
}

/// The functions for one instruction level, chosen once.
#[derive(Clone, Copy)]
pub(super) struct Kernels {
    level: CpuLevel,
    linear: unsafe fn(&Linear<'_>, &mut [f32]),
    apply: unsafe fn(Activation, &mut [f32]),
}

impl core::fmt::Debug for Kernels {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_tuple("Kernels").field(&self.level).finish()
    }
}

impl Kernels {
    /// The kernels of `level`, if this processor has its instructions.
    pub(super) fn new(level: CpuLevel) -> Result<Self, NetworkError> {
        if !level.is_available() {
            return Err(NetworkError::Level(level));
        }
        Ok(match level {
            CpuLevel::Portable => Self { level, linear: linear_portable, apply: apply_portable },
            #[cfg(target_arch = "x86_64")]
            CpuLevel::Avx2 => Self { level, linear: linear_avx2, apply: apply_avx2 },
            #[cfg(target_arch = "x86_64")]
            CpuLevel::Avx512 => Self { level, linear: linear_avx512, apply: apply_avx2 },
            #[cfg(not(target_arch = "x86_64"))]
            _ => return Err(NetworkError::Level(level)),
        })
    }

    pub(super) fn level(&self) -> CpuLevel {
        self.level
    }

    /// `y[r] = x[r] * weights^T + bias` for each row.
    ///
    /// # Panics
    /// When a slice is shorter than the job says; the executor's shapes make this impossible.
    pub(super) fn linear(&self, job: &Linear<'_>, y: &mut [f32]) {
        assert!(job.rows > 0 && job.inputs > 0 && job.outputs > 0, "an empty linear step");
        assert!(job.x_stride >= job.inputs && job.y_stride >= job.outputs, "rows overlap");
        assert!(job.x.len() >= (job.rows - 1) * job.x_stride + job.inputs, "the input is too short");
        assert!(y.len() >= (job.rows - 1) * job.y_stride + job.outputs, "the output is too short");
        assert!(
            job.packed.len() >= packed_len(job.outputs, job.inputs, self.level),
            "the packed weights are too short"
        );
        // SAFETY: the lengths were checked above, and the level when `self` was made.
        unsafe { (self.linear)(job, y) }
    }

    /// Applies `activation` to each element.
    pub(super) fn apply(&self, activation: Activation, values: &mut [f32]) {
        // SAFETY: the level was checked when `self` was made; the function itself is safe code.
        unsafe { (self.apply)(activation, values) }
    }
}

unsafe fn linear_portable(job: &Linear<'_>, y: &mut [f32]) {
    // SAFETY: passed on from the caller.
    unsafe { panels::linear::<Portable>(job, y) }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
unsafe fn linear_avx2(job: &Linear<'_>, y: &mut [f32]) {
    // SAFETY: passed on from the caller.
    unsafe { panels::linear::<Avx2>(job, y) }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
unsafe fn linear_avx512(job: &Linear<'_>, y: &mut [f32]) {
    // SAFETY: passed on from the caller.
    unsafe { panels::linear::<Avx512>(job, y) }
}

fn apply_portable(activation: Activation, values: &mut [f32]) {
    functions::apply(activation, values);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn apply_avx2(activation: Activation, values: &mut [f32]) {
    functions::apply(activation, values);
}

/// Floats that a packed matrix takes on `level`.
pub(super) fn packed_len(outputs: usize, inputs: usize, level: CpuLevel) -> usize {
    let lanes = lanes_of(level);
    let single = outputs % lanes;
    aligned(outputs) + (outputs - single) * inputs + single * inputs.next_multiple_of(lanes)
}

fn lanes_of(level: CpuLevel) -> usize {
    match level {
        CpuLevel::Portable => Portable::LANES,
        CpuLevel::Avx2 => 8,
        CpuLevel::Avx512 => 16,
    }
}

/// Writes `weights` (row-major `[outputs][inputs]`) and `bias` (zeros when absent) in the layout of `level`.
///
/// `packed` has [`packed_len`] floats; every one of them is written.
pub(super) fn pack(
    weights: &[f32],
    bias: Option<&[f32]>,
    inputs: usize,
    level: CpuLevel,
    packed: &mut [f32],
) {
    let lanes = lanes_of(level);
    let outputs = weights.len() / inputs;
    let (head, mut rest) = packed.split_at_mut(aligned(outputs));
    head.fill(0.0);
    if let Some(bias) = bias {
        head[..outputs].copy_from_slice(bias);
    }

    let mut rows = weights;
    for registers in panels::REGISTERS {
        let width = registers * lanes;
        while rows.len() / inputs >= width {
            let (panel_rows, rows_after) = rows.split_at(width * inputs);
            let (panel, after) = rest.split_at_mut(width * inputs);
            transpose(panel_rows, inputs, panel);
            (rows, rest) = (rows_after, after);
            if registers < panels::REGISTERS[0] {
                break;
            }
        }
    }
    let padded = inputs.next_multiple_of(lanes);
    for (row, target) in rows.chunks_exact(inputs).zip(rest.chunks_exact_mut(padded)) {
        target[..inputs].copy_from_slice(row);
        target[inputs..].fill(0.0);
    }
}

/// `[rows][inputs]` to `[inputs][rows]`, sixteen rows at a time so that reads and writes stay in whole cache lines.
fn transpose(source: &[f32], inputs: usize, target: &mut [f32]) {
    let rows = source.len() / inputs;
    for (block_index, block) in source.chunks(ALIGN_FLOATS * inputs).enumerate() {
        let first = block_index * ALIGN_FLOATS;
        let block_rows = block.len() / inputs;
        for input in 0..inputs {
            let line = &mut target[input * rows + first..][..block_rows];
            for (row, slot) in line.iter_mut().enumerate() {
                *slot = block[row * inputs + input];
            }
        }
    }
}
