//! A matrix of `f32` that libtorch multiplies and Rust loops over.

use std::marker::PhantomData;
use tch::{Device, Kind, Tensor};

/// A contiguous row-major `[rows, columns]` matrix on the CPU, owned by libtorch (which aligns it to 64
/// bytes), readable and writable as a slice.
///
/// Other modules read it as the input of a network, through a [`View`] that borrows it. Only within [`crate::nn`] are
/// there tensors that share the memory without borrowing it: those of a network's own parameters, gradients and
/// activations, operands of matrix products that run to their end before any slice of the same buffer is taken again.
///
/// ```compile_fail
/// let mut buffer = trainer::nn::Buffer::zeros(1, 1);
/// let view = buffer.view(1);
/// buffer.as_mut_slice()[0] = 1.0; // What a network reads cannot be written to.
/// assert_eq!(view.rows(), 1);
/// ```
#[derive(Debug)]
pub struct Buffer {
    tensor: Tensor,
    rows: usize,
    columns: usize,
}

/// Rows or columns of a [`Buffer`], to be read by a network.
#[derive(Debug)]
pub struct View<'a> {
    tensor: Tensor,
    buffer: PhantomData<&'a Buffer>,
}

impl View<'_> {
    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.tensor.size()[0] as usize
    }

    pub(super) fn tensor(&self) -> &Tensor {
        &self.tensor
    }
}

impl Buffer {
    /// A matrix of zeros.
    pub fn zeros(rows: usize, columns: usize) -> Self {
        let tensor = Tensor::zeros([rows as i64, columns as i64], (Kind::Float, Device::Cpu));
        Self { tensor, rows, columns }
    }

    /// A matrix of these values, row after row.
    ///
    /// # Panics
    /// When they do not fill whole rows.
    pub fn of(values: &[f32], columns: usize) -> Self {
        assert!(columns > 0 && values.len().is_multiple_of(columns), "values fill whole rows");
        let mut buffer = Self::zeros(values.len() / columns, columns);
        buffer.as_mut_slice().copy_from_slice(values);
        buffer
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Number of columns.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// All values, row after row.
    pub fn as_slice(&self) -> &[f32] {
        // SAFETY: the tensor is contiguous, f32, on the CPU and holds rows * columns values for as long as
        // `self` lives; no tensor that shares them is written to while the slice is borrowed (see the type).
        unsafe { std::slice::from_raw_parts(self.tensor.data_ptr().cast(), self.rows * self.columns) }
    }

    /// All values, row after row.
    pub fn as_mut_slice(&mut self) -> &mut [f32] {
        // SAFETY: as in `as_slice`, and `self` is borrowed exclusively, so that there is no [`View`] either.
        unsafe { std::slice::from_raw_parts_mut(self.tensor.data_ptr().cast(), self.rows * self.columns) }
    }

    /// One row.
    pub fn row(&self, index: usize) -> &[f32] {
        &self.as_slice()[index * self.columns..][..self.columns]
    }

    /// One row.
    pub fn row_mut(&mut self, index: usize) -> &mut [f32] {
        let columns = self.columns;
        &mut self.as_mut_slice()[index * columns..][..columns]
    }

    /// The first `rows` rows.
    pub fn view(&self, rows: usize) -> View<'_> {
        View { tensor: self.tensor(rows), buffer: PhantomData }
    }

    /// `count` columns from `start` of all rows.
    pub fn view_columns(&self, start: usize, count: usize) -> View<'_> {
        View { tensor: self.tensor.narrow(1, start as i64, count as i64), buffer: PhantomData }
    }

    /// The first `rows` rows as a tensor that shares the memory; see the type.
    pub(super) fn tensor(&self, rows: usize) -> Tensor {
        self.tensor.narrow(0, 0, rows as i64)
    }

    /// A `[rows, columns]` tensor that shares the memory of a one-row buffer from position `offset` on; see the type.
    pub(super) fn matrix_at(&self, offset: usize, rows: usize, columns: usize) -> Tensor {
        assert!(offset + rows * columns <= self.rows * self.columns, "the view must lie inside the buffer");
        self.tensor.as_strided(
            [rows as i64, columns as i64],
            [columns as i64, 1],
            Some(offset as i64 + self.tensor.storage_offset()),
        )
    }
}

impl Clone for Buffer {
    fn clone(&self) -> Self {
        Self { tensor: self.tensor.copy(), rows: self.rows, columns: self.columns }
    }
}
