//! Floor 0: what every program needs of the machine that it runs on. Knows nothing of robots.
//!
//! Reading order: [`stop`] (asked to end by a signal), [`exit`] (with which code), [`terminal`] (what people
//! read), `manual` (completions and manual pages, a feature), [`files`] (whole or as they were), [`sha256`], [`cpu`]
//! (what figures were measured on).

pub mod stop;

pub mod exit;

pub mod terminal;

#[cfg(feature = "manual")]
pub mod manual;

pub mod files;

pub mod sha256;

pub mod cpu;
