//! TD3 with what goes around it: the replay buffer, the normaliser, and the network that acts.

use anyhow::{Context, Result, ensure};
use nav_core::observation::{LOW_ACTION, LOW_OBSERVATION, mirror_low, mirror_low_action};
use nav_env::ActingNetwork;
use nav_env::low::LowTransition;
use nav_env::seeds::derive;
use rand::SeedableRng;
use serde::{Deserialize, Serialize};

use super::policy::Policy;
use crate::acting::{Normaliser, pack, repack};
use crate::config::{Config, LowConfig};
use crate::nn::{Buffer, Rng};
use crate::replay::{ReplayBuffer, ReplayPosition};
use crate::td3::{Batch, Mirror, Td3, Td3Config, Td3Losses, Td3State, Transition};

/// What a checkpoint of another configuration is told.
pub(super) const OTHER: &str = "the checkpoint is of another configuration than the run's config.toml";
/// A step in the mirror image.
const MIRROR: Mirror = Mirror { observation: mirror_low, action: mirror_low_action };
/// Values in a row of the replay buffer.
const ROW: usize = Transition::row_length(LOW_OBSERVATION, LOW_ACTION);

/// The low level as it learns.
pub struct LowLearner {
    config: LowConfig,
    learner: Td3,
    replay: ReplayBuffer,
    /// Raw transitions of the warm-up: the normaliser comes from them.
    warmup: Vec<LowTransition>,
    normaliser: Option<Normaliser>,
    /// Transitions ever stored, the warm-up's too.
    stored: u64,
    /// Of these, those that no update is due for: the first, and those that refill the buffer after a rest.
    unpaid: u64,
    /// Updates before them.
    updates_before: u64,
    sampler: Rng,
    batch: Batch,
    acting: ActingNetwork,
    losses: Td3Losses,
    rate_factor: f32,
}

/// Everything that a checkpoint keeps of it but the replay buffer's rows.
#[derive(Serialize, Deserialize)]
pub struct LowLearnerState {
    learner: Td3State,
    replay: ReplayPosition,
    normaliser: Option<Normaliser>,
    stored: u64,
    unpaid: u64,
    updates_before: u64,
    sampler: Rng,
    losses: Td3Losses,
    rate_factor: f32,
}

impl LowLearner {
    /// A learner that has seen nothing.
    ///
    /// # Errors
    /// A network that the executor cannot hold, or a replay buffer that the machine cannot.
    pub fn new(config: &Config) -> Result<Self> {
        Self::with(config, config.low.td3.clone(), config.low.replay_capacity)
    }

    /// The low level of a trained policy, with fresh critics.
    ///
    /// # Errors
    /// Damaged weights.
    pub fn of_policy(config: &Config, policy: &Policy) -> Result<Self> {
        let actor = policy.actor.network()?;
        let sizes = &actor.shape().sizes;
        let td3 = Td3Config { hidden: sizes[1..sizes.len() - 1].to_vec(), ..config.low.td3.clone() };
        let mut low = Self::with(config, td3, 1)?;
        ensure!(low.learner.set_actor(&actor), "the borrowed low level is not of this observation layout");
        low.normaliser = Some(policy.normaliser.clone());
        low.refresh()?;
        Ok(low)
    }

    fn with(config: &Config, td3: Td3Config, replay_capacity: usize) -> Result<Self> {
        let learner = Td3::new(LOW_OBSERVATION, LOW_ACTION, td3, derive(config.seed, 1));
        Ok(Self {
            acting: pack(learner.actor(), Some(&Normaliser::identity()), 1)?,
            learner,
            replay: replay(replay_capacity)?,
            warmup: Vec::new(),
            normaliser: None,
            stored: 0,
            unpaid: config.low.warmup_steps,
            updates_before: 0,
            sampler: Rng::seed_from_u64(derive(config.seed, 2)),
            batch: Batch::new(config.low.batch, LOW_OBSERVATION, LOW_ACTION)
                .with_mirror(config.low.mirror.then_some(MIRROR)),
            losses: Td3Losses::default(),
            rate_factor: 1.0,
            config: config.low.clone(),
        })
    }

    /// Whether its warm-up is over, so that it acts and can be saved.
    pub fn is_warm(&self) -> bool {
        self.normaliser.is_some()
    }

    /// Acts on raw observations.
    pub fn acting(&mut self) -> &mut ActingNetwork {
        &mut self.acting
    }

    /// Stores a transition; in the warm-up it is kept aside.
    pub fn store(&mut self, transition: LowTransition) {
        self.stored += 1;
        match &self.normaliser {
            None => self.warmup.push(transition),
            Some(normaliser) => store(&mut self.replay, normaliser, transition),
        }
    }

    /// Ends the warm-up when it is long enough, and makes the updates that are due. The learning rates fall with the
    /// stage's `progress`, 0 to 1.
    ///
    /// # Errors
    /// Numbers that are no longer finite.
    pub fn learn(&mut self, progress: f32) -> Result<()> {
        if !self.is_warm() && self.stored >= self.config.warmup_steps {
            self.finish_warmup()?;
        }
        let paid = self.stored.saturating_sub(self.unpaid);
        let due = self.updates_before + paid / u64::from(self.config.env_steps_per_update);
        if self.learner.updates() >= due {
            return Ok(());
        }
        let share = 1.0 + (self.config.final_learning_rate_share - 1.0) * progress.min(1.0);
        self.learner.set_learning_rate_share(share * self.rate_factor);
        while self.learner.updates() < due {
            self.batch.sample(&self.replay, &mut self.sampler);
            self.losses = self.learner.update(&mut self.batch);
        }
        ensure!(
            self.losses.is_sane(),
            "the low level diverged after {} updates (a loss or value has exploded): try a lower \
             low.td3.critic_learning_rate",
            self.learner.updates()
        );
        self.refresh()
    }

    /// Fixes the normaliser and stores the warm-up through it. Of mirror images, too, if the learner sees such: a normalised
    /// mirror image must be the mirror image of what is normalised.
    fn finish_warmup(&mut self) -> Result<()> {
        let mut observations: Vec<f32> =
            self.warmup.iter().flat_map(|transition| transition.observation.iter().copied()).collect();
        if self.config.mirror {
            let mut mirrored = observations.clone();
            mirrored.chunks_exact_mut(LOW_OBSERVATION).for_each(mirror_low);
            observations.extend(mirrored);
        }
        let normaliser = Normaliser::of(&observations, LOW_OBSERVATION);
        for transition in std::mem::take(&mut self.warmup) {
            store(&mut self.replay, &normaliser, transition);
        }
        self.normaliser = Some(normaliser);
        self.refresh()
    }

    fn refresh(&mut self) -> Result<()> {
        repack(&mut self.acting, self.learner.actor(), self.normaliser.as_ref(), 1)?;
        Ok(())
    }

    /// Multiplies the learning rates, after a divergence.
    pub fn slow_down(&mut self, factor: f32) {
        self.rate_factor *= factor;
    }

    /// Gives the replay buffer back: it learns no more.
    pub fn rest(&mut self) {
        self.replay = ReplayBuffer::new(1, ROW);
    }

    /// Learns on after a stage in which it did not. A buffer that was given back is filled again, by the policy as it is,
    /// for as long as the warm-up took, before the next update.
    ///
    /// # Errors
    /// A replay buffer that the machine cannot hold.
    pub fn wake(&mut self) -> Result<()> {
        self.updates_before = self.learner.updates();
        self.unpaid = self.stored;
        if self.replay.position().capacity < self.config.replay_capacity {
            self.replay = replay(self.config.replay_capacity)?;
            self.unpaid += self.config.warmup_steps;
        }
        Ok(())
    }

    /// The learning rule.
    pub fn learner(&self) -> &Td3 {
        &self.learner
    }

    /// What the newest update told.
    pub fn losses(&self) -> &Td3Losses {
        &self.losses
    }

    /// The normaliser, fixed after the warm-up.
    pub fn normaliser(&self) -> Option<&Normaliser> {
        self.normaliser.as_ref()
    }

    /// Discount of a step.
    pub fn discount(&self) -> f32 {
        self.config.discount
    }

    /// The critic's values of raw observations and actions, side by side, summed; 0 within the warm-up.
    pub fn values(&mut self, inputs: &[f32]) -> f32 {
        let Some(normaliser) = &self.normaliser else { return 0.0 };
        let width = LOW_OBSERVATION + LOW_ACTION;
        let mut inputs = Buffer::of(inputs, width);
        inputs
            .as_mut_slice()
            .chunks_exact_mut(width)
            .for_each(|row| normaliser.apply(&mut row[..LOW_OBSERVATION]));
        self.learner.values(&inputs).iter().fold(0.0, |sum, value| sum + value)
    }

    /// The rows of the replay buffer, for a checkpoint.
    pub fn replay_rows(&self) -> &[f32] {
        self.replay.rows()
    }

    /// What a checkpoint keeps beside the rows.
    pub fn state(&self) -> LowLearnerState {
        LowLearnerState {
            learner: self.learner.state(),
            replay: self.replay.position(),
            normaliser: self.normaliser.clone(),
            stored: self.stored,
            unpaid: self.unpaid,
            updates_before: self.updates_before,
            sampler: self.sampler.clone(),
            losses: self.losses,
            rate_factor: self.rate_factor,
        }
    }

    /// Continues exactly from a state and its rows.
    ///
    /// # Errors
    /// A state of another configuration.
    pub fn restore(&mut self, state: LowLearnerState, rows: Vec<f32>) -> Result<()> {
        ensure!(self.learner.restore(state.learner), OTHER);
        self.replay = ReplayBuffer::restore(state.replay, rows).ok_or_else(|| anyhow::anyhow!(OTHER))?;
        self.warmup.clear();
        self.normaliser = state.normaliser;
        self.stored = state.stored;
        self.unpaid = state.unpaid;
        self.updates_before = state.updates_before;
        self.sampler = state.sampler;
        self.losses = state.losses;
        self.rate_factor = state.rate_factor;
        self.refresh()
    }
}

fn replay(capacity: usize) -> Result<ReplayBuffer> {
    let buffer = ReplayBuffer::try_new(capacity, ROW);
    buffer.context("no memory for the replay buffer: lower low.replay_capacity")
}

fn store(replay: &mut ReplayBuffer, normaliser: &Normaliser, mut transition: LowTransition) {
    normaliser.apply(&mut transition.observation);
    normaliser.apply(&mut transition.next_observation);
    Transition {
        observation: &transition.observation,
        action: &transition.action,
        reward: transition.reward,
        discount: transition.discount,
        next_observation: &transition.next_observation,
    }
    .store(replay);
}
