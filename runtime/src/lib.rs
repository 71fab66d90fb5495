//! The robot side: loads a model, checks it, and ticks without allocating.

pub mod alloc;
pub mod bench;
pub mod bench_loop;
pub mod check;
pub mod load;
pub mod model;
pub mod run;
pub mod terminal;
