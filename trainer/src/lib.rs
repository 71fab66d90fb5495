//! The trainer: trains, exports, evaluates and compares navigation policies.
//!
//! Reading order: [`config`] (what a run is), [`td3`] and [`dqn`] (the two learning rules, beside their papers) on
//! [`nn`] and [`replay`], [`acting`] (networks as the robot runs them), [`train`] (the stages, over the robots of
//! [`nav_env`]), [`export`] (the ONNX files, written and verified), [`evaluate`] (the proof).

pub mod cli;
pub mod commands;
pub mod config;

pub mod acting;
pub mod train;

pub mod dqn;
pub mod nn;
pub mod replay;
pub mod td3;

pub mod evaluate;
pub mod export;
pub mod onnx;

pub mod checkpoint;
pub mod commit;
pub mod logs;
