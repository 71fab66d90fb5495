//! What a run asks of a stage.

use anyhow::Result;

use super::high_stage::{HighStage, HighState};
use super::low_stage::{LowStage, LowState};
use crate::checkpoint::{Checkpoint, Contents};
use crate::logs::Status;

/// A stage as the run sees it.
pub(super) trait Stage {
    /// One round of driving and learning.
    fn round(&mut self) -> Result<()>;
    /// Whether the stage has had its share.
    fn is_finished(&self) -> bool;
    /// Why going on is in vain, if it is.
    fn collapse(&self) -> Option<String>;
    /// Whether a checkpoint can be taken now.
    fn can_save(&self) -> bool;
    /// For the progress bar.
    fn status(&self) -> Status;
    /// Adds everything that it needs to continue exactly.
    fn add_to<'a>(&'a self, contents: &mut Contents<'a>) -> Result<()>;
    /// Continues exactly from a checkpoint.
    fn restore_from(&mut self, checkpoint: &mut Checkpoint) -> Result<()>;
    /// Multiplies the learning rates.
    fn slow_down(&mut self, factor: f32);
    /// For the logs.
    fn scalars(&self) -> Vec<(&'static str, f64)>;
}

impl Stage for LowStage {
    fn round(&mut self) -> Result<()> {
        Self::round(self)
    }

    fn is_finished(&self) -> bool {
        Self::is_finished(self)
    }

    fn collapse(&self) -> Option<String> {
        Self::collapse(self)
    }

    fn can_save(&self) -> bool {
        Self::can_save(self)
    }

    fn status(&self) -> Status {
        let attempts = self.attempts();
        Status {
            position: self.env_steps(),
            steps: self.env_steps(),
            updates: self.learner().updates(),
            success: (attempts.total() > 0).then(|| attempts.success()),
        }
    }

    fn add_to<'a>(&'a self, contents: &mut Contents<'a>) -> Result<()> {
        contents.value("low", &self.state())?;
        contents.floats("replay", self.replay_rows());
        Ok(())
    }

    fn restore_from(&mut self, checkpoint: &mut Checkpoint) -> Result<()> {
        let state: LowState = checkpoint.value("low")?;
        let rows = checkpoint.take_floats("replay")?;
        self.restore(state, rows)
    }

    fn slow_down(&mut self, factor: f32) {
        self.scale_learning_rates(factor);
    }

    fn scalars(&self) -> Vec<(&'static str, f64)> {
        let losses = self.losses();
        let scalars: [(&str, f32); 10] = [
            ("low/reach", self.attempts().success()),
            ("low/collision", self.attempts().collision()),
            ("low/return", self.attempts().mean_return()),
            ("td3/critic_loss", losses.critic),
            ("td3/actor_loss", losses.actor),
            ("td3/q_mean", losses.q_mean),
            ("td3/q_max", losses.q_max),
            ("td3/critic_gradient_norm", losses.critic_gradient_norm),
            ("td3/smooth_temporal", losses.smooth_temporal),
            ("td3/saturation", losses.saturation),
        ];
        scalars.into_iter().map(|(name, value)| (name, f64::from(value))).collect()
    }
}

impl Stage for HighStage {
    fn round(&mut self) -> Result<()> {
        Self::round(self)
    }

    fn is_finished(&self) -> bool {
        Self::is_finished(self)
    }

    fn collapse(&self) -> Option<String> {
        None
    }

    fn can_save(&self) -> bool {
        true
    }

    fn status(&self) -> Status {
        let episodes = self.episodes();
        Status {
            position: self.decisions(),
            steps: self.env_steps(),
            updates: self.learner().updates(),
            success: (episodes.total() > 0).then(|| episodes.success()),
        }
    }

    fn add_to<'a>(&'a self, contents: &mut Contents<'a>) -> Result<()> {
        contents.value("high", &self.state())?;
        contents.floats("replay", self.replay_rows());
        Ok(())
    }

    fn restore_from(&mut self, checkpoint: &mut Checkpoint) -> Result<()> {
        let state: HighState = checkpoint.value("high")?;
        let rows = checkpoint.take_floats("replay")?;
        self.restore(state, rows)
    }

    fn slow_down(&mut self, factor: f32) {
        self.scale_learning_rate(factor);
    }

    fn scalars(&self) -> Vec<(&'static str, f64)> {
        let losses = self.losses();
        let scalars: [(&str, f32); 9] = [
            ("high/success", self.episodes().success()),
            ("high/collision", self.episodes().collision()),
            ("high/return", self.episodes().mean_return()),
            ("high/epsilon", self.epsilon()),
            ("dqn/loss", losses.loss),
            ("dqn/q_mean", losses.q_mean),
            ("dqn/q_max", losses.q_max),
            ("dqn/error_mean", losses.error_mean),
            ("dqn/gradient_norm", losses.gradient_norm),
        ];
        scalars.into_iter().map(|(name, value)| (name, f64::from(value))).collect()
    }
}
