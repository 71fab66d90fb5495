//! Floor 3: the classical rivals of the learned policies, driven by the same loop in the same worlds.
//!
//! Reading order: `follow` (the steering that all share), [`planner`] (knows the map), [`reactive`] (knows the
//! newest scan).

mod follow;

pub mod planner;
pub mod reactive;
