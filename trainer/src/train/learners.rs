//! The learners of a run. They outlive its stages: a stage drives robots and feeds those that it trains.

use anyhow::{Context, Result};
use nav_core::manifest::Algorithm;

use super::high_learner::{HighLearner, HighLearnerState};
use super::low_learner::{LowLearner, LowLearnerState};
use super::plan::{Learns, StagePlan};
use super::policy::{Policy, Weights};
use crate::checkpoint::{Checkpoint, Contents};
use crate::config::Config;

/// The learners of a run.
pub struct Learners {
    /// The low level.
    pub low: LowLearner,
    /// The high level; none in a flat policy.
    pub high: Option<HighLearner>,
}

impl Learners {
    /// Fresh learners, the low level with the actor of a borrowed policy if there is one.
    ///
    /// # Errors
    /// Networks that the executor cannot hold, or damaged weights of the borrowed policy.
    pub fn new(config: &Config, borrowed: Option<&Policy>) -> Result<Self> {
        let low = match borrowed {
            None => LowLearner::new(config)?,
            Some(policy) => LowLearner::of_policy(config, policy)?,
        };
        let high = (config.algorithm == Algorithm::Hybrid).then(|| HighLearner::new(config)).transpose()?;
        Ok(Self { low, high })
    }

    /// The high level of a run that has one.
    ///
    /// # Errors
    /// A flat policy.
    pub fn high(&self) -> Result<&HighLearner> {
        self.high.as_ref().context("a flat policy has no high level: this is a defect")
    }

    /// Gives back the memory of learners that none of these stages trains.
    pub fn rest(&mut self, later: &[StagePlan]) {
        let learns = |what| later.iter().any(|stage| stage.learns == what);
        if !learns(Learns::Low) {
            self.low.rest();
        }
        if let Some(high) = self.high.as_mut().filter(|_| !learns(Learns::High)) {
            high.rest();
        }
    }

    /// Multiplies the learning rates of what a stage trains, after a divergence.
    pub fn slow_down(&mut self, learns: Learns, factor: f32) {
        match learns {
            Learns::Low => self.low.slow_down(factor),
            Learns::High => {
                if let Some(high) = &mut self.high {
                    high.slow_down(factor);
                }
            }
        }
    }

    /// The high level's weights, if there is one.
    pub fn scorer(&self) -> Option<Weights> {
        self.high.as_ref().map(|high| Weights::of(high.learner().scorer()))
    }

    /// Updates of all.
    pub fn updates(&self) -> u64 {
        self.low.learner().updates() + self.high.as_ref().map_or(0, |high| high.learner().updates())
    }

    /// Adds everything that they need to continue exactly.
    ///
    /// # Errors
    /// None in practice: a state is plain data.
    pub fn add_to<'a>(&'a self, contents: &mut Contents<'a>) -> Result<()> {
        contents.value("low", &self.low.state())?;
        contents.floats("low_replay", self.low.replay_rows());
        if let Some(high) = &self.high {
            contents.value("high", &high.state())?;
            contents.floats("high_replay", high.replay_rows());
        }
        Ok(())
    }

    /// Continues exactly from a checkpoint.
    ///
    /// # Errors
    /// A checkpoint of another configuration.
    pub fn restore_from(&mut self, checkpoint: &mut Checkpoint) -> Result<()> {
        let state: LowLearnerState = checkpoint.value("low")?;
        let rows = checkpoint.take_floats("low_replay")?;
        self.low.restore(state, rows)?;
        if let Some(high) = &mut self.high {
            let state: HighLearnerState = checkpoint.value("high")?;
            let rows = checkpoint.take_floats("high_replay")?;
            high.restore(state, rows)?;
        }
        Ok(())
    }
}
