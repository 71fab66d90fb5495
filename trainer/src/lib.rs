//! The trainer: trains, exports, evaluates and compares navigation policies.
//!
//! Reading order: [`config`] (what a run is), [`td3`] and [`dqn`] (the two learning rules, beside their papers) on
//! [`nn`] and [`replay`], [`acting`] (networks as the robot runs them), [`train`] (the stages, over the robots of
//! [`nav_env`]) with [`checkpoint`] and [`logs`], [`export`] (the [`onnx`] files, written and verified), [`evaluate`] (the
//! proof). [`cli`] and [`commands`] are the way in.

pub mod cli;
pub mod commands;
pub mod config;

pub mod td3;
pub mod dqn;
pub mod nn;
pub mod replay;

pub mod acting;
pub mod train;
pub mod checkpoint;
pub mod logs;
pub mod commit;

pub mod export;
pub mod onnx;
pub mod evaluate;
