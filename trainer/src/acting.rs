//! The learners' networks, as the robot runs them: packed for the executor, so that what is trained acts
//! through the same code as what ships.

use nav_core::network::{Activation as Act, CpuLevel, Layer, MlpSpec, MlpWeights, Network, NetworkError};
use nav_core::observation::LOW_OBSERVATION;
use serde::{Deserialize, Serialize};

use crate::nn::{Activation, Mlp};

/// A network for acting, with its own memory.
pub type ActingNetwork = Network<Vec<f32>>;

/// How observations are normalised before the first layer: `(x - mean) * inverse_deviation`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Normaliser {
    /// One number a feature.
    pub mean: Vec<f32>,
    /// One number a feature.
    pub inverse_deviation: Vec<f32>,
}

impl Normaliser {
    /// Deviations below this are noise that must not be blown up.
    const DEVIATION_MIN: f32 = 0.05;

    /// Leaves a low-level observation as it is.
    pub fn identity() -> Self {
        Self { mean: vec![0.0; LOW_OBSERVATION], inverse_deviation: vec![1.0; LOW_OBSERVATION] }
    }

    /// From observations, side by side.
    pub fn of(observations: &[f32], width: usize) -> Self {
        let rows = (observations.len() / width).max(1) as f64;
        let (mut sum, mut squares) = (vec![0.0_f64; width], vec![0.0_f64; width]);
        for row in observations.chunks_exact(width) {
            for (feature, &value) in row.iter().enumerate() {
                sum[feature] += f64::from(value);
                squares[feature] += f64::from(value) * f64::from(value);
            }
        }
        let mean: Vec<f32> = sum.iter().map(|sum| (sum / rows) as f32).collect();
        let inverse = |(feature, mean): (usize, &f32)| {
            let variance = squares[feature] / rows - f64::from(*mean) * f64::from(*mean);
            1.0 / (variance.max(0.0).sqrt() as f32).max(Self::DEVIATION_MIN)
        };
        Self { inverse_deviation: mean.iter().enumerate().map(inverse).collect(), mean }
    }

    /// Normalises one observation in place.
    pub fn apply(&self, observation: &mut [f32]) {
        for ((value, mean), inverse) in observation.iter_mut().zip(&self.mean).zip(&self.inverse_deviation) {
            *value = (*value - mean) * inverse;
        }
    }
}

/// Packs a learner's network for acting on raw observations, `rows` at a time.
///
/// # Errors
/// A network deeper than the executor takes, or a normaliser of another width.
///
/// # Panics
/// For a layer-normalised network: no policy here is one.
pub fn pack(mlp: &Mlp, normaliser: Option<&Normaliser>, rows: usize) -> Result<ActingNetwork, NetworkError> {
    with_spec(mlp, normaliser, rows, |spec| {
        let level = CpuLevel::detect();
        Network::new(spec, vec![0.0; spec.memory_len(level)], level)
    })
}

/// Packs new weights of the same shape into a network.
///
/// # Errors
/// As [`pack`], and for a network of another shape.
pub fn repack(
    network: &mut ActingNetwork,
    mlp: &Mlp,
    normaliser: Option<&Normaliser>,
    rows: usize,
) -> Result<(), NetworkError> {
    with_spec(mlp, normaliser, rows, |spec| network.repack(spec))
}

fn with_spec<T>(
    mlp: &Mlp,
    normaliser: Option<&Normaliser>,
    rows: usize,
    use_spec: impl FnOnce(&nav_core::network::NetworkSpec<'_>) -> Result<T, NetworkError>,
) -> Result<T, NetworkError> {
    let layers: Vec<_> = mlp
        .layers()
        .map(|dense| {
            assert!(dense.norm.is_none(), "only critics are layer-normalised, and critics do not act");
            Layer { weights: dense.weight, bias: dense.bias }
        })
        .collect();
    let output = match mlp.shape().output {
        Activation::Identity => Act::Identity,
        Activation::Tanh => Act::Tanh,
    };
    let mut weights = MlpWeights::new(&layers);
    if let Some(normaliser) = normaliser {
        weights = weights.normalisation(&normaliser.mean, &normaliser.inverse_deviation);
    }
    let shape = MlpSpec::new(&mlp.shape().sizes)?.hidden(Act::Relu).output(output).rows(rows);
    use_spec(&shape.spec(&weights)?)
}

#[cfg(test)]
mod tests {
    use nav_core::observation::mirror_low;

    use super::*;

    #[test]
    fn of_scenes_and_their_mirror_images_it_commutes_with_mirroring() {
        let mut observations: Vec<f32> =
            (0..3 * LOW_OBSERVATION).map(|at| ((at * at) as f32 * 0.37).sin() + 0.4).collect();
        let mut mirrored = observations.clone();
        mirrored.chunks_exact_mut(LOW_OBSERVATION).for_each(mirror_low);
        observations.extend(mirrored);
        let normaliser = Normaliser::of(&observations, LOW_OBSERVATION);
        let mut first = observations[..LOW_OBSERVATION].to_vec();
        let mut second = first.clone();
        normaliser.apply(&mut first);
        mirror_low(&mut first);
        mirror_low(&mut second);
        normaliser.apply(&mut second);
        for (first, second) in first.iter().zip(second) {
            assert!((first - second).abs() < 1e-5, "{first} {second}");
        }
    }
}
