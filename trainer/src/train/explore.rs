//! Exploration of a low level.

use nav_core::observation::LOW_ACTION;
use nav_sim::normal::standard_normal;

use crate::nn::Rng;

/// Independent normal noise, its strength spread over the robots from `least` to `most` and halved in the course of
/// the stage; `(robot, robots)` is which robot of how many.
pub(super) fn explore(
    [least, most]: [f32; 2],
    (robot, robots): (usize, usize),
    progress: f32,
    action: [f32; LOW_ACTION],
    rng: &mut Rng,
) -> [f32; LOW_ACTION] {
    let place = if robots > 1 { robot as f32 / (robots - 1) as f32 } else { 0.5 };
    let sigma = (least + (most - least) * place) * (1.0 - 0.5 * progress);
    action.map(|value| (value + sigma * standard_normal(rng)).clamp(-1.0, 1.0))
}
