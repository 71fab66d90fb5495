//! Weights that an exporter kept in files beside the model (ONNX external data): taken in before anything is checked, so that
//! everything is checked.
//!
//! A file is one of those that the caller has read, bounded and hashed; nothing is opened here, whatever path a model names.

use super::preflight::MAX_MODEL_BYTES;
use super::{LoadError, weights};
use tract_onnx::pb;
use tract_onnx::pb::tensor_proto::DataLocation;

/// A file beside a model that may hold weights of it.
#[derive(Clone, Copy, Debug)]
pub struct DataFile<'a> {
    /// Its name, as the model calls it.
    pub name: &'a str,
    /// All of it.
    pub bytes: &'a [u8],
}

/// Puts the weights that lie in `files` into the model; whether there were any. Those of no file stay where they are, to be
/// refused by name. With them the model may have [`MAX_MODEL_BYTES`], `room` of which are left.
pub(super) fn take_in(
    model: &mut pb::ModelProto,
    files: &[DataFile<'_>],
    mut room: usize,
) -> Result<bool, LoadError> {
    let mut any = false;
    for (name, tensor) in model.graph.iter_mut().flat_map(tensors) {
        if !is_external(tensor) {
            continue;
        }
        let refuse = |problem: String| LoadError::External { name: name.clone(), problem };
        if tensor.data_location != Some(DataLocation::External as i32) || !tensor.raw_data.is_empty() {
            return Err(refuse("but also in the model, so that it is not known which ones count".to_owned()));
        }
        let location = entry(tensor, "location", &name)?.unwrap_or_default();
        let Some(file) = files.iter().find(|file| file.name == location) else {
            return Err(refuse(format!(
                "`{location}`, which the manifest does not list: put that file into the model's folder, and its name and \
                 SHA-256 under `data` in manifest.json, or export the weights inside the model (torch.onnx.export with \
                 external_data=False, or onnx.save without save_as_external_data)"
            )));
        };
        let number = |key: &str| {
            let text = entry(tensor, key, &name)?;
            let number = text.map(|text| text.parse::<usize>().map_err(|_| text)).transpose();
            number.map_err(|text| refuse(format!("with the {key} `{text}`, which is no number of bytes")))
        };
        let offset = number("offset")?.unwrap_or(0);
        // Without a length, as much as the shape says.
        let length = number("length")?.or_else(|| weights::raw_len(tensor)).unwrap_or(0);
        let range = offset.checked_add(length).and_then(|end| file.bytes.get(offset..end));
        let Some(bytes) = range else {
            return Err(refuse(format!(
                "`{location}`: {length} bytes from byte {offset} on, but it has only {}; copy both files again, or export \
                 them together",
                file.bytes.len()
            )));
        };
        room = room.checked_sub(bytes.len()).ok_or_else(|| {
            refuse(format!(
                "and together come to more than {MAX_MODEL_BYTES} bytes; no navigation policy does"
            ))
        })?;
        let bytes = bytes.to_vec();
        (tensor.raw_data, tensor.data_location) = (bytes, None);
        tensor.external_data.clear();
        any = true;
    }
    Ok(any)
}

/// Whether the tensor's data lies, or is said to lie, outside the model.
fn is_external(tensor: &pb::TensorProto) -> bool {
    let elsewhere = tensor.data_location.is_some_and(|location| location != DataLocation::Default as i32);
    elsewhere || !tensor.external_data.is_empty()
}

/// Every tensor with data: initialisers, and the values of constants, which are called as their nodes' results.
fn tensors(graph: &mut pb::GraphProto) -> impl Iterator<Item = (String, &mut pb::TensorProto)> {
    let constants = graph.node.iter_mut().flat_map(|node| {
        let name = node.output.first().cloned().unwrap_or_default();
        let values = node.attribute.iter_mut().filter_map(|attribute| attribute.t.as_mut());
        values.map(move |tensor| (name.clone(), tensor))
    });
    graph.initializer.iter_mut().map(|tensor| (tensor.name.clone(), tensor)).chain(constants)
}

/// What is said under `key`, which may be said once.
fn entry<'t>(tensor: &'t pb::TensorProto, key: &str, name: &str) -> Result<Option<&'t str>, LoadError> {
    let mut said = tensor.external_data.iter().filter(|entry| entry.key == key);
    match (said.next(), said.next()) {
        (_, Some(_)) => {
            let problem = format!("of which the {key} is said twice");
            Err(LoadError::External { name: name.to_owned(), problem })
        }
        (first, None) => Ok(first.map(|entry| entry.value.as_str())),
    }
}
