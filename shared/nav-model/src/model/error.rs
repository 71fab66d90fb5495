//! Why a model was refused.

use super::{GoldenError, LimitsError, SignatureError};
use crate::load::{FileError, LoadError};
use nav_core::manifest::ManifestError;
use std::path::PathBuf;

/// Why a model folder cannot be driven with.
#[derive(Debug, thiserror::Error)]
pub enum ModelError {
    /// There is no such folder, or no manifest in it.
    #[error(
        "there is no model in {}: {reason}; `trainer export` writes one, and --model names its folder",
        folder.display()
    )]
    Missing {
        /// The folder.
        folder: PathBuf,
        /// What is missing.
        reason: String,
    },
    /// A file could not be read.
    #[error(transparent)]
    File(#[from] FileError),
    /// A JSON file is damaged, or has fields that this build does not know.
    #[error("{} is damaged or of another version: {problem}; export the model again", path.display())]
    Json {
        /// The file.
        path: PathBuf,
        /// What the parser said.
        problem: String,
    },
    /// The manifest does not fit this build.
    #[error(transparent)]
    Manifest(#[from] ManifestError),
    /// A file is not the one that the manifest was written for.
    #[error(
        "{} is damaged or was replaced: its SHA-256 is {found}, the manifest says {expected}; copy the folder \
         again or export the model again",
        path.display()
    )]
    Hash {
        /// The file.
        path: PathBuf,
        /// As the manifest says.
        expected: String,
        /// As read.
        found: String,
    },
    /// A network was refused.
    #[error("the network {} was refused", path.display())]
    Network {
        /// The file.
        path: PathBuf,
        /// Why.
        source: LoadError,
    },
    /// The golden pairs.
    #[error(transparent)]
    Golden(#[from] GoldenError),
    /// The manifest leaves out a field.
    #[error(
        "{} does not say `{field}`; nothing about a robot is taken for granted, export the model again",
        path.display()
    )]
    Lacks {
        /// The file.
        path: PathBuf,
        /// What it leaves out.
        field: String,
    },
    /// The networks take too long on this machine.
    #[error(
        "the networks need {took_us:.0} us for an answer on this machine, {allowed_us:.0} us (a fifth of the control \
         period) are allowed; train smaller ones, or use a faster machine"
    )]
    Slow {
        /// Median time of an answer of all networks together, us.
        took_us: f64,
        /// What is allowed, us.
        allowed_us: f64,
    },
    /// The robot's owner allows less than the model asks for.
    #[error(transparent)]
    Limits(#[from] LimitsError),
    /// The robot's owner did not sign it.
    #[error(transparent)]
    Signature(#[from] SignatureError),
}
