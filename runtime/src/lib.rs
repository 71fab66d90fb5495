//! The robot side: loads a model, checks it, and ticks without allocating.

pub mod alloc;
pub mod load;
pub mod model;
