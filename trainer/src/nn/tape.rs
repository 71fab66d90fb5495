//! What a forward pass keeps for the backward pass.

use tch::Tensor;

use super::buffer::Buffer;

/// Activations and gradients of one network, allocated for the largest batch seen so far.
#[derive(Debug)]
pub(super) struct Tape {
    capacity: usize,
    /// Rows of the last forward pass.
    pub(super) rows: usize,
    pub(super) layers: Vec<TapeLayer>,
    /// Derivative by the input.
    pub(super) input_gradient: Buffer,
}

/// The part of one layer.
#[derive(Debug)]
pub(super) struct TapeLayer {
    /// What the layer gave, after its activation.
    pub(super) activation: Buffer,
    /// Derivative of the loss by `activation`, turned in place into that by the matrix product.
    pub(super) gradient: Buffer,
    /// Normalised rows and their inverse deviations, of a layer with normalisation.
    pub(super) normal: Option<(Buffer, Vec<f32>)>,
    /// Views of the first `rows` rows.
    pub(super) activation_view: Tensor,
    pub(super) gradient_view: Tensor,
    pub(super) gradient_view_transposed: Tensor,
}

impl Tape {
    /// An empty tape; `layers` yields width and whether the layer is normalised.
    pub(super) fn new(inputs: usize, layers: impl Iterator<Item = (usize, bool)>) -> Self {
        let layers = layers.map(|(width, normalised)| TapeLayer::new(0, width, normalised)).collect();
        Self { capacity: 0, rows: 0, layers, input_gradient: Buffer::zeros(0, inputs) }
    }

    /// Makes room for `rows` rows and points the views at them.
    pub(super) fn resize(&mut self, rows: usize) {
        if rows > self.capacity {
            self.capacity = rows;
            for layer in &mut self.layers {
                *layer = TapeLayer::new(rows, layer.activation.columns(), layer.normal.is_some());
            }
            self.input_gradient = Buffer::zeros(rows, self.input_gradient.columns());
        } else if rows != self.rows {
            for layer in &mut self.layers {
                layer.look_at(rows);
            }
        }
        self.rows = rows;
    }
}

impl TapeLayer {
    fn new(rows: usize, width: usize, normalised: bool) -> Self {
        let activation = Buffer::zeros(rows, width);
        let gradient = Buffer::zeros(rows, width);
        let gradient_view = gradient.tensor(rows);
        Self {
            activation_view: activation.tensor(rows),
            gradient_view_transposed: gradient_view.tr(),
            gradient_view,
            normal: normalised.then(|| (Buffer::zeros(rows, width), vec![0.0; rows])),
            activation,
            gradient,
        }
    }

    fn look_at(&mut self, rows: usize) {
        self.activation_view = self.activation.tensor(rows);
        self.gradient_view = self.gradient.tensor(rows);
        self.gradient_view_transposed = self.gradient_view.tr();
    }
}
