//! Checks of one weight tensor.

use super::LoadError;
use super::preflight::{MAX_MODEL_BYTES, MAX_RANK};
use tract_onnx::pb;
use tract_onnx::pb::tensor_proto::{DataLocation, DataType};

/// The most elements of one tensor: no more floats fit into a model.
const MAX_ELEMENTS: usize = MAX_MODEL_BYTES / 4;
/// The largest magnitude of a weight. Trained weights stay below ten, inverse deviations below a million.
const MAX_MAGNITUDE: f32 = 1e6;

/// Refuses a tensor that is not plainly a matrix of finite, bounded floats or of integers (shapes and axes).
pub(super) fn check(name: &str, tensor: &pb::TensorProto) -> Result<(), LoadError> {
    let external = tensor.data_location.is_some_and(|location| location != DataLocation::Default as i32);
    if external || !tensor.external_data.is_empty() || tensor.segment.is_some() {
        return Err(wrong(name, "lie outside the model file"));
    }
    if tensor.dims.len() > MAX_RANK {
        return Err(wrong(name, format!("have {} dimensions", tensor.dims.len())));
    }
    let elements = tensor
        .dims
        .iter()
        .try_fold(1_usize, |product, &dim| product.checked_mul(usize::try_from(dim).ok()?))
        .filter(|elements| (1..=MAX_ELEMENTS).contains(elements))
        .ok_or_else(|| wrong(name, format!("have the impossible shape {:?}", tensor.dims)))?;
    let is_float = tensor.data_type == DataType::Float as i32;
    if !is_float && tensor.data_type != DataType::Int64 as i32 {
        return Err(wrong(name, "are neither 32-bit floats nor 64-bit integers"));
    }
    let other_data = !tensor.int32_data.is_empty()
        || !tensor.string_data.is_empty()
        || !tensor.double_data.is_empty()
        || !tensor.uint64_data.is_empty()
        || (if is_float { !tensor.int64_data.is_empty() } else { !tensor.float_data.is_empty() });
    let typed_len = if is_float { tensor.float_data.len() } else { tensor.int64_data.len() };
    let element_bytes = if is_float { size_of::<f32>() } else { size_of::<i64>() };
    let is_raw = tensor.raw_data.len() == elements * element_bytes && typed_len == 0;
    let is_typed = tensor.raw_data.is_empty() && typed_len == elements;
    if other_data || !(is_raw || is_typed) {
        return Err(wrong(name, format!("hold other data than their shape {:?} says", tensor.dims)));
    }
    if is_float {
        check_numbers(name, &tensor.float_data)?;
        let floats: Vec<f32> =
            tensor.raw_data.as_chunks().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
        check_numbers(name, &floats)?;
    }
    Ok(())
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
