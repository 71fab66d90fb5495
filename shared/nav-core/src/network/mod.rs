//! The network executor.
