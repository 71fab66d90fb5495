//! Floats of other widths become plain ones of 32 bits, in which the executor computes.
//!
//! Weights are converted one by one, of 16 bits exactly, of 64 to the nearest; inputs and outputs are called plain floats; a
//! Cast from one width to another of what is computed is left out. A graph that asks for 16 bits is so computed more exactly
//! than it asks for; golden pairs say whether that is what its maker meant.

use std::collections::HashSet;
use tract_onnx::pb;
use tract_onnx::pb::tensor_proto::DataType;
use tract_onnx::prelude::f16;

/// Makes every float of the graph a plain one; what is damaged stays as it is, to be refused by name.
pub(super) fn make_plain(model: &mut pb::ModelProto) {
    let Some(graph) = &mut model.graph else { return };
    graph.initializer.iter_mut().for_each(widen);
    for port in graph.input.iter_mut().chain(&mut graph.output) {
        if let Some(pb::TypeProto { value: Some(pb::type_proto::Value::TensorType(tensor)), .. }) =
            &mut port.r#type
            && is_float(i64::from(tensor.elem_type))
        {
            tensor.elem_type = DataType::Float as i32;
        }
    }
    // Casts that prepare weights round them, and stay.
    let mut constants: HashSet<String> =
        graph.initializer.iter().map(|tensor| tensor.name.clone()).chain([String::new()]).collect();
    for node in &mut graph.node {
        node.attribute.iter_mut().filter_map(|attribute| attribute.t.as_mut()).for_each(widen);
        if node.input.iter().all(|input| constants.contains(input)) {
            constants.extend(node.output.iter().cloned());
        } else if node.op_type == "Cast"
            && node.attribute.iter().any(|attribute| attribute.name == "to" && is_float(attribute.i))
        {
            node.op_type = "Identity".to_owned();
            node.attribute.clear();
        }
    }
}

fn is_float(kind: i64) -> bool {
    [DataType::Float, DataType::Float16, DataType::Bfloat16, DataType::Double]
        .into_iter()
        .any(|float| float as i64 == kind)
}

/// Converts the data of a tensor of other floats, if it is all there once.
fn widen(tensor: &mut pb::TensorProto) {
    let halves = || -> Option<Vec<u16>> {
        match (&*tensor.raw_data, &*tensor.int32_data) {
            (raw, []) => {
                let (pairs, []) = raw.as_chunks() else { return None };
                Some(pairs.iter().map(|pair| u16::from_le_bytes(*pair)).collect())
            }
            ([], typed) => typed.iter().map(|bits| u16::try_from(*bits).ok()).collect(),
            _ => None,
        }
    };
    let doubles = || -> Option<Vec<f64>> {
        match (&*tensor.raw_data, &*tensor.double_data) {
            (raw, []) => {
                let (eights, []) = raw.as_chunks() else { return None };
                Some(eights.iter().map(|eight| f64::from_le_bytes(*eight)).collect())
            }
            ([], typed) => Some(typed.to_vec()),
            _ => None,
        }
    };
    let plain: Option<Vec<f32>> = match DataType::try_from(tensor.data_type) {
        Ok(DataType::Float16) => {
            halves().map(|halves| halves.into_iter().map(|bits| f16::from_bits(bits).to_f32()).collect())
        }
        Ok(DataType::Bfloat16) => halves()
            .map(|halves| halves.into_iter().map(|bits| f32::from_bits(u32::from(bits) << 16)).collect()),
        Ok(DataType::Double) => {
            doubles().map(|doubles| doubles.into_iter().map(|double| double as f32).collect())
        }
        _ => None,
    };
    let Some(plain) = plain else { return };
    tensor.data_type = DataType::Float as i32;
    tensor.int32_data.clear();
    tensor.double_data.clear();
    tensor.raw_data = plain.iter().flat_map(|number| number.to_le_bytes()).collect();
}
