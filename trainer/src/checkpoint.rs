//! Training state on disk: whole or not there, checked when read, and never only in one copy.
//!
//! A checkpoint is one file: a header (magic, version, step, number of sections, length of the body), the
//! sections, and a CRC-32 of everything before it. A section is a name and either a value in `postcard` or a
//! slice of `f32` (weights, replay rows), all little-endian. What goes into the sections is the business of
//! who writes them.
//!
//! | file | holds |
//! |---|---|
//! | `format` | the bytes of one file: [`Contents`] out, [`Checkpoint`] in |
//! | `load_error` | what can be wrong with one: [`LoadError`] |
//! | `store` | a folder of them: [`CheckpointStore`] keeps the newest three |

mod format;
mod load_error;
mod store;

pub use format::{Checkpoint, Contents};
pub use load_error::LoadError;
pub use store::{CheckpointStore, Newest, SaveError};
