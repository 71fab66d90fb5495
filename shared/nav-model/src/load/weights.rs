//! Checks of one weight tensor.

use super::LoadError;
use super::preflight::{MAX_MODEL_BYTES, MAX_RANK};
use tract_onnx::pb;
use tract_onnx::pb::tensor_proto::DataType;

/// The most elements of one tensor: no more floats fit into a model.
const MAX_ELEMENTS: usize = MAX_MODEL_BYTES / 4;
/// The largest magnitude of a weight. Trained weights stay below ten, inverse deviations below a million.
const MAX_MAGNITUDE: f32 = 1e6;

/// Refuses a tensor that is not plainly a matrix of finite, bounded floats or of integers (shapes and axes); how many
/// elements it has. Floats of other widths are plain ones by now, unless they are damaged.
pub(super) fn check(name: &str, tensor: &pb::TensorProto) -> Result<usize, LoadError> {
    if tensor.segment.is_some() {
        return Err(wrong(name, "come in segments"));
    }
    if tensor.dims.len() > MAX_RANK {
        return Err(wrong(name, format!("have {} dimensions", tensor.dims.len())));
    }
    let elements = elements(tensor)
        .ok_or_else(|| wrong(name, format!("have the impossible shape {:?}", tensor.dims)))?;
    let data = Data::of(tensor)
        .ok_or_else(|| LoadError::WeightType { name: name.to_owned(), kind: kind(tensor.data_type) })?;
    let lengths = [
        tensor.float_data.len(),
        tensor.int32_data.len(),
        tensor.int64_data.len(),
        tensor.double_data.len(),
        tensor.uint64_data.len(),
        tensor.string_data.len(),
    ];
    let typed: usize = lengths.iter().sum();
    let is_raw = tensor.raw_data.len() == elements * data.bytes && typed == 0;
    let is_typed = tensor.raw_data.is_empty() && typed == elements && data.typed_len == elements;
    if !(is_raw || is_typed) {
        return Err(wrong(name, format!("hold other data than their shape {:?} says", tensor.dims)));
    }
    if tensor.data_type == DataType::Float as i32 {
        check_numbers(name, &tensor.float_data)?;
        let floats: Vec<f32> =
            tensor.raw_data.as_chunks().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
        check_numbers(name, &floats)?;
    }
    Ok(elements)
}

/// Elements that the shape says, if a model can have so many.
fn elements(tensor: &pb::TensorProto) -> Option<usize> {
    tensor
        .dims
        .iter()
        .try_fold(1_usize, |product, &dim| product.checked_mul(usize::try_from(dim).ok()?))
        .filter(|elements| (1..=MAX_ELEMENTS).contains(elements))
}

/// Bytes of raw data that shape and type say.
pub(super) fn raw_len(tensor: &pb::TensorProto) -> Option<usize> {
    Some(elements(tensor)? * Data::of(tensor)?.bytes)
}

/// How the elements of a type are stored.
struct Data {
    /// Of one element in raw data.
    bytes: usize,
    /// Elements in the field of the type.
    typed_len: usize,
}

impl Data {
    fn of(tensor: &pb::TensorProto) -> Option<Self> {
        let kinds = [
            (DataType::Float, 4, tensor.float_data.len()),
            (DataType::Int64, 8, tensor.int64_data.len()),
            (DataType::Int32, 4, tensor.int32_data.len()),
            (DataType::Float16, 2, tensor.int32_data.len()),
            (DataType::Bfloat16, 2, tensor.int32_data.len()),
            (DataType::Double, 8, tensor.double_data.len()),
        ];
        let known = kinds.into_iter().find(|(kind, ..)| *kind as i32 == tensor.data_type);
        known.map(|(_, bytes, typed_len)| Self { bytes, typed_len })
    }
}

/// The type of weights that are neither plain floats nor indices.
pub(super) fn odd_kind(tensor: &pb::TensorProto) -> Option<String> {
    let is_plain = [DataType::Float, DataType::Int64].map(|kind| kind as i32).contains(&tensor.data_type);
    (!is_plain).then(|| kind(tensor.data_type))
}

/// The name of a type that is not read.
fn kind(number: i32) -> String {
    DataType::try_from(number).map_or_else(|_| format!("type {number}"), |kind| format!("{kind:?}"))
}

/// Refuses NaN, infinity and absurd magnitudes.
pub(super) fn check_numbers(name: &str, numbers: &[f32]) -> Result<(), LoadError> {
    match numbers.iter().find(|number| !number.is_finite() || number.abs() > MAX_MAGNITUDE) {
        Some(number) => Err(wrong(name, format!("contain {number}"))),
        None => Ok(()),
    }
}

/// The error about the tensor `name`.
pub(super) fn wrong(name: &str, problem: impl Into<String>) -> LoadError {
    LoadError::Weights { name: name.to_owned(), problem: problem.into() }
}
