//! Floor 0: everything the robot computes in one control tick.
//!
//! Nothing here allocates, reads a clock or touches the outside: time is a value that the caller passes
//! ([`messages::Header::stamp_ns`]), memory is of fixed size. The trainer, the simulator and the runtime
//! all call this crate, so there is one observation, one reward, one set of metrics and one way of acting.
//!
//! Reading order: [`messages`] (what goes over the wire) and [`task`] (what a policy was trained for), then
//! [`scan`] → [`local_map`] → [`optimistic`] → [`subgoal`] → [`observation`] (what a policy sees), [`navigator`]
//! (when it decides), [`network`] (how it is evaluated), [`guard`] (what may leave), [`tick`] and [`controller`]
//! (all of it: the tick); [`reward`] and [`metrics`] judge the result, [`manifest`] says what a model is.
#![no_std]

pub mod geometry;
pub mod messages;
pub mod task;
pub mod topics;
pub mod twist;

mod closing;
pub mod optimistic;
pub mod local_map;
pub mod navigator;
pub mod observation;
pub mod scan;
pub mod subgoal;

pub mod controller;
pub mod guard;
pub mod driver_guard;
pub mod network;
pub mod tick;

pub mod manifest;
pub mod metrics;
pub mod reward;
