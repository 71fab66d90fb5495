//! What exporters leave in a graph without meaning: weights that nothing reads, and names that occur twice.

use std::collections::HashSet;
use tract_onnx::pb;

/// Drops initialisers of any type that no node reads, and makes the names of nodes unique: tract takes them for keys.
pub(super) fn tidy(model: &mut pb::ModelProto) {
    let Some(graph) = &mut model.graph else { return };
    let read: HashSet<String> = graph.node.iter().flat_map(|node| node.input.iter().cloned()).collect();
    graph.initializer.retain(|tensor| read.contains(&tensor.name));
    graph.input.retain(|input| {
        // Old exporters list weights among the inputs; those that were dropped are none.
        read.contains(&input.name) || !is_weight(input)
    });
    let mut taken = HashSet::new();
    for (index, node) in graph.node.iter_mut().enumerate() {
        if node.name.is_empty() {
            continue;
        }
        if !taken.insert(node.name.clone()) {
            node.name = format!("{} (node {index})", node.name);
            taken.insert(node.name.clone());
        }
    }
}

/// The real inputs of a policy are matrices of floats; what nothing reads and has another type is a left-over.
fn is_weight(input: &pb::ValueInfoProto) -> bool {
    let Some(pb::TypeProto { value: Some(pb::type_proto::Value::TensorType(tensor)), .. }) = &input.r#type
    else {
        return false;
    };
    tensor.elem_type != pb::tensor_proto::DataType::Float as i32
}
