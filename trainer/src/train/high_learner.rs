//! DQN with what goes around it: the replay buffer, and the network that acts.

use anyhow::{Context, Result, ensure};
use nav_core::observation::{
    CANDIDATE_FEATURES, HIGH_OBSERVATION, expand_candidates, mirror_high, mirror_high_action,
};
use nav_core::task::ACTION_COUNT;
use nav_env::ActingNetwork;
use nav_env::batch::STACK_BYTES;
use nav_env::high::HighTransition;
use nav_env::seeds::derive;
use rand::SeedableRng;
use serde::{Deserialize, Serialize};
use std::sync::{Mutex, PoisonError};
use std::thread::{Builder, ScopedJoinHandle};

use super::low_learner::OTHER;
use crate::acting::{pack, repack};
use crate::config::{Config, HighConfig};
use crate::dqn::{Candidates, Decision, DecisionBatch, Dqn, DqnLosses, DqnState, Mirror};
use crate::nn::Rng;
use crate::replay::{ReplayBuffer, ReplayPosition};

/// The learner's and the executor's view of a decision.
pub const CANDIDATES: Candidates = Candidates {
    observation: HIGH_OBSERVATION,
    count: ACTION_COUNT,
    width: CANDIDATE_FEATURES,
    expand: expand_candidates,
};
/// A decision in the mirror image.
const MIRROR: Mirror = Mirror { observation: mirror_high, candidate: mirror_high_action };
/// Values in a row of the replay buffer.
const ROW: usize = Decision::row_length(HIGH_OBSERVATION);

/// The high level as it learns.
pub struct HighLearner {
    config: HighConfig,
    learner: Dqn,
    replay: ReplayBuffer,
    /// Decisions ever taken for it.
    decisions: u64,
    sampler: Rng,
    batch: DecisionBatch,
    acting: ActingNetwork,
    losses: DqnLosses,
    rate_factor: f32,
}

/// Everything that a checkpoint keeps of it but the replay buffer's rows.
#[derive(Serialize, Deserialize)]
pub struct HighLearnerState {
    learner: DqnState,
    replay: ReplayPosition,
    decisions: u64,
    sampler: Rng,
    losses: DqnLosses,
    rate_factor: f32,
}

impl HighLearner {
    /// A learner that has seen nothing.
    ///
    /// # Errors
    /// A network that the executor cannot hold, or a replay buffer that the machine cannot.
    pub fn new(config: &Config) -> Result<Self> {
        let high = &config.high;
        let learner = Dqn::new(CANDIDATES, high.dqn.clone(), derive(config.seed, 3));
        Ok(Self {
            acting: pack(learner.scorer(), None, ACTION_COUNT)?,
            learner,
            replay: ReplayBuffer::try_new(high.replay_capacity, ROW)
                .context("no memory for the replay buffer: lower high.replay_capacity")?,
            decisions: 0,
            sampler: Rng::seed_from_u64(derive(config.seed, 4)),
            batch: DecisionBatch::new(high.batch, HIGH_OBSERVATION)
                .with_mirror(high.mirror.then_some(MIRROR)),
            losses: DqnLosses::default(),
            rate_factor: 1.0,
            config: high.clone(),
        })
    }

    /// Makes the updates that are due after the decisions so far, while `drive` runs on another thread with the
    /// network that acts. The learning rate falls with the stage's `progress`, 0 to 1.
    ///
    /// Which round is learned from which does not depend on time, so that a run repeats exactly.
    ///
    /// # Errors
    /// Numbers that are no longer finite.
    pub fn learn_beside<T: Send>(
        &mut self,
        progress: f32,
        drive: impl FnOnce(&mut ActingNetwork) -> T + Send,
    ) -> Result<T> {
        let start = self.config.dqn.learning_rate;
        let rate = start + (self.config.final_learning_rate - start) * progress.min(1.0);
        self.learner.set_learning_rate(rate * self.rate_factor);
        let due = self.decisions.saturating_sub(self.config.warmup_decisions)
            / u64::from(self.config.decisions_per_update);
        let Self { acting, learner, batch, replay, sampler, losses, .. } = self;
        // Whoever comes first: the thread, or this one where the system has none to spare.
        let job = Mutex::new(Some(|| drive(acting)));
        let take = || job.lock().unwrap_or_else(PoisonError::into_inner).take();
        let driven = std::thread::scope(|scope| {
            let driving =
                Builder::new().stack_size(STACK_BYTES).spawn_scoped(scope, || take().map(|drive| drive()));
            while learner.updates() < due {
                batch.sample(replay, sampler);
                *losses = learner.update(batch);
            }
            driving.map_or_else(|_| Ok(take().map(|drive| drive())), ScopedJoinHandle::join)
        });
        let driven = driven.ok().flatten().context("a robot's thread panicked: this is a defect")?;
        ensure!(
            self.losses.is_sane(),
            "the high level diverged after {} updates (a loss or value has exploded): try a lower \
             high.dqn.learning_rate",
            self.learner.updates()
        );
        Ok(driven)
    }

    /// Takes in what a round of driving brought, and acts with the newest weights from now on.
    ///
    /// # Errors
    /// None in practice: the network keeps its shape.
    pub fn take_in(&mut self, decisions: u64, transitions: &[HighTransition]) -> Result<()> {
        self.decisions += decisions;
        for transition in transitions {
            Decision {
                observation: &transition.observation,
                action: transition.action as u32,
                reward: transition.reward,
                discount: transition.discount,
                next_observation: &transition.next_observation,
                next_mask: transition.next_mask.0,
            }
            .store(&mut self.replay);
        }
        self.refresh()
    }

    fn refresh(&mut self) -> Result<()> {
        repack(&mut self.acting, self.learner.scorer(), None, ACTION_COUNT)?;
        Ok(())
    }

    /// Multiplies the learning rate, after a divergence.
    pub fn slow_down(&mut self, factor: f32) {
        self.rate_factor *= factor;
    }

    /// Gives the replay buffer back: it learns no more.
    pub fn rest(&mut self) {
        self.replay = ReplayBuffer::new(1, ROW);
    }

    /// The scorer's values of observations with the action chosen there, side by side, summed.
    pub fn values(&mut self, inputs: &[f32]) -> f32 {
        let rows = inputs.chunks_exact(HIGH_OBSERVATION + 1);
        let observations: Vec<f32> =
            rows.clone().flat_map(|row| row[..HIGH_OBSERVATION].iter().copied()).collect();
        let values = self.learner.values(&observations).chunks_exact(ACTION_COUNT);
        rows.zip(values).fold(0.0, |sum, (row, values)| sum + values[row[HIGH_OBSERVATION] as usize])
    }

    /// The learning rule.
    pub fn learner(&self) -> &Dqn {
        &self.learner
    }

    /// What the newest update told.
    pub fn losses(&self) -> &DqnLosses {
        &self.losses
    }

    /// The rows of the replay buffer, for a checkpoint.
    pub fn replay_rows(&self) -> &[f32] {
        self.replay.rows()
    }

    /// What a checkpoint keeps beside the rows.
    pub fn state(&self) -> HighLearnerState {
        HighLearnerState {
            learner: self.learner.state(),
            replay: self.replay.position(),
            decisions: self.decisions,
            sampler: self.sampler.clone(),
            losses: self.losses,
            rate_factor: self.rate_factor,
        }
    }

    /// Continues exactly from a state and its rows.
    ///
    /// # Errors
    /// A state of another configuration.
    pub fn restore(&mut self, state: HighLearnerState, rows: Vec<f32>) -> Result<()> {
        ensure!(self.learner.restore(state.learner), OTHER);
        self.replay = ReplayBuffer::restore(state.replay, rows).ok_or_else(|| anyhow::anyhow!(OTHER))?;
        self.decisions = state.decisions;
        self.sampler = state.sampler;
        self.losses = state.losses;
        self.rate_factor = state.rate_factor;
        self.refresh()
    }
}
