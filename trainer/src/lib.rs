//! The trainer: trains, exports, evaluates and compares navigation policies.
//!
//! Reading order: [`config`] (what a run is), [`rollout`] (robots that drive to learn), [`td3`] and [`dqn`]
//! (the two learning rules, beside their papers) on [`nn`] and [`replay`], [`train`] (the stages), [`export`] (the
//! ONNX files, written and verified), [`evaluate`] (the proof).

pub mod cli;
pub mod commands;
pub mod config;

pub mod rollout;
pub mod train;

pub mod dqn;
pub mod nn;
pub mod replay;
pub mod td3;

pub mod evaluate;
pub mod export;
pub mod onnx;

pub mod atomic_file;
pub mod checkpoint;
pub mod commit;
pub mod logs;
pub mod seeds;
pub mod sha256;
pub mod stop;
