//! A run: stages over shared learners, then the gate.
//!
//! Reading order: [`plan`] (the stages as data), [`learners`] with [`low_learner`] and [`high_learner`] (what outlives
//! a stage), [`stage`] (what every stage does) with [`low_stage`] and [`high_stage`] (the robots that drive in one) and
//! [`window`] and [`trail`] (what is told of their driving), [`run`] (what happens when), [`low_score`], [`gate`]
//! and [`verdict`] (what must be reached), [`curve`] (how it does meanwhile), [`policy`], [`past`] and [`run_folder`] (what is kept), [`going_on`] (what
//! comes after the end: another attempt, or more steps).

pub mod plan;
pub mod learners;
pub mod low_learner;
pub mod high_learner;
pub mod stage;
pub mod low_stage;
mod explore;
pub mod high_stage;
pub mod window;
pub mod trail;
pub mod run;
pub mod low_score;
pub mod gate;
pub mod verdict;
pub mod curve;
pub mod past;
pub mod policy;
pub mod run_folder;
pub mod going_on;

#[cfg(test)]
mod tests;
