//! A model folder: manifest, networks and golden pairs, read once and checked before anything is driven.
//!
//! | checked | how |
//! |---|---|
//! | manifest | format, observation layout, task, names (unknown fields are refused) |
//! | files | no links, bounded, SHA-256 as the manifest says, of the very bytes that are parsed |
//! | networks | see [`crate::load`] |
//! | golden pairs | the executor gives what the trainer's network gave, within [`GOLDEN_TOLERANCE`] |

use nav_core::controller::{Controller, ShapeError};
use nav_core::manifest::{FileEntry, GOLDEN_PAIRS_MIN, MANIFEST_FILE, Manifest, ManifestError};
use nav_core::observation::{
    CANDIDATE_FEATURES, HIGH_OBSERVATION, LOW_ACTION, LOW_OBSERVATION, expand_candidates,
};
use nav_core::task::ACTION_COUNT;
use serde::{Deserialize, Serialize};
use std::collections::HashSet;
use std::path::{Path, PathBuf};

use crate::load::{
    Arena, FileBytes, FileError, LoadError, LoadedNetwork, MAX_MODEL_BYTES, NetworkContract, Port,
    load_network, read_file,
};

/// The largest difference between executor and golden pair, relative to the larger of one and the largest number of
/// the golden answer.
pub const GOLDEN_TOLERANCE: f32 = 1e-5;
/// The largest manifest or golden file that is read, bytes.
const MAX_JSON_BYTES: u64 = 8 << 20;

/// An input and what the trainer's own network answered.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GoldenPair {
    /// A low-level observation, or a high-level one (not the candidate matrix made of it).
    pub observation: Vec<f32>,
    /// The network's answer.
    pub answer: Vec<f32>,
}

/// The golden pairs of a model.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Golden {
    /// Of the low level: observation to action.
    pub td3: Vec<GoldenPair>,
    /// Of the high level: observation to values; empty in a flat policy.
    pub dqn: Vec<GoldenPair>,
}

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
    /// A golden pair was not reproduced.
    #[error(
        "the {network} network does not reproduce its golden pair {index}: it is off by {difference:e} where \
         {GOLDEN_TOLERANCE:e} is allowed; export the model again on a machine of this kind and report it"
    )]
    Golden {
        /// Which network.
        network: &'static str,
        /// Which pair.
        index: usize,
        /// By how much.
        difference: f32,
    },
    /// A golden pair has other lengths than the network.
    #[error(
        "golden pair {index} of the {network} network has {found:?} numbers where {expected:?} are needed (observation, \
         answer); export the model again"
    )]
    GoldenShape {
        /// Which network.
        network: &'static str,
        /// Which pair.
        index: usize,
        /// Its lengths.
        found: [usize; 2],
        /// The network's.
        expected: [usize; 2],
    },
    /// There are golden pairs of a network that the model does not have.
    #[error("the model has no dqn network, but {found} golden pairs of one; export the model again")]
    GoldenOfNone {
        /// How many there are.
        found: usize,
    },
    /// There are fewer golden pairs than a model must have, equal observations counted once.
    #[error(
        "the {network} network comes with {found} different golden pairs, at least {GOLDEN_PAIRS_MIN} are needed; \
         export the model again"
    )]
    GoldenCount {
        /// Which network.
        network: &'static str,
        /// How many there are.
        found: usize,
    },
}

/// A checked model.
#[derive(Debug)]
pub struct Model {
    folder: PathBuf,
    manifest: Manifest,
    td3: LoadedNetwork,
    dqn: Option<LoadedNetwork>,
    golden: Golden,
    golden_difference: f32,
}

impl Model {
    /// Reads and checks a model folder.
    ///
    /// # Errors
    /// The first check that fails, as a sentence that says what to do.
    pub fn read(folder: &Path) -> Result<Self, ModelError> {
        let manifest_path = folder.join(MANIFEST_FILE);
        if !manifest_path.exists() {
            let reason =
                if folder.is_dir() { "it holds no manifest.json" } else { "the folder does not exist" };
            return Err(ModelError::Missing { folder: folder.to_path_buf(), reason: reason.to_owned() });
        }
        let manifest: Manifest = parse_json(&manifest_path, &read_file(&manifest_path, MAX_JSON_BYTES)?)?;
        manifest.validate()?;
        let td3 = read_network(folder, &manifest.td3, &actor_contract())?;
        let dqn = match &manifest.dqn {
            Some(entry) => Some(read_network(folder, entry, &scorer_contract())?),
            None => None,
        };
        let golden_path = folder.join(manifest.golden.file.as_str());
        let golden = parse_json(&golden_path, &read_hashed(folder, &manifest.golden, MAX_JSON_BYTES)?)?;
        let mut model =
            Self { folder: folder.to_path_buf(), manifest, td3, dqn, golden, golden_difference: 0.0 };
        model.check_golden()?;
        Ok(model)
    }

    fn check_golden(&mut self) -> Result<(), ModelError> {
        let Self { td3, dqn, golden, golden_difference, .. } = self;
        let mut worst = compare_golden("td3", td3, &golden.td3, LOW_OBSERVATION, <[f32]>::to_vec)?;
        if let Some(dqn) = dqn {
            let expand = |observation: &[f32]| {
                let mut rows = vec![0.0; ACTION_COUNT * CANDIDATE_FEATURES];
                expand_candidates(observation, &mut rows);
                rows
            };
            worst = worst.max(compare_golden("dqn", dqn, &golden.dqn, HIGH_OBSERVATION, expand)?);
        } else if !golden.dqn.is_empty() {
            return Err(ModelError::GoldenOfNone { found: golden.dqn.len() });
        }
        *golden_difference = worst;
        Ok(())
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

/// Names and shapes of the low level: `observation` [1, 78] to `action` [1, 2].
pub fn actor_contract() -> NetworkContract {
    NetworkContract::new(Port::new("observation", 1, LOW_OBSERVATION), Port::new("action", 1, LOW_ACTION))
}

/// Names and shapes of the high level: `candidates` [18, 111] to `q` [18, 1].
pub fn scorer_contract() -> NetworkContract {
    NetworkContract::new(
        Port::new("candidates", ACTION_COUNT, CANDIDATE_FEATURES),
        Port::new("q", ACTION_COUNT, 1),
    )
}

fn read_hashed(folder: &Path, entry: &FileEntry, limit_bytes: u64) -> Result<FileBytes, ModelError> {
    let path = folder.join(entry.file.as_str());
    let file = read_file(&path, limit_bytes)?;
    let found = file.sha256_hex();
    if found == entry.sha256.as_str() {
        return Ok(file);
    }
    Err(ModelError::Hash { path, expected: entry.sha256.as_str().to_owned(), found })
}

fn read_network(
    folder: &Path,
    entry: &FileEntry,
    contract: &NetworkContract,
) -> Result<LoadedNetwork, ModelError> {
    let file = read_hashed(folder, entry, MAX_MODEL_BYTES as u64)?;
    load_network(&file.bytes, contract)
        .map_err(|source| ModelError::Network { path: folder.join(entry.file.as_str()), source })
}

fn parse_json<T: serde::de::DeserializeOwned>(path: &Path, file: &FileBytes) -> Result<T, ModelError> {
    serde_json::from_slice(&file.bytes)
        .map_err(|error| ModelError::Json { path: path.to_path_buf(), problem: error.to_string() })
}

fn compare_golden(
    name: &'static str,
    loaded: &mut LoadedNetwork,
    pairs: &[GoldenPair],
    observation_len: usize,
    input_of: impl Fn(&[f32]) -> Vec<f32>,
) -> Result<f32, ModelError> {
    let network = loaded.network_mut();
    let mut answer = vec![0.0; network.output_len()];
    let expected = [observation_len, answer.len()];
    for (index, pair) in pairs.iter().enumerate() {
        let found = [pair.observation.len(), pair.answer.len()];
        if found != expected {
            return Err(ModelError::GoldenShape { network: name, index, found, expected });
        }
    }
    let bits = |pair: &GoldenPair| pair.observation.iter().map(|value| value.to_bits()).collect();
    let different: HashSet<Vec<u32>> = pairs.iter().map(bits).collect();
    if different.len() < GOLDEN_PAIRS_MIN {
        return Err(ModelError::GoldenCount { network: name, found: different.len() });
    }
    let mut worst = 0.0_f32;
    for (index, pair) in pairs.iter().enumerate() {
        network.run(&input_of(&pair.observation), &mut answer);
        let scale = pair.answer.iter().fold(1.0_f32, |scale, golden| scale.max(golden.abs()));
        for (ours, golden) in answer.iter().zip(&pair.answer) {
            let difference = (ours - golden).abs() / scale;
            if difference.is_nan() || difference > GOLDEN_TOLERANCE {
                return Err(ModelError::Golden { network: name, index, difference });
            }
            worst = worst.max(difference);
        }
    }
    Ok(worst)
}
