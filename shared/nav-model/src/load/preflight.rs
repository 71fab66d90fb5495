//! What is checked in untrusted ONNX bytes before tract sees them.
//!
//! After this, the graph is known to be a short list of allowed operators in execution order, over finite weights whose sizes
//! match their data, from exactly the named input to exactly the named output. What tract computes from it in advance (constants
//! folded, nested concatenations joined) is bounded, so that a small file cannot blow up.

use super::weights;
use super::{LoadError, NetworkContract, Port};
use std::collections::HashMap;
use tract_onnx::pb;

/// The most bytes of a model.
pub const MAX_MODEL_BYTES: usize = 8 << 20;
/// The most nodes of a graph.
pub const MAX_NODES: usize = 64;
/// The most inputs or outputs of a node.
const MAX_EDGES: usize = 16;
/// The most dimensions of a tensor.
pub(super) const MAX_RANK: usize = 4;
/// Operator sets that tract is tested with.
pub(super) const OPERATOR_SETS: std::ops::RangeInclusive<i64> = 9..=24;
/// The most elements of a constant that is computed from constants.
const MAX_FOLDED: usize = MAX_MODEL_BYTES / 4;
/// The most values that a concatenation joins, those of nested ones counted.
const MAX_PIECES: usize = 1024;

/// Operators of the default domain that may appear. Some of them have no counterpart in the executor in every use; what
/// cannot be lowered is refused later.
const OPERATORS: [&str; 28] = [
    "Add",
    "Clip",
    "Concat",
    "Constant",
    "Div",
    "Flatten",
    "Gemm",
    "Identity",
    "LayerNormalization",
    "LeakyRelu",
    "MatMul",
    "Max",
    "Min",
    "Mul",
    "Pow",
    "ReduceMean",
    "ReduceSum",
    "Relu",
    "Reshape",
    "Sigmoid",
    "Slice",
    "Softplus",
    "Split",
    "Sqrt",
    "Squeeze",
    "Sub",
    "Tanh",
    "Unsqueeze",
];

/// Operators that may prepare weights, besides.
const WEIGHT_OPERATORS: [&str; 2] = ["Cast", "Transpose"];

/// Checks a decoded model against the rules and the contract.
pub(super) fn check(model: &pb::ModelProto, contract: &NetworkContract) -> Result<(), LoadError> {
    check_header(model)?;
    let graph = model.graph.as_ref().ok_or_else(|| unsupported("has no graph"))?;
    if !graph.sparse_initializer.is_empty() || !graph.quantization_annotation.is_empty() {
        return Err(unsupported("has sparse or quantised weights"));
    }
    if graph.node.len() > MAX_NODES {
        return Err(unsupported(format!("has {} nodes, more than {MAX_NODES}", graph.node.len())));
    }
    let mut constants = HashMap::new();
    let mut odd = HashMap::new();
    for tensor in &graph.initializer {
        let elements = weights::check(&tensor.name, tensor)?;
        if let Some(kind) = weights::odd_kind(tensor) {
            odd.insert(tensor.name.as_str(), kind);
        }
        if constants.insert(tensor.name.as_str(), elements).is_some() {
            return Err(weights::wrong(&tensor.name, "appear twice"));
        }
    }
    let inputs: Vec<_> =
        graph.input.iter().filter(|input| !constants.contains_key(input.name.as_str())).collect();
    check_port("input", &inputs, &contract.input)?;
    check_port("output", &graph.output.iter().collect::<Vec<_>>(), &contract.output)?;
    check_types(graph, odd)?;
    check_nodes(graph, constants, contract)
}

fn check_header(model: &pb::ModelProto) -> Result<(), LoadError> {
    if !model.functions.is_empty() || !model.training_info.is_empty() {
        return Err(unsupported("has functions or training information"));
    }
    let mut sets = model.opset_import.iter().filter(|set| is_default(&set.domain));
    match (sets.next(), sets.next()) {
        (Some(set), None) if OPERATOR_SETS.contains(&set.version) => Ok(()),
        (Some(set), None) => Err(unsupported(format!("uses operator set {}", set.version))),
        (None, _) => Err(unsupported("names no operator set")),
        (Some(_), Some(_)) => Err(unsupported("names two operator sets")),
    }
}

/// The only graph input or output must be `port`; a first dimension may be left symbolic.
fn check_port(kind: &str, found: &[&pb::ValueInfoProto], port: &Port) -> Result<(), LoadError> {
    let refuse = |problem: String| Err(LoadError::Interface { problem });
    let &[value] = found else {
        let names: Vec<_> = found.iter().take(MAX_EDGES).map(|value| value.name.as_str()).collect();
        return refuse(format!("the model has {} {kind}s {names:?}, expected only {port}", found.len()));
    };
    if value.name != port.name {
        return refuse(format!("the model's {kind} is called `{}`, expected {port}", value.name));
    }
    let Some(pb::TypeProto { value: Some(pb::type_proto::Value::TensorType(tensor)), .. }) = &value.r#type
    else {
        return refuse(format!("the model's {kind} `{}` has no type, expected {port}", value.name));
    };
    if tensor.elem_type != pb::tensor_proto::DataType::Float as i32 {
        return refuse(format!("the model's {kind} `{}` is not of 32-bit floats", value.name));
    }
    // An output may leave its shape to inference; the typed graph is compared again later.
    let Some(shape) = &tensor.shape else {
        return if kind == "output" {
            Ok(())
        } else {
            refuse(format!("the model's input `{}` has no shape", value.name))
        };
    };
    let expected = [port.rows, port.cols];
    let fits = shape.dim.len() == expected.len()
        && shape.dim.iter().zip(expected).enumerate().all(|(axis, (dim, expected))| match &dim.value {
            Some(pb::tensor_shape_proto::dimension::Value::DimValue(found)) => {
                usize::try_from(*found) == Ok(expected)
            }
            _ => axis == 0,
        });
    if fits {
        return Ok(());
    }
    let dims: Vec<_> = shape.dim.iter().take(MAX_RANK + 1).map(describe_dim).collect();
    refuse(format!("the model's {kind} `{}` has shape [{}], expected {port}", value.name, dims.join(", ")))
}

fn describe_dim(dim: &pb::tensor_shape_proto::Dimension) -> String {
    match &dim.value {
        Some(pb::tensor_shape_proto::dimension::Value::DimValue(length)) => length.to_string(),
        Some(pb::tensor_shape_proto::dimension::Value::DimParam(symbol)) => symbol.clone(),
        None => "?".to_owned(),
    }
}

/// Weights of other types than plain floats and indices may only be prepared by nodes until a Cast makes plain floats of them.
fn check_types<'m>(graph: &'m pb::GraphProto, mut odd: HashMap<&'m str, String>) -> Result<(), LoadError> {
    for node in &graph.node {
        let Some((name, kind)) = node.input.iter().find_map(|input| odd.get_key_value(input.as_str())) else {
            continue;
        };
        if node.op_type == "Cast" {
            continue;
        }
        if !["Identity", "Transpose", "Reshape"].contains(&node.op_type.as_str()) {
            return Err(LoadError::WeightType { name: (*name).to_owned(), kind: kind.clone() });
        }
        let kind = kind.clone();
        odd.extend(node.output.iter().map(|output| (output.as_str(), kind.clone())));
    }
    Ok(())
}

/// Each node: allowed, without sub-graphs, reading what exists, writing what is new, and of bounded cost.
fn check_nodes<'m>(
    graph: &'m pb::GraphProto,
    // Elements of each constant, at most.
    mut constants: HashMap<&'m str, usize>,
    contract: &'m NetworkContract,
) -> Result<(), LoadError> {
    // Values that each computed one joins, at most.
    let mut computed = HashMap::from([(contract.input.name.as_str(), 1_usize)]);
    for node in &graph.node {
        let name = node_name(node);
        let wrong = |problem: String| LoadError::Wiring { node: name.clone(), problem };
        let reads = || node.input.iter().filter(|input| !input.is_empty()).map(String::as_str);
        let of_constants = !reads().any(|input| computed.contains_key(input));
        check_operator(node, &name, of_constants)?;
        let made = check_attributes(node, &name)?;
        if node.input.len() > MAX_EDGES || node.output.len() > MAX_EDGES {
            return Err(wrong(format!("has more than {MAX_EDGES} inputs or outputs")));
        }
        let is_known = |input: &&str| computed.contains_key(input) || constants.contains_key(input);
        if let Some(input) = reads().find(|input| !is_known(input)) {
            return Err(wrong(format!("reads `{input}`, which nothing before it makes")));
        }
        let size = if of_constants {
            let sizes = reads().map(|input| constants[input]);
            made.max(folded_elements(&node.op_type, sizes))
        } else if node.op_type == "Concat" {
            reads().map(|input| computed.get(input).copied().unwrap_or(1)).fold(0, usize::saturating_add)
        } else {
            1
        };
        let limit = if of_constants { MAX_FOLDED } else { MAX_PIECES };
        if size > limit {
            return Err(wrong(format!("grows to more than {limit} parts")));
        }
        if node.output.iter().all(String::is_empty) {
            return Err(wrong("has no output".to_owned()));
        }
        for output in node.output.iter().filter(|output| !output.is_empty()) {
            if is_known_to(output, &computed, &constants) {
                return Err(wrong(format!("makes `{output}`, which exists already")));
            }
            if of_constants { &mut constants } else { &mut computed }.insert(output, size);
        }
    }
    let output = contract.output.name.as_str();
    if output == contract.input.name || !computed.contains_key(output) {
        return Err(LoadError::Interface { problem: format!("no node makes the output `{output}`") });
    }
    Ok(())
}

fn is_known_to(name: &str, computed: &HashMap<&str, usize>, constants: &HashMap<&str, usize>) -> bool {
    computed.contains_key(name) || constants.contains_key(name)
}

fn check_operator(node: &pb::NodeProto, name: &str, of_constants: bool) -> Result<(), LoadError> {
    let kind = node.op_type.as_str();
    let is_allowed = OPERATORS.contains(&kind) || (of_constants && WEIGHT_OPERATORS.contains(&kind));
    if is_default(&node.domain) && is_allowed {
        return Ok(());
    }
    let operator = [node.domain.as_str(), kind].join("::");
    let operator = operator.trim_start_matches("::").to_owned();
    Err(LoadError::Operator { node: name.to_owned(), operator })
}

/// The most elements that a node of constants can make of inputs with so many.
fn folded_elements(operator: &str, sizes: impl Iterator<Item = usize>) -> usize {
    match operator {
        "Concat" => sizes.fold(0, usize::saturating_add),
        // Broadcast and products; the second input of the others is a shape or axes, which only make it more.
        _ => sizes.fold(1, usize::saturating_mul),
    }
}

/// No sub-graphs, no sparse tensors, finite numbers; a tensor only as the value of a `Constant`, whose elements are
/// returned.
fn check_attributes(node: &pb::NodeProto, name: &str) -> Result<usize, LoadError> {
    let mut elements = 0;
    for attribute in &node.attribute {
        let nested = attribute.g.is_some()
            || !attribute.graphs.is_empty()
            || attribute.sparse_tensor.is_some()
            || !attribute.sparse_tensors.is_empty()
            || !attribute.tensors.is_empty()
            || !attribute.type_protos.is_empty()
            || !attribute.ref_attr_name.is_empty();
        let foreign_tensor = attribute.t.is_some() && node.op_type != "Constant";
        if nested || foreign_tensor {
            let problem = format!("has a sub-graph or tensor in its attribute `{}`", attribute.name);
            return Err(LoadError::Wiring { node: name.to_owned(), problem });
        }
        if let Some(tensor) = &attribute.t {
            elements = weights::check(name, tensor)?;
        }
        weights::check_numbers(name, &[attribute.f])?;
        weights::check_numbers(name, &attribute.floats)?;
    }
    Ok(elements)
}

fn is_default(domain: &str) -> bool {
    domain.is_empty() || domain == "ai.onnx"
}

/// The node's name, or that of its first output when it has none.
fn node_name(node: &pb::NodeProto) -> String {
    match node.output.first() {
        Some(output) if node.name.is_empty() => output.clone(),
        _ => node.name.clone(),
    }
}

fn unsupported(problem: impl Into<String>) -> LoadError {
    LoadError::Unsupported { problem: problem.into() }
}
