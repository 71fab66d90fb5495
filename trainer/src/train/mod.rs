//! A run: stage A, the low level alone; stage B, the high level above the frozen low level; then the gate.
//!
//! Reading order: [`run`] (what happens when), [`low_stage`] and [`high_stage`] (the two stages), [`low_score`] and
//! [`gate`] (what must be reached), [`policy`] and [`run_folder`] (what is kept).

mod explore;
pub mod gate;
pub mod high_stage;
pub mod low_score;
pub mod low_stage;
pub mod policy;
pub mod run;
pub mod run_folder;
mod stage;
pub mod window;

#[cfg(test)]
mod tests;
