//! The robot side: drives with a checked model, and ticks without allocating.
//!
//! Reading order: [`run`] (driving), [`latency`] (how long things took), [`mod@bench`] (the networks alone),
//! [`bench_loop`] (the loop between two processes).

pub mod model;
pub mod run;

pub mod latency;

pub mod bench;
pub mod bench_loop;
