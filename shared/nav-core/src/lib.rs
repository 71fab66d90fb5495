//! Floor 0: everything the robot computes in one control tick.
//!
//! Nothing here allocates, reads a clock or touches the outside: time is a value that the caller passes
//! ([`messages::Header::stamp_ns`]), memory is of fixed size. The trainer, the simulator and the runtime
//! all call this crate, so there is one observation, one reward, one set of metrics and one way of acting.
//!
//! Reading order: [`messages`] (what goes over the wire) and [`task`] (what a policy was trained for, and on
//! which robot: [`footprint`], [`scale`]), then [`scan`] → [`local_map`] → [`optimistic`] → [`subgoal`] → [`observation`] (what a policy sees), [`navigator`]
//! (when it decides), [`tracker`] (who moves around it), [`network`] (how it is evaluated), [`shield`] (as [`shielding`] lets
//! drivers use it) and [`guard`] (what may leave),
//! [`tick`] and [`controller`] (all of it), [`run_state`] (what it is doing), [`driver_guard`] (what the base obeys);
//! [`reward`] and [`metrics`] judge the result, [`manifest`] says what a model is, [`testing`] makes up messages.
#![no_std]

pub mod twist;
pub mod geometry;
pub mod messages;
pub mod topics;
pub mod footprint;
pub mod task;
pub mod scale;

pub mod scan;
mod history;
mod closing;
pub mod local_map;
pub mod optimistic;
pub mod subgoal;
pub mod observation;
pub mod sent;
pub mod navigator;
pub mod tracker;

pub mod network;
pub mod shield;
pub mod guard;
pub mod shielding;
pub mod tick;
pub mod controller;
pub mod run_state;
pub mod driver_guard;

pub mod reward;
pub mod metrics;
pub mod manifest;
pub mod testing;
