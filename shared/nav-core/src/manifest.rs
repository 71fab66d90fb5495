//! The manifest beside the ONNX files: what a model was trained for, and the proof that it is what it says.

use crate::observation::{CANDIDATE_FEATURES, HIGH_OBSERVATION, LAYOUT, LOW_OBSERVATION};
use crate::task::{ACTION_COUNT, Task};
use heapless::{String, Vec};
use serde::{Deserialize, Serialize};

/// Version of the manifest format that this build reads and writes.
pub const MANIFEST_FORMAT: u32 = 3;
/// File name of the manifest within a model folder.
pub const MANIFEST_FILE: &str = "manifest.json";
/// File name of a signature of the manifest, where somebody signed it: minisign's.
pub const SIGNATURE_FILE: &str = "manifest.json.minisig";
/// The fewest golden pairs a network must come with.
pub const GOLDEN_PAIRS_MIN: usize = 32;

/// A short text.
pub type Text = String<128>;
/// A lower-case hexadecimal SHA-256.
pub type Sha256Hex = String<64>;

/// What kind of policy a model is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Algorithm {
    /// A DQN that chooses subgoals above a TD3 that drives to them.
    Hybrid,
    /// A TD3 that drives straight at the goal.
    Td3,
}

/// A file of the model folder.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FileEntry {
    /// Name within the folder: no path.
    pub file: Text,
    /// SHA-256 of its bytes.
    pub sha256: Sha256Hex,
}

/// How a policy did on held-out worlds of a family.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EvaluationRow {
    /// The family.
    pub family: Text,
    /// Worlds driven.
    pub worlds: u32,
    /// Share that reached the goal.
    pub success: f32,
    /// Share that collided.
    pub collision: f32,
    /// Share that ran out of time.
    pub timeout: f32,
}

/// What a model is, as `manifest.json` says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// [`MANIFEST_FORMAT`].
    pub format: u32,
    /// What kind of policy this is.
    pub algorithm: Algorithm,
    /// Version of the trainer.
    pub trainer_version: Text,
    /// Commit of the trainer, or `unknown`.
    pub trainer_commit: Text,
    /// Training seed.
    pub seed: u64,
    /// Profile of the training.
    pub profile: Text,
    /// The profile of the robot that it was trained for, where one was named; `task` has all of it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub robot: Option<Text>,
    /// SHA-256 of the training configuration.
    pub config_sha256: Sha256Hex,
    /// [`LAYOUT`]: what the numbers of the observations mean.
    pub observation_layout: String<320>,
    /// Lengths of the low-level and high-level observation and of a candidate's row.
    pub observation_lengths: [usize; 3],
    /// Actions of the high level.
    pub action_count: usize,
    /// Units of every number.
    pub units: Text,
    /// Frames of every pose.
    pub frames: Text,
    /// How the high level's values become a choice.
    pub decision_rule: Text,
    /// Where observations are normalised.
    pub normalisation: Text,
    /// What the policy was trained for.
    pub task: Task,
    /// Families it was trained on.
    pub training_families: Vec<Text, 16>,
    /// The low-level network.
    pub td3: FileEntry,
    /// The high-level network; absent in a flat policy.
    pub dqn: Option<FileEntry>,
    /// Golden pairs of every network.
    pub golden: FileEntry,
    /// Files that hold weights of the networks, where an exporter kept them apart (ONNX external data); this project's
    /// trainer never does.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub data: Vec<FileEntry, 4>,
    /// How it did, in process, with the exported weights.
    pub evaluation: Vec<EvaluationRow, 32>,
}

/// Why a manifest cannot be used by this build.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ManifestError {
    /// Another format version.
    Format(u32),
    /// Another observation layout.
    Layout,
    /// A task with a field out of range.
    Task(&'static str),
    /// Hybrid without a high-level network, or flat with one.
    Networks,
    /// A file name that is not a plain name.
    FileName,
}

impl core::fmt::Display for ManifestError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Format(found) => write!(
                f,
                "the manifest has format {found}, this build reads format {MANIFEST_FORMAT}: export the run \
                 again with this version's trainer"
            ),
            Self::Layout => f.write_str(
                "the model was trained on another observation layout than this build encodes: train and export one \
                 with this version, or run it with the version that exported it",
            ),
            Self::Task(sentence) => write!(f, "the manifest's task makes no sense: {sentence}"),
            Self::Networks => {
                f.write_str("a hybrid model needs a td3 and a dqn network, a flat one only td3: export it again")
            }
            Self::FileName => {
                f.write_str("the manifest names a file that is not a plain name in its own folder: refused")
            }
        }
    }
}

impl core::error::Error for ManifestError {}

impl Manifest {
    /// The lengths of this build's observation layout.
    pub const LENGTHS: [usize; 3] = [LOW_OBSERVATION, HIGH_OBSERVATION, CANDIDATE_FEATURES];

    /// Whether this build can drive with the model.
    ///
    /// # Errors
    /// The first mismatch, as a sentence that says what to do.
    pub fn validate(&self) -> Result<(), ManifestError> {
        if self.format != MANIFEST_FORMAT {
            return Err(ManifestError::Format(self.format));
        }
        if self.observation_layout != LAYOUT
            || self.observation_lengths != Self::LENGTHS
            || self.action_count != ACTION_COUNT
        {
            return Err(ManifestError::Layout);
        }
        self.task.validate().map_err(ManifestError::Task)?;
        if (self.algorithm == Algorithm::Hybrid) != self.dqn.is_some() {
            return Err(ManifestError::Networks);
        }
        let mut files = [&self.td3, &self.golden].into_iter().chain(&self.dqn).chain(&self.data);
        if files.any(|entry| !is_plain_name(&entry.file)) {
            return Err(ManifestError::FileName);
        }
        Ok(())
    }
}

fn is_plain_name(name: &str) -> bool {
    !name.is_empty() && name != "." && name != ".." && !name.contains(['/', '\\', '\0'])
}
