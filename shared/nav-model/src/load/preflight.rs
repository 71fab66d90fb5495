//! What is checked in untrusted ONNX bytes before tract sees them.
//!
//! After this, the graph is known to be a short list of allowed operators in execution order, over finite weights whose sizes
//! match their data, from exactly the named input to exactly the named output. No node computes from constants alone, so that
//! no constant folding can blow a small file up.

use super::weights;
use super::{LoadError, NetworkContract, Port};
use std::collections::HashSet;
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
const OPERATOR_SETS: std::ops::RangeInclusive<i64> = 9..=18;

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
    let mut constants = HashSet::new();
    for tensor in &graph.initializer {
        weights::check(&tensor.name, tensor)?;
        if !constants.insert(tensor.name.as_str()) {
            return Err(weights::wrong(&tensor.name, "appear twice"));
        }
    }
    let inputs: Vec<_> =
        graph.input.iter().filter(|input| !constants.contains(input.name.as_str())).collect();
    check_port("input", &inputs, &contract.input)?;
    check_port("output", &graph.output.iter().collect::<Vec<_>>(), &contract.output)?;
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

/// Each node: allowed, without sub-graphs, reading what exists, writing what is new.
fn check_nodes<'m>(
    graph: &'m pb::GraphProto,
    mut constants: HashSet<&'m str>,
    contract: &'m NetworkContract,
) -> Result<(), LoadError> {
    let mut computed = HashSet::from([contract.input.name.as_str()]);
    for node in &graph.node {
        let name = node_name(node);
        let wrong = |problem: String| LoadError::Wiring { node: name.clone(), problem };
        if !is_default(&node.domain) || !OPERATORS.contains(&node.op_type.as_str()) {
            let operator = [node.domain.as_str(), node.op_type.as_str()].join("::");
            let operator = operator.trim_start_matches("::").to_owned();
            return Err(LoadError::Operator { node: name, operator });
        }
        check_attributes(node, &name)?;
        if node.input.len() > MAX_EDGES || node.output.len() > MAX_EDGES {
            return Err(wrong(format!("has more than {MAX_EDGES} inputs or outputs")));
        }
        let mut uses_computed = false;
        for input in node.input.iter().filter(|input| !input.is_empty()) {
            uses_computed |= computed.contains(input.as_str());
            if !computed.contains(input.as_str()) && !constants.contains(input.as_str()) {
                return Err(wrong(format!("reads `{input}`, which nothing before it makes")));
            }
        }
        let is_constant = node.op_type == "Constant";
        if is_constant == uses_computed {
            return Err(wrong("computes from constants only; fold them when exporting".to_owned()));
        }
        if node.output.iter().all(String::is_empty) {
            return Err(wrong("has no output".to_owned()));
        }
        for output in node.output.iter().filter(|output| !output.is_empty()) {
            let is_old = computed.contains(output.as_str()) || constants.contains(output.as_str());
            if is_old {
                return Err(wrong(format!("makes `{output}`, which exists already")));
            }
            if is_constant { &mut constants } else { &mut computed }.insert(output);
        }
    }
    let output = contract.output.name.as_str();
    if output == contract.input.name || !computed.contains(output) {
        return Err(LoadError::Interface { problem: format!("no node makes the output `{output}`") });
    }
    Ok(())
}

/// No sub-graphs, no sparse tensors, finite numbers; a tensor only as the value of a `Constant`.
fn check_attributes(node: &pb::NodeProto, name: &str) -> Result<(), LoadError> {
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
            weights::check(name, tensor)?;
        }
        weights::check_numbers(name, &[attribute.f])?;
        weights::check_numbers(name, &attribute.floats)?;
    }
    Ok(())
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
