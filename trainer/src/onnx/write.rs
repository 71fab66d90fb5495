//! A perceptron as an ONNX graph.

use nav_model::load::NetworkContract;
use prost::Message;

use super::schema::{
    Attribute, FLOAT, Graph, IR_VERSION, Model, Node, OPERATOR_SET, OperatorSet, Property, Tensor, ValueInfo,
};
use crate::nn::layer_norm::EPSILON;
use crate::nn::{Activation, Mlp};

/// Why a network was not written.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// The network is not the one the contract describes.
    #[error(
        "the network maps {inputs} numbers to {outputs}, the contract is {contract}: export it as what it is"
    )]
    Shape {
        /// Width of the network's input.
        inputs: usize,
        /// Width of its output.
        outputs: usize,
        /// Input and output as they should be.
        contract: String,
    },
    /// The normalisation has another width than the input, or would divide by zero.
    #[error(
        "the normalisation does not fit the network's {inputs} inputs: it needs a finite number for each"
    )]
    Normalisation {
        /// Width of the network's input.
        inputs: usize,
    },
    /// A weight is NaN or infinite.
    #[error(
        "the network holds a weight that is not finite: its training diverged, export another checkpoint"
    )]
    NotFinite,
}

/// What happens to an observation before the first layer: `(x - mean) * inverse_deviation`, each `[inputs]`.
#[derive(Debug, Clone, Copy)]
pub struct Normalisation<'a> {
    /// Taken away first.
    pub mean: &'a [f32],
    /// Factor after that.
    pub inverse_deviation: &'a [f32],
}

/// Writes `mlp` as an ONNX model with the names and the row count of `contract`.
///
/// The graph is `Sub`, `Mul` (with a normalisation), then `Gemm` with `transB = 1`, `LayerNormalization` (where
/// the network has it) and `Relu` for each hidden layer, `Gemm` and perhaps `Tanh` for the last: operator set 17.
/// `properties` go into `metadata_props`. The same network gives the same bytes.
///
/// # Errors
/// When network, contract and normalisation do not belong together, or a number is not finite.
pub fn write_mlp(
    mlp: &Mlp,
    contract: &NetworkContract,
    normalisation: Option<Normalisation<'_>>,
    properties: &[(&str, &str)],
) -> Result<Vec<u8>, WriteError> {
    let (inputs, outputs) = (mlp.shape().sizes[0], mlp.outputs());
    let NetworkContract { input, output } = contract;
    if (input.cols, output.cols) != (inputs, outputs) || input.rows != output.rows {
        let contract = format!("{input} to {output}");
        return Err(WriteError::Shape { inputs, outputs, contract });
    }
    if !mlp.parameters().iter().all(|value| value.is_finite()) {
        return Err(WriteError::NotFinite);
    }
    let mut graph = Builder::new(&input.name);
    if let Some(Normalisation { mean, inverse_deviation }) = normalisation {
        let fits = |values: &[f32]| values.len() == inputs && values.iter().all(|value| value.is_finite());
        if !fits(mean) || !fits(inverse_deviation) {
            return Err(WriteError::Normalisation { inputs });
        }
        let row = [inputs];
        let mean = graph.constant("normalisation.mean", &row, mean);
        let factor = graph.constant("normalisation.inverse_deviation", &row, inverse_deviation);
        graph.node("Sub", "normalisation.centred", &[mean], vec![]);
        graph.node("Mul", "normalisation.scaled", &[factor], vec![]);
    }
    let last = mlp.shape().sizes.len() - 2;
    for (index, layer) in mlp.layers().enumerate() {
        let name = |what| format!("layer{index}.{what}");
        let weight = graph.constant(&name("weight"), &[layer.outputs, layer.inputs], layer.weight);
        let bias = graph.constant(&name("bias"), &[layer.outputs], layer.bias);
        graph.node("Gemm", &name("linear"), &[weight, bias], vec![Attribute::of_int("transB", 1)]);
        if let Some((scale, shift)) = layer.norm {
            let scale = graph.constant(&name("scale"), &[layer.outputs], scale);
            let shift = graph.constant(&name("shift"), &[layer.outputs], shift);
            let attributes = vec![Attribute::of_int("axis", -1), Attribute::of_float("epsilon", EPSILON)];
            graph.node("LayerNormalization", &name("norm"), &[scale, shift], attributes);
        }
        if index < last {
            graph.node("Relu", &name("relu"), &[], vec![]);
        } else if mlp.shape().output == Activation::Tanh {
            graph.node("Tanh", &name("tanh"), &[], vec![]);
        }
    }
    Ok(graph.finish(contract, properties).encode_to_vec())
}

/// A chain of nodes: each takes the result of the one before as its first input.
struct Builder {
    nodes: Vec<Node>,
    constants: Vec<Tensor>,
    value: String,
}

impl Builder {
    fn new(input: &str) -> Self {
        Self { nodes: Vec::new(), constants: Vec::new(), value: input.to_owned() }
    }

    fn constant(&mut self, name: &str, dims: &[usize], values: &[f32]) -> String {
        self.constants.push(Tensor {
            dims: dims.iter().map(|&length| length as i64).collect(),
            data_type: FLOAT,
            name: name.to_owned(),
            raw_data: values.iter().flat_map(|value| value.to_le_bytes()).collect(),
        });
        name.to_owned()
    }

    fn node(&mut self, op_type: &str, name: &str, constants: &[String], attribute: Vec<Attribute>) {
        let previous = std::mem::replace(&mut self.value, name.to_owned());
        self.nodes.push(Node {
            input: std::iter::once(previous).chain(constants.iter().cloned()).collect(),
            output: vec![name.to_owned()],
            name: name.to_owned(),
            op_type: op_type.to_owned(),
            attribute,
        });
    }

    fn finish(mut self, contract: &NetworkContract, properties: &[(&str, &str)]) -> Model {
        let NetworkContract { input, output } = contract;
        if let Some(last) = self.nodes.last_mut() {
            last.output = vec![output.name.clone()];
        }
        let graph = Graph {
            node: self.nodes,
            name: format!("{}_to_{}", input.name, output.name),
            initializer: self.constants,
            input: vec![ValueInfo::matrix(&input.name, input.rows, input.cols)],
            output: vec![ValueInfo::matrix(&output.name, output.rows, output.cols)],
        };
        let property =
            |(key, value): &(&str, &str)| Property { key: (*key).to_owned(), value: (*value).to_owned() };
        Model {
            ir_version: IR_VERSION,
            producer_name: "hybridnav-trainer".to_owned(),
            producer_version: env!("CARGO_PKG_VERSION").to_owned(),
            graph: Some(graph),
            opset_import: vec![OperatorSet { domain: String::new(), version: OPERATOR_SET }],
            metadata_props: properties.iter().map(property).collect(),
        }
    }
}
