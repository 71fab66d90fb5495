//! Scenes with a known truth.

use super::*;

mod scene;
mod walkers;
mod standing;
mod bookkeeping;
mod anything;
