//! The files of a model folder: read once, all of one model, hashed as the manifest says.

use super::{ModelError, OwnerKey};
use crate::load::{FileBytes, MAX_MODEL_BYTES, read_file_in};
use nav_core::manifest::{FileEntry, MANIFEST_FILE, MANIFEST_FORMAT, Manifest, ManifestError};
use std::os::unix::fs::MetadataExt;
use std::path::Path;

/// The largest manifest or golden file that is read, bytes.
const MAX_JSON_BYTES: u64 = 8 << 20;
/// How often a model is read that is replaced again and again while it is read.
const READS_MAX: usize = 5;

/// A manifest and the files that it vouches for.
pub(super) struct Files {
    pub(super) manifest: Manifest,
    pub(super) td3: FileBytes,
    pub(super) dqn: Option<FileBytes>,
    pub(super) golden: FileBytes,
    /// As [`Manifest::data`].
    pub(super) data: Vec<FileBytes>,
}

impl Files {
    /// Reads a folder whose manifest is signed with `key`, if there is one.
    ///
    /// # Errors
    /// What is missing, not signed, not readable, or not what the manifest says.
    pub(super) fn read(folder: &Path, key: Option<&OwnerKey>) -> Result<Self, ModelError> {
        let manifest = folder.join(MANIFEST_FILE);
        for _ in 1..READS_MAX {
            let before = identity(&manifest);
            let read = Self::read_once(folder, &manifest, key);
            // A model that was replaced meanwhile, as an export does it, was read half old, half new.
            if read.is_ok() || identity(&manifest) == before {
                return read;
            }
        }
        Self::read_once(folder, &manifest, key)
    }

    fn read_once(folder: &Path, path: &Path, key: Option<&OwnerKey>) -> Result<Self, ModelError> {
        if !path.exists() {
            let reason = if folder.is_dir() {
                "it holds no manifest.json"
            } else if folder.exists() {
                "it is a file, and a network alone does not say for which robot, lidar and layout it was trained"
            } else {
                "the folder does not exist"
            };
            return Err(ModelError::Missing { folder: folder.to_path_buf(), reason: reason.to_owned() });
        }
        let manifest = read_manifest(folder, path, key)?;
        manifest.validate()?;
        let weights = |entry: &FileEntry| read_hashed(folder, entry, MAX_MODEL_BYTES as u64);
        Ok(Self {
            td3: weights(&manifest.td3)?,
            dqn: manifest.dqn.as_ref().map(weights).transpose()?,
            golden: read_hashed(folder, &manifest.golden, MAX_JSON_BYTES)?,
            data: manifest.data.iter().map(weights).collect::<Result<_, _>>()?,
            manifest,
        })
    }
}

/// Which file lies there now: device, number, and the time at which it was put there, ns.
fn identity(path: &Path) -> Option<[i64; 4]> {
    let metadata = path.metadata().ok()?;
    let number = |number: u64| number.cast_signed();
    Some([number(metadata.dev()), number(metadata.ino()), metadata.ctime(), metadata.ctime_nsec()])
}

fn read_hashed(folder: &Path, entry: &FileEntry, limit_bytes: u64) -> Result<FileBytes, ModelError> {
    let path = folder.join(entry.file.as_str());
    let file = read_file_in(folder, &entry.file, limit_bytes)?;
    if file.sha256 == entry.sha256.as_str() {
        return Ok(file);
    }
    Err(ModelError::Hash { path, expected: entry.sha256.as_str().to_owned(), found: file.sha256 })
}

/// The manifest, in which every field must be said: a default would be a guess about somebody's robot.
fn read_manifest(folder: &Path, path: &Path, key: Option<&OwnerKey>) -> Result<Manifest, ModelError> {
    let file = read_file_in(folder, MANIFEST_FILE, MAX_JSON_BYTES)?;
    // Of the very bytes that are parsed.
    key.map_or(Ok(()), |key| key.check(folder, &file.bytes))?;
    let said: serde_json::Value = parse_json(path, &file)?;
    // Of another format it may have other fields, and that is what to say.
    if let Some(format) = said.get("format").and_then(serde_json::Value::as_u64)
        && format != u64::from(MANIFEST_FORMAT)
    {
        return Err(ManifestError::Format(u32::try_from(format).unwrap_or(u32::MAX)).into());
    }
    let manifest: Manifest = parse_json(path, &file)?;
    let json =
        |error: serde_json::Error| ModelError::Json { path: path.to_path_buf(), problem: error.to_string() };
    let whole = serde_json::to_value(&manifest).map_err(json)?;
    match left_out(&said, &whole, "") {
        Some(field) => Err(ModelError::Lacks { path: path.to_path_buf(), field }),
        None => Ok(manifest),
    }
}

/// The first field of `whole` that `said` does not have.
fn left_out(said: &serde_json::Value, whole: &serde_json::Value, path: &str) -> Option<String> {
    let (serde_json::Value::Object(said), serde_json::Value::Object(whole)) = (said, whole) else {
        return None;
    };
    whole.iter().find_map(|(name, value)| {
        let path = if path.is_empty() { name.clone() } else { format!("{path}.{name}") };
        said.get(name).map_or_else(|| Some(path.clone()), |said| left_out(said, value, &path))
    })
}

/// A file of JSON as what it should be.
pub(super) fn parse_json<T: serde::de::DeserializeOwned>(
    path: &Path,
    file: &FileBytes,
) -> Result<T, ModelError> {
    serde_json::from_slice(&file.bytes)
        .map_err(|error| ModelError::Json { path: path.to_path_buf(), problem: error.to_string() })
}
