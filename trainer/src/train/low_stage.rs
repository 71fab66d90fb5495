//! Stage A: TD3 learns to drive to targets.
//!
//! A round: every robot takes a step, then the learner makes the updates that are due.

use anyhow::{Result, ensure};
use nav_core::observation::{LOW_ACTION, LOW_OBSERVATION};
use nav_env::ActingNetwork;
use nav_env::low::{Attempt, LowRobot, LowTransition};
use nav_env::seeds::derive;
use nav_env::worlds::Place;
use rand::{RngExt, SeedableRng};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

use super::explore::explore;
use crate::acting::{Normaliser, pack, repack};
use crate::config::{Config, LowConfig};
use crate::nn::Rng;
use crate::replay::{ReplayBuffer, ReplayPosition};
use crate::td3::{Batch, Td3, Td3Losses, Td3State, Transition};
use crate::train::window::{Ended, Window};

/// Stage A under way.
pub struct LowStage {
    config: Arc<LowConfig>,
    learner: Td3,
    replay: ReplayBuffer,
    /// Raw observations of the warm-up, for the normaliser.
    warmup: Vec<LowTransition>,
    normaliser: Option<Normaliser>,
    robots: Vec<LowRobot>,
    noise: Vec<Rng>,
    sampler: Rng,
    batch: Batch,
    acting: ActingNetwork,
    env_steps: u64,
    attempts: Window,
    /// Rewards of each robot's present attempt, summed.
    returns: Vec<f32>,
    losses: Td3Losses,
    rate_factor: f32,
}

/// Everything that a checkpoint keeps of the stage but the replay buffer's rows.
#[derive(Serialize, Deserialize)]
pub struct LowState {
    learner: Td3State,
    replay: ReplayPosition,
    normaliser: Option<Normaliser>,
    histories: Vec<(u64, Vec<[f32; LOW_ACTION]>)>,
    noise: Vec<Rng>,
    sampler: Rng,
    env_steps: u64,
    attempts: Window,
    /// Rewards of each robot's present attempt, summed.
    returns: Vec<f32>,
    losses: Td3Losses,
    rate_factor: f32,
}

impl LowStage {
    /// A fresh stage.
    ///
    /// # Errors
    /// A network that the executor cannot hold.
    pub fn new(config: &Config, places: Arc<Vec<Place>>) -> Result<Self> {
        let low = Arc::new(config.low.clone());
        let robots = (0..low.envs as u64)
            .map(|robot| {
                let seed = derive(config.seed, 1_000 + robot);
                LowRobot::new(low.robot(), places.clone(), &config.task, &config.disturbance, seed)
            })
            .collect();
        let learner = Td3::new(LOW_OBSERVATION, LOW_ACTION, low.td3.clone(), derive(config.seed, 1));
        Ok(Self {
            acting: pack(learner.actor(), Some(&Normaliser::identity()), 1)?,
            learner,
            replay: ReplayBuffer::new(
                low.replay_capacity,
                Transition::row_length(LOW_OBSERVATION, LOW_ACTION),
            ),
            warmup: Vec::new(),
            normaliser: None,
            robots,
            noise: (0..low.envs as u64)
                .map(|robot| Rng::seed_from_u64(derive(config.seed, 2_000 + robot)))
                .collect(),
            sampler: Rng::seed_from_u64(derive(config.seed, 2)),
            batch: Batch::new(low.batch, LOW_OBSERVATION, LOW_ACTION),
            env_steps: 0,
            attempts: Window::new(1_000),
            returns: vec![0.0; low.envs],
            losses: Td3Losses::default(),
            rate_factor: 1.0,
            config: low,
        })
    }

    /// Whether the stage has had its steps.
    pub fn is_finished(&self) -> bool {
        self.env_steps >= self.config.env_steps
    }

    /// One step of every robot, and the updates that are due.
    ///
    /// # Errors
    /// A learner whose numbers are no longer finite.
    pub fn round(&mut self) -> Result<()> {
        let progress = self.env_steps as f32 / self.config.env_steps as f32;
        let is_warm = self.env_steps >= self.config.warmup_steps;
        for robot in 0..self.robots.len() {
            let rng = &mut self.noise[robot];
            let action = if is_warm {
                let mut action = [0.0; LOW_ACTION];
                self.acting.run(self.robots[robot].observation(), &mut action);
                explore(&self.config, robot, progress, action, rng)
            } else {
                [rng.random_range(-1.0..=1.0), rng.random_range(-1.0..=1.0)]
            };
            let (transition, attempt) = self.robots[robot].step(action);
            self.returns[robot] += transition.reward;
            if attempt != Attempt::Running {
                let returned = std::mem::take(&mut self.returns[robot]);
                ended(attempt, returned).into_iter().for_each(|ended| self.attempts.push(ended));
            }
            self.store(transition);
            self.env_steps += 1;
        }
        if self.normaliser.is_none() && self.env_steps >= self.config.warmup_steps {
            self.finish_warmup()?;
        }
        self.learn()
    }

    fn store(&mut self, transition: LowTransition) {
        match &self.normaliser {
            None => self.warmup.push(transition),
            Some(normaliser) => store(&mut self.replay, normaliser, self.config.discount, transition),
        }
    }

    /// Fixes the normaliser and stores the warm-up through it.
    fn finish_warmup(&mut self) -> Result<()> {
        let observations: Vec<f32> =
            self.warmup.iter().flat_map(|transition| transition.observation.iter().copied()).collect();
        let normaliser = Normaliser::of(&observations, LOW_OBSERVATION);
        for transition in std::mem::take(&mut self.warmup) {
            store(&mut self.replay, &normaliser, self.config.discount, transition);
        }
        self.normaliser = Some(normaliser);
        self.refresh()
    }

    fn learn(&mut self) -> Result<()> {
        let due = self.env_steps.saturating_sub(self.config.warmup_steps)
            / u64::from(self.config.env_steps_per_update);
        if self.learner.updates() >= due {
            return Ok(());
        }
        let progress = self.env_steps as f32 / self.config.env_steps as f32;
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

    /// Why the stage cannot get better any more, if it cannot: see [`crate::config::CollapseConfig`].
    pub fn collapse(&self) -> Option<String> {
        let bounds = &self.config.collapse;
        let is_watched = self.env_steps as f32 >= bounds.from_share * self.config.env_steps as f32
            && self.attempts.is_full()
            && !self.is_finished();
        let (reach, saturation) = (self.attempts.success(), self.losses.saturation);
        let has_collapsed = is_watched && reach < bounds.reach_min && saturation > bounds.saturation_max;
        has_collapsed.then(|| {
            format!(
                "the low level has collapsed: after {} of {} steps it reaches {:.1} % of its targets (at least {:.1} % \
                 is expected by now) while {:.1} % of its actions are saturated (beyond 0.99), from where its gradient \
                 hardly leads back. Train with another --seed, or lower low.td3.actor_learning_rate; \
                 low.collapse.from_share = 1 goes on regardless",
                self.env_steps,
                self.config.env_steps,
                100.0 * reach,
                100.0 * bounds.reach_min,
                100.0 * saturation
            )
        })
    }

    fn refresh(&mut self) -> Result<()> {
        repack(&mut self.acting, self.learner.actor(), self.normaliser.as_ref(), 1)?;
        Ok(())
    }

    /// Multiplies the learning rates, after a divergence.
    pub fn scale_learning_rates(&mut self, factor: f32) {
        self.rate_factor *= factor;
    }

    /// Steps of all robots so far.
    pub fn env_steps(&self) -> u64 {
        self.env_steps
    }

    /// The learner.
    pub fn learner(&self) -> &Td3 {
        &self.learner
    }

    /// What the newest update told.
    pub fn losses(&self) -> &Td3Losses {
        &self.losses
    }

    /// How the newest attempts ended.
    pub fn attempts(&self) -> &Window {
        &self.attempts
    }

    /// The normaliser, fixed after the warm-up.
    pub fn normaliser(&self) -> Option<&Normaliser> {
        self.normaliser.as_ref()
    }

    /// The rows of the replay buffer, for a checkpoint.
    pub fn replay_rows(&self) -> &[f32] {
        self.replay.rows()
    }

    /// Whether a checkpoint can be taken now: not within the warm-up, which is seconds long.
    pub fn can_save(&self) -> bool {
        self.normaliser.is_some()
    }

    /// What a checkpoint keeps beside the rows.
    pub fn state(&self) -> LowState {
        let history = |robot: &LowRobot| (robot.history().0, robot.history().1.to_vec());
        LowState {
            learner: self.learner.state(),
            replay: self.replay.position(),
            normaliser: self.normaliser.clone(),
            histories: self.robots.iter().map(history).collect(),
            noise: self.noise.clone(),
            sampler: self.sampler.clone(),
            env_steps: self.env_steps,
            attempts: self.attempts.clone(),
            returns: self.returns.clone(),
            losses: self.losses,
            rate_factor: self.rate_factor,
        }
    }

    /// Continues exactly from a state and its rows.
    ///
    /// # Errors
    /// A state of another configuration.
    pub fn restore(&mut self, state: LowState, rows: Vec<f32>) -> Result<()> {
        const OTHER: &str = "the checkpoint is of another configuration than the run's config.toml";
        let lengths = [state.histories.len(), state.noise.len(), state.returns.len()];
        ensure!(lengths == [self.robots.len(); 3], OTHER);
        ensure!(self.learner.restore(state.learner), OTHER);
        self.replay = ReplayBuffer::restore(state.replay, rows).ok_or_else(|| anyhow::anyhow!(OTHER))?;
        for (robot, (number, actions)) in self.robots.iter_mut().zip(&state.histories) {
            robot.replay(*number, actions);
        }
        self.normaliser = state.normaliser;
        self.noise = state.noise;
        self.sampler = state.sampler;
        self.env_steps = state.env_steps;
        self.attempts = state.attempts;
        self.returns = state.returns;
        self.losses = state.losses;
        self.rate_factor = state.rate_factor;
        self.refresh()
    }
}

fn store(replay: &mut ReplayBuffer, normaliser: &Normaliser, discount: f32, mut transition: LowTransition) {
    normaliser.apply(&mut transition.observation);
    normaliser.apply(&mut transition.next_observation);
    Transition {
        observation: &transition.observation,
        action: &transition.action,
        reward: transition.reward,
        discount: if transition.terminated { 0.0 } else { discount },
        next_observation: &transition.next_observation,
    }
    .store(replay);
}

/// What the window keeps of an attempt; nothing of one that goes on or was cut.
fn ended(attempt: Attempt, returned: f32) -> Option<Ended> {
    let (succeeded, collided) = match attempt {
        Attempt::Running | Attempt::Cut => return None,
        Attempt::Reached => (true, false),
        Attempt::Collided => (false, true),
        Attempt::GivenUp | Attempt::Astray => (false, false),
    };
    Some(Ended { succeeded, collided, returned })
}
