//! Floor 1: trained models. A model folder is untrusted input; what comes out of it is checked, and runs
//! without touching the heap.
//!
//! Reading order: [`load`] (from ONNX bytes to a network), [`model`] (a folder: manifest, networks, golden
//! pairs), [`check`] (what was verified, a line each), [`alloc`] (the allocator that proves the rest).

pub mod load;

pub mod model;

pub mod check;

pub mod alloc;
