//! Floor 0: everything the robot computes in one control tick.
//!
//! Nothing here allocates, reads a clock or touches the outside: time is a value that the caller passes
//! ([`messages::Header::stamp_ns`]), memory is of fixed size. The trainer, the simulator and the runtime
//! all call this crate, so there is one observation, one reward, one set of metrics and one way of acting.
//!
//! Reading order: [`messages`] (what goes over the wire) and [`task`] (what a policy was trained for), then
//! [`scan`] → [`local_map`] → [`subgoal`] → [`observation`] (what a policy sees), [`network`] (how it is
//! evaluated), [`navigator`] (when it decides), [`guard`] (what may leave), [`controller`] (all of it: the
//! tick); [`reward`] and [`metrics`] judge the result.
#![no_std]

pub mod geometry;
pub mod messages;
pub mod network;
pub mod task;
pub mod topics;
