//! Golden pairs: what the trainer's own networks answered, which this machine's executor must answer too.

use nav_core::manifest::GOLDEN_PAIRS_MIN;
use nav_core::observation::{CANDIDATE_FEATURES, HIGH_OBSERVATION, LOW_OBSERVATION, expand_candidates};
use nav_core::task::ACTION_COUNT;
use serde::{Deserialize, Serialize};
use std::collections::HashSet;

use crate::load::LoadedNetwork;

/// The largest difference between executor and golden pair, relative to the larger of one and the largest number of
/// the golden answer.
pub const GOLDEN_TOLERANCE: f32 = 1e-5;

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

/// Why golden pairs do not vouch for a model.
#[derive(Debug, thiserror::Error)]
pub enum GoldenError {
    /// A golden pair was not reproduced.
    #[error(
        "the {network} network does not reproduce its golden pair {index}: it is off by {difference:e} where \
         {GOLDEN_TOLERANCE:e} is allowed; export the model again on a machine of this kind and report it"
    )]
    Difference {
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
    Shape {
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
    OfNone {
        /// How many there are.
        found: usize,
    },
    /// There are fewer golden pairs than a model must have, equal observations counted once.
    #[error(
        "the {network} network comes with {found} different golden pairs, at least {GOLDEN_PAIRS_MIN} are needed; \
         export the model again"
    )]
    Count {
        /// Which network.
        network: &'static str,
        /// How many there are.
        found: usize,
    },
}

impl Golden {
    /// Runs every pair; returns the largest difference, relative as in [`GOLDEN_TOLERANCE`].
    ///
    /// # Errors
    /// Pairs that are too few, of another shape, of no network, or not reproduced.
    pub(super) fn check(
        &self,
        td3: &mut LoadedNetwork,
        dqn: Option<&mut LoadedNetwork>,
    ) -> Result<f32, GoldenError> {
        let worst = compare("td3", td3, &self.td3, LOW_OBSERVATION, <[f32]>::to_vec)?;
        match dqn {
            None if self.dqn.is_empty() => Ok(worst),
            None => Err(GoldenError::OfNone { found: self.dqn.len() }),
            Some(dqn) => {
                let expand = |observation: &[f32]| {
                    let mut rows = vec![0.0; ACTION_COUNT * CANDIDATE_FEATURES];
                    expand_candidates(observation, &mut rows);
                    rows
                };
                Ok(worst.max(compare("dqn", dqn, &self.dqn, HIGH_OBSERVATION, expand)?))
            }
        }
    }
}

fn compare(
    name: &'static str,
    loaded: &mut LoadedNetwork,
    pairs: &[GoldenPair],
    observation_len: usize,
    input_of: impl Fn(&[f32]) -> Vec<f32>,
) -> Result<f32, GoldenError> {
    let network = loaded.network_mut();
    let mut answer = vec![0.0; network.output_len()];
    let expected = [observation_len, answer.len()];
    for (index, pair) in pairs.iter().enumerate() {
        let found = [pair.observation.len(), pair.answer.len()];
        if found != expected {
            return Err(GoldenError::Shape { network: name, index, found, expected });
        }
    }
    let bits = |pair: &GoldenPair| pair.observation.iter().map(|value| value.to_bits()).collect();
    let different: HashSet<Vec<u32>> = pairs.iter().map(bits).collect();
    if different.len() < GOLDEN_PAIRS_MIN {
        return Err(GoldenError::Count { network: name, found: different.len() });
    }
    let mut worst = 0.0_f32;
    for (index, pair) in pairs.iter().enumerate() {
        network.run(&input_of(&pair.observation), &mut answer);
        let scale = pair.answer.iter().fold(1.0_f32, |scale, golden| scale.max(golden.abs()));
        for (ours, golden) in answer.iter().zip(&pair.answer) {
            let difference = (ours - golden).abs() / scale;
            if difference.is_nan() || difference > GOLDEN_TOLERANCE {
                return Err(GoldenError::Difference { network: name, index, difference });
            }
            worst = worst.max(difference);
        }
    }
    Ok(worst)
}
