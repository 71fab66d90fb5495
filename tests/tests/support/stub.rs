//! A controller without networks, for what the loop around it does.

use nav_core::messages::{CmdVel, Header};
use nav_core::task::Task;
use nav_core::tick::{Inputs, Tick, TickStatus};

/// Commands what a function says: from the number of the tick, counted from one, to m/s and rad/s.
pub struct Stub<F> {
    task: Task,
    /// Ticks so far.
    pub ticks: u64,
    velocity: F,
}

impl<F: FnMut(u64) -> (f32, f32)> Stub<F> {
    pub fn new(velocity: F) -> Self {
        Self { task: Task::default(), ticks: 0, velocity }
    }
}

impl<F: FnMut(u64) -> (f32, f32)> Tick for Stub<F> {
    fn tick(&mut self, now_ns: u64, inputs: Inputs<'_>) -> (CmdVel, TickStatus) {
        self.ticks += 1;
        let (linear_mps, angular_radps) = (self.velocity)(self.ticks);
        let header = Header { stamp_ns: now_ns, seq: self.ticks };
        let scan_seq = inputs.scan.header.seq;
        (CmdVel { header, scan_seq, linear_mps, angular_radps, ..CmdVel::default() }, TickStatus::default())
    }

    fn task(&self) -> &Task {
        &self.task
    }
}
