//! How many ticks of the control period what happens now and then is apart.

use crate::scale::Scale;
use crate::task::Task;

/// The map takes a scan each so often, s of the reference robot ([`Scale`]).
const MAP_EVERY_S: f32 = 0.2;

/// What happens each so many ticks, and lasts so many.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rhythm {
    /// A step of what the policy sees of the commands.
    pub(super) step: u32,
    /// From one scan that the map takes to the next.
    pub(super) map: u32,
    /// From one visit that the map takes note of to the next.
    pub(super) visit: u32,
    /// What a visit stands for, steps of 0.1 s of the reference robot.
    pub(super) visit_steps: f32,
}

impl Rhythm {
    pub(super) fn new(task: &Task, scale: &Scale) -> Self {
        let step = task.ticks(scale.step_s());
        let visit_steps = step as f32 * task.step_share();
        Self { step, map: task.ticks(scale.s(MAP_EVERY_S)), visit: step, visit_steps }
    }
}
