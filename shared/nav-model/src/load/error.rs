//! Why a model was refused.

use super::preflight::OPERATOR_SETS;
use nav_core::network::NetworkError;

/// Why [`load_network`](super::load_network) refused a model.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// More bytes than [`MAX_MODEL_BYTES`](super::MAX_MODEL_BYTES).
    #[error(
        "the model has {bytes} bytes, more than the {limit} that a navigation policy may have; check the path"
    )]
    TooLarge {
        /// Bytes given.
        bytes: usize,
        /// The limit.
        limit: usize,
    },
    /// The bytes are not an ONNX model.
    #[error("the file is not an ONNX model or is damaged ({problem}); copy or export it again")]
    Malformed {
        /// Where the reading stopped.
        problem: String,
    },
    /// The model uses a part of ONNX that no policy needs.
    #[error("the model {problem}; export a plain inference graph with operator set {} to {}", OPERATOR_SETS.start(), OPERATOR_SETS.end())]
    Unsupported {
        /// What it uses.
        problem: String,
    },
    /// An operator that the preflight does not allow.
    #[error(
        "node `{node}` uses the operator {operator}, which this runtime does not run; export the policy with the operators in the documentation"
    )]
    Operator {
        /// Name of the node, or of its output.
        node: String,
        /// The operator.
        operator: String,
    },
    /// A node is not wired as a graph in execution order.
    #[error("node `{node}` {problem}; the graph is damaged, export it again")]
    Wiring {
        /// Name of the node, or of its output.
        node: String,
        /// What is wrong.
        problem: String,
    },
    /// Weights in another file, which is not there as the model says.
    #[error("the weights `{name}` are kept in another file, {problem}")]
    External {
        /// Name of the tensor.
        name: String,
        /// Which file, and what is wrong.
        problem: String,
    },
    /// Weights of a type that no policy needs.
    #[error("the weights `{name}` are of type {kind}; export the policy with 32-bit floats, not quantised")]
    WeightType {
        /// Name of the tensor.
        name: String,
        /// The type, as ONNX calls it.
        kind: String,
    },
    /// A weight tensor is damaged or unreasonable.
    #[error(
        "the weights `{name}` {problem}; the model is damaged or its training diverged, export another checkpoint"
    )]
    Weights {
        /// Name of the tensor.
        name: String,
        /// What is wrong.
        problem: String,
    },
    /// Inputs or outputs differ from the contract.
    #[error("{problem}; the model does not belong to this manifest, export both together")]
    Interface {
        /// What differs.
        problem: String,
    },
    /// tract refused the graph.
    #[error("tract cannot type the graph: {problem}")]
    Tract {
        /// tract's own words.
        problem: String,
    },
    /// tract panicked on the graph.
    #[error("the graph made tract panic ({problem}); it is malformed, export it again")]
    Panicked {
        /// The panic's message.
        problem: String,
    },
    /// A node of the typed graph has no counterpart in the executor.
    #[error("node `{node}` ({operator}) cannot be lowered: {problem}")]
    Lowering {
        /// Name of the node.
        node: String,
        /// The typed graph's operator.
        operator: String,
        /// Why not.
        problem: String,
    },
    /// The executor refused the lowered network.
    #[error("the network does not fit the executor: {0}")]
    Network(#[from] NetworkError),
    /// No memory for the weights.
    #[error("no memory for the network's weights: {0}")]
    Memory(#[source] std::io::Error),
    /// The executor and tract disagree.
    #[error(
        "executor and tract differ by {difference:e} on test input {case} (allowed {tolerance:e}); do not drive with this model, and report it"
    )]
    Parity {
        /// Largest relative difference found.
        difference: f32,
        /// Which input.
        case: usize,
        /// The tolerance.
        tolerance: f32,
    },
}
