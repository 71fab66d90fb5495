//! Exploration of a low level.

use nav_core::observation::LOW_ACTION;
use serde::{Deserialize, Serialize};

/// What was drawn, for as many ticks as it is held: a base does not follow what changes faster than the step that exploration
/// was chosen for ([`nav_core::scale`]).
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(super) struct Held {
    drawn: [f32; LOW_ACTION],
    ticks_left: u32,
}

impl Held {
    /// What is held in this tick; drawn anew each `ticks`.
    pub(super) fn next(&mut self, ticks: u32, mut draw: impl FnMut() -> f32) -> [f32; LOW_ACTION] {
        if self.ticks_left == 0 {
            *self = Self { drawn: std::array::from_fn(|_| draw()), ticks_left: ticks };
        }
        self.ticks_left -= 1;
        self.drawn
    }
}

/// Independent normal noise, its strength spread over the robots from `least` to `most` and halved in the course of
/// the stage, on an action; `noise` is standard normal, `(robot, robots)` is which robot of how many.
pub(super) fn explore(
    [least, most]: [f32; 2],
    (robot, robots): (usize, usize),
    progress: f32,
    action: [f32; LOW_ACTION],
    noise: [f32; LOW_ACTION],
) -> [f32; LOW_ACTION] {
    let place = if robots > 1 { robot as f32 / (robots - 1) as f32 } else { 0.5 };
    let sigma = (least + (most - least) * place) * (1.0 - 0.5 * progress);
    std::array::from_fn(|index| (action[index] + sigma * noise[index]).clamp(-1.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_drawn_is_held_for_its_ticks() {
        let draws = |ticks: u32| {
            let (mut held, mut drawn) = (Held::default(), 0_u8);
            let mut draw = || {
                drawn += 1;
                f32::from(drawn)
            };
            (0..6).map(|_| held.next(ticks, &mut draw)[1] as u8).collect::<Vec<_>>()
        };
        assert_eq!(draws(1), [2, 4, 6, 8, 10, 12]);
        assert_eq!(draws(3), [2, 2, 2, 4, 4, 4]);
    }
}
