//! What every stage does, whatever it trains.

use anyhow::Result;

use super::learners::Learners;
use crate::checkpoint::{Checkpoint, Contents};
use crate::logs::Status;

/// Its section in a checkpoint; missing in that of a run's end, which no stage goes on from.
pub const STAGE: &str = "stage";

/// A stage under way: robots that drive, and feed the learners that it trains.
pub trait Stage {
    /// One round of driving and learning.
    ///
    /// # Errors
    /// A learner whose numbers are no longer finite.
    fn round(&mut self, learners: &mut Learners) -> Result<()>;
    /// Whether it has had its share.
    fn is_finished(&self) -> bool;
    /// Why going on is in vain, if it is.
    fn collapse(&self, learners: &Learners) -> Option<String>;
    /// Whether a checkpoint can be taken now.
    fn can_save(&self, learners: &Learners) -> bool;
    /// For the progress bar.
    fn status(&self, learners: &Learners) -> Status;
    /// For the logs.
    fn scalars(&self, learners: &Learners) -> Vec<(&'static str, f64)>;
    /// Adds everything that it needs to continue exactly, beside the learners.
    ///
    /// # Errors
    /// None in practice: a state is plain data.
    fn add_to(&self, contents: &mut Contents<'_>) -> Result<()>;
    /// Continues exactly from a checkpoint, above learners that were restored from it.
    ///
    /// # Errors
    /// A checkpoint of another configuration.
    fn restore_from(&mut self, checkpoint: &Checkpoint, learners: &mut Learners) -> Result<()>;
}
