//! The trainer: trains, exports, evaluates and compares navigation policies.
//!
//! Reading order: [`config`] (what a run is), [`rollout`] (robots that drive to learn), [`td3`] and [`dqn`]
//! (the two learning rules, beside their papers) on [`nn`] and [`replay`], [`train`] (the stages).

pub mod atomic_file;
pub mod checkpoint;
pub mod config;
pub mod dqn;
pub mod logs;
pub mod nn;
pub mod replay;
pub mod rollout;
pub mod seeds;
pub mod td3;
pub mod train;
