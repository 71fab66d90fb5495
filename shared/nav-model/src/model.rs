//! A model folder: manifest, networks and golden pairs, read once and checked before anything is driven.
//!
//! | checked | how |
//! |---|---|
//! | signature | of the manifest, by the owner's key, where one is required: before anything else is read |
//! | manifest | format, observation layout, task, names (unknown fields are refused) |
//! | files | no links, bounded, SHA-256 as the manifest says, of the very bytes that are parsed |
//! | networks | see [`crate::load`] |
//! | speed | an answer within a fifth of the control period on this machine |
//! | golden pairs | the executor gives what the trainer's network gave, within [`GOLDEN_TOLERANCE`] |

mod golden;
mod limits;
mod signature;
mod files;
mod error;

pub use error::ModelError;
pub use golden::{GOLDEN_TOLERANCE, Golden, GoldenError, GoldenPair};
pub use limits::{LimitsError, OwnerLimits};
pub use signature::{OwnerKey, SignatureError};

use files::{Files, parse_json};
use nav_core::controller::{Controller, ShapeError};
use nav_core::manifest::{FileEntry, Manifest};
use nav_core::observation::{CANDIDATE_FEATURES, LOW_ACTION, LOW_OBSERVATION};
use nav_core::task::ACTION_COUNT;
use std::path::{Path, PathBuf};

use crate::load::{Arena, DataFile, FileBytes, LoadedNetwork, NetworkContract, Port, load_network_with};

/// A checked model.
#[derive(Debug)]
pub struct Model {
    folder: PathBuf,
    manifest: Manifest,
    td3: LoadedNetwork,
    dqn: Option<LoadedNetwork>,
    golden: Golden,
    golden_difference: f32,
    is_signed: bool,
}

impl Model {
    /// Reads and checks a model folder.
    ///
    /// # Errors
    /// The first check that fails, as a sentence that says what to do.
    pub fn read(folder: &Path) -> Result<Self, ModelError> {
        Self::read_signed(folder, None)
    }

    /// Reads and checks a model folder whose manifest is signed with `key`, if there is one.
    ///
    /// # Errors
    /// As [`Self::read`], after a signature that is missing or not of this manifest and key.
    pub fn read_signed(folder: &Path, key: Option<&OwnerKey>) -> Result<Self, ModelError> {
        let files = Files::read(folder, key)?;
        let manifest = files.manifest;
        let data: Vec<DataFile<'_>> = manifest
            .data
            .iter()
            .zip(&files.data)
            .map(|(entry, file)| DataFile { name: &entry.file, bytes: &file.bytes })
            .collect();
        let network = |entry: &FileEntry, file: &FileBytes, contract: NetworkContract| {
            load_network_with(&file.bytes, &data, &contract)
                .map_err(|source| ModelError::Network { path: folder.join(entry.file.as_str()), source })
        };
        let mut td3 = network(&manifest.td3, &files.td3, actor_contract())?;
        let mut dqn = match (&manifest.dqn, &files.dqn) {
            (Some(entry), Some(file)) => Some(network(entry, file, scorer_contract())?),
            _ => None,
        };
        let golden: Golden = parse_json(&folder.join(manifest.golden.file.as_str()), &files.golden)?;
        let golden_difference = golden.check(&mut td3, dqn.as_mut())?;
        let (took_us, allowed_us) = (answer_us(&mut td3, dqn.as_mut()), allowed_us(&manifest));
        if took_us > allowed_us {
            return Err(ModelError::Slow { took_us, allowed_us });
        }
        let folder = folder.to_path_buf();
        Ok(Self { folder, manifest, td3, dqn, golden, golden_difference, is_signed: key.is_some() })
    }

    /// Whether the robot's owner allows what the model asks for.
    ///
    /// # Errors
    /// The first limit that it goes beyond.
    pub fn respects(&self, limits: &OwnerLimits) -> Result<(), ModelError> {
        Ok(limits.check(&self.manifest.task.robot)?)
    }

    /// Where it was read from.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Its manifest.
    pub fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// The low level.
    pub fn td3(&self) -> &LoadedNetwork {
        &self.td3
    }

    /// The high level, unless it is a flat policy.
    pub fn dqn(&self) -> Option<&LoadedNetwork> {
        self.dqn.as_ref()
    }

    /// Its golden pairs.
    pub fn golden(&self) -> &Golden {
        &self.golden
    }

    /// The largest difference to a golden pair.
    pub fn golden_difference(&self) -> f32 {
        self.golden_difference
    }

    /// Whether its manifest was found to be signed with a required key.
    pub fn is_signed(&self) -> bool {
        self.is_signed
    }

    /// The networks for a bench, with their tract plans: `td3` first.
    pub fn into_networks(self) -> (LoadedNetwork, Option<LoadedNetwork>) {
        (self.td3, self.dqn)
    }

    /// The controller that drives with this model.
    ///
    /// # Errors
    /// A network of another shape; [`Model::read`] has already refused those.
    pub fn into_controller(self) -> Result<Controller<Arena>, ShapeError> {
        let dqn = self.dqn.map(LoadedNetwork::into_network);
        Controller::new(&self.manifest.task, dqn, self.td3.into_network())
    }

    /// A controller that drives straight at the goal with the low level alone: the flat rival.
    ///
    /// # Errors
    /// As [`Self::into_controller`].
    pub fn into_flat_controller(self) -> Result<Controller<Arena>, ShapeError> {
        Controller::new(&self.manifest.task, None, self.td3.into_network())
    }
}

/// Names and shapes of the low level: `observation` [1, 82] to `action` [1, 2].
pub fn actor_contract() -> NetworkContract {
    NetworkContract::new(Port::new("observation", 1, LOW_OBSERVATION), Port::new("action", 1, LOW_ACTION))
}

/// Names and shapes of the high level: `candidates` [18, 112] to `q` [18, 1].
pub fn scorer_contract() -> NetworkContract {
    NetworkContract::new(
        Port::new("candidates", ACTION_COUNT, CANDIDATE_FEATURES),
        Port::new("q", ACTION_COUNT, 1),
    )
}

/// Median time of an answer of all networks together, us.
fn answer_us(td3: &mut LoadedNetwork, dqn: Option<&mut LoadedNetwork>) -> f64 {
    let median_us = |loaded: &mut LoadedNetwork| {
        let network = loaded.network_mut();
        let (input, mut output) = (vec![0.1; network.input_len()], vec![0.0; network.output_len()]);
        let mut times: [u128; 9] = std::array::from_fn(|_| {
            let begun = std::time::Instant::now();
            network.run(&input, &mut output);
            begun.elapsed().as_nanos()
        });
        times.sort_unstable();
        times[4] as f64 / 1e3
    };
    median_us(td3) + dqn.map_or(0.0, median_us)
}

/// A fifth of the control period, us.
fn allowed_us(manifest: &Manifest) -> f64 {
    f64::from(manifest.task.control_period_s) * 1e6 / 5.0
}
