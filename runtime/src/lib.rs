//! The robot side: drives with a checked model, and ticks without allocating.

pub mod bench;
pub mod bench_loop;
pub mod run;
