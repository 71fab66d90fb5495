//! What can be wrong with a checkpoint file.

use std::io;
use std::path::PathBuf;

use super::format::VERSION;

/// Why a file could not be read as a checkpoint.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// The file system said no.
    #[error("could not read checkpoint {}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the file system said.
        source: io::Error,
    },
    /// Something else is in the file.
    #[error("{} is not a checkpoint: give a file that `trainer train` wrote", path.display())]
    NotACheckpoint {
        /// The file.
        path: PathBuf,
    },
    /// Written by another version of the format.
    #[error("checkpoint {} has format {found}, this trainer reads {VERSION}: use the trainer that wrote it", path.display())]
    Version {
        /// The file.
        path: PathBuf,
        /// Its version.
        found: u32,
    },
    /// The end is missing, or there is something behind it.
    #[error("checkpoint {} is torn: {found} bytes instead of {expected}; use an older one", path.display())]
    Torn {
        /// The file.
        path: PathBuf,
        /// Its length.
        found: u64,
        /// The length its header promises.
        expected: u64,
    },
    /// The content is not what was written.
    #[error("checkpoint {} is damaged: its checksum does not match; use an older one", path.display())]
    Checksum {
        /// The file.
        path: PathBuf,
    },
    /// A section is not there, or not of the kind or type asked for.
    #[error("checkpoint {} has no usable section `{name}`: it is of another version or configuration", path.display())]
    Section {
        /// The file.
        path: PathBuf,
        /// The section.
        name: String,
    },
}
