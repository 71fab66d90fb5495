//! The stages of a run: A, the low level alone; B, the high level above the frozen low level.

pub mod high_stage;
pub mod low_stage;
pub mod window;
