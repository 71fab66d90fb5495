//! What several tests drive with.

use nav_core::network::{Activation, CpuLevel, Layer, MlpSpec, MlpWeights, Network};
use nav_core::observation::{LOW_ACTION, LOW_OBSERVATION};
use nav_core::scan::SECTOR_COUNT;
use nav_env::ActingNetwork;

/// A low level that drives straight at its target: fast when it lies ahead, and turning towards it.
pub(crate) fn homing() -> ActingNetwork {
    let mut weights = vec![0.0; LOW_ACTION * LOW_OBSERVATION];
    let (sin, cos) = (2 * SECTOR_COUNT + 2, 2 * SECTOR_COUNT + 3);
    weights[cos] = 2.0;
    weights[LOW_OBSERVATION + sin] = 2.0;
    let layers = [Layer { weights: &weights, bias: &[-0.5, 0.0] }];
    let level = CpuLevel::detect();
    let shape = MlpSpec::new(&[LOW_OBSERVATION, LOW_ACTION]).expect("two sizes").output(Activation::Tanh);
    let spec = shape.spec(&MlpWeights::new(&layers)).expect("the weights fit");
    Network::new(&spec, vec![0.0; spec.memory_len(level)], level).expect("a small network")
}
