//! Which model, and what its robot's owner demands of it.

use clap::Args;
use runtime::model::Demands;
use std::path::PathBuf;

/// A model, wherever one is read.
#[derive(Debug, Args)]
pub(crate) struct ModelArguments {
    /// Folder of the model: manifest.json beside its ONNX files
    #[arg(long = "model", value_name = "DIR", default_value = "models")]
    pub(crate) folder: PathBuf,
    /// What the robot's owner allows, as TOML ([robot] linear_max_mps = 0.5 and so on); a model that asks for more is
    /// refused
    #[arg(long, value_name = "FILE")]
    limits: Option<PathBuf>,
    /// Accept only a model whose manifest.json this minisign public key signed (manifest.json.minisig beside it); the path
    /// of a key file, or the key itself
    #[arg(long, value_name = "KEY")]
    require_signature: Option<String>,
}

impl ModelArguments {
    /// What the robot's owner demands.
    pub(crate) fn demands(&self) -> Demands {
        Demands { limits: self.limits.clone(), key: self.require_signature.clone() }
    }
}
