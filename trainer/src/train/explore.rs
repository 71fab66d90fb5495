//! Exploration of stage A.

use nav_core::observation::LOW_ACTION;
use nav_sim::normal::standard_normal;

use crate::config::LowConfig;
use crate::nn::Rng;

/// Independent normal noise, its strength spread over the robots and halved in the course of
/// the stage.
pub(super) fn explore(
    config: &LowConfig,
    robot: usize,
    progress: f32,
    action: [f32; LOW_ACTION],
    rng: &mut Rng,
) -> [f32; LOW_ACTION] {
    let [least, most] = config.noise;
    let place = if config.envs > 1 { robot as f32 / (config.envs - 1) as f32 } else { 0.5 };
    let sigma = (least + (most - least) * place) * (1.0 - 0.5 * progress);
    action.map(|value| (value + sigma * standard_normal(rng)).clamp(-1.0, 1.0))
}
