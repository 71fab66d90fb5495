//! Stage B: DQN learns to choose subgoals for the frozen low level.
//!
//! A round: every robot takes a decision on one thread while the learner makes the updates that are due on
//! another, from the rounds before. Which is which does not depend on time, so a run repeats exactly.

use anyhow::{Result, ensure};
use nav_core::observation::{CANDIDATE_FEATURES, HIGH_OBSERVATION, expand_candidates};
use nav_core::task::ACTION_COUNT;
use nav_env::ActingNetwork;
use nav_env::high::{DecisionReport, HighRobot, HighTransition, random_action};
use nav_env::seeds::derive;
use nav_env::worlds::Place;
use nav_sim::simulation::Outcome;
use rand::{RngExt, SeedableRng};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

use crate::acting::{pack, repack};
use crate::config::{Config, HighConfig};
use crate::dqn::{Candidates, Decision, DecisionBatch, Dqn, DqnLosses, DqnState};
use crate::nn::Rng;
use crate::replay::{ReplayBuffer, ReplayPosition};
use crate::train::window::{Ended, Window};

/// Stage B under way.
pub struct HighStage {
    config: Arc<HighConfig>,
    learner: Dqn,
    replay: ReplayBuffer,
    robots: Vec<HighRobot>,
    explorers: Vec<Rng>,
    sampler: Rng,
    batch: DecisionBatch,
    acting: ActingNetwork,
    low: ActingNetwork,
    decisions: u64,
    env_steps: u64,
    episodes: Window,
    losses: DqnLosses,
    rate_factor: f32,
}

/// Everything that a checkpoint keeps of the stage but the replay buffer's rows.
#[derive(Serialize, Deserialize)]
pub struct HighState {
    learner: DqnState,
    replay: ReplayPosition,
    histories: Vec<(u64, Vec<u8>)>,
    explorers: Vec<Rng>,
    sampler: Rng,
    decisions: u64,
    env_steps: u64,
    episodes: Window,
    losses: DqnLosses,
    rate_factor: f32,
}

/// What the robots bring back from a round.
#[derive(Default)]
struct Harvest {
    transitions: Vec<HighTransition>,
    reports: Vec<DecisionReport>,
}

/// The learner's and the executor's view of a decision.
pub const CANDIDATES: Candidates = Candidates {
    observation: HIGH_OBSERVATION,
    count: ACTION_COUNT,
    width: CANDIDATE_FEATURES,
    expand: expand_candidates,
};

impl HighStage {
    /// A fresh stage above a low level.
    ///
    /// # Errors
    /// A network that the executor cannot hold.
    pub fn new(config: &Config, places: Arc<Vec<Place>>, low: ActingNetwork) -> Result<Self> {
        let high = Arc::new(config.high.clone());
        let robots = (0..high.envs as u64)
            .map(|robot| {
                let seed = derive(config.seed, 3_000 + robot);
                HighRobot::new(high.robot(), places.clone(), &config.task, &config.disturbance, seed)
            })
            .collect();
        let learner = Dqn::new(CANDIDATES, high.dqn.clone(), derive(config.seed, 3));
        let explorer = |robot: u64| Rng::seed_from_u64(derive(config.seed, 4_000 + robot));
        Ok(Self {
            acting: pack(learner.scorer(), None, ACTION_COUNT)?,
            learner,
            replay: ReplayBuffer::new(high.replay_capacity, Decision::row_length(HIGH_OBSERVATION)),
            robots,
            explorers: (0..high.envs as u64).map(explorer).collect(),
            sampler: Rng::seed_from_u64(derive(config.seed, 4)),
            batch: DecisionBatch::new(high.batch, HIGH_OBSERVATION),
            low,
            decisions: 0,
            env_steps: 0,
            episodes: Window::new(400),
            losses: DqnLosses::default(),
            rate_factor: 1.0,
            config: high,
        })
    }

    /// Whether the stage has had its decisions.
    pub fn is_finished(&self) -> bool {
        self.decisions >= self.config.decisions
    }

    /// Share of random choices now.
    pub fn epsilon(&self) -> f32 {
        let [start, end] = self.config.epsilon;
        let span = self.config.epsilon_share * self.config.decisions as f32;
        start + (end - start) * (self.decisions as f32 / span.max(1.0)).min(1.0)
    }

    /// One decision of every robot, and the updates that are due.
    ///
    /// # Errors
    /// A learner whose numbers are no longer finite.
    pub fn round(&mut self) -> Result<()> {
        let epsilon = self.epsilon();
        let progress = self.decisions as f32 / self.config.decisions as f32;
        let start = self.config.dqn.learning_rate;
        let rate = start + (self.config.final_learning_rate - start) * progress.min(1.0);
        self.learner.set_learning_rate(rate * self.rate_factor);
        let due = self.decisions.saturating_sub(self.config.warmup_decisions)
            / u64::from(self.config.decisions_per_update);
        let Self { config, robots, explorers, acting, low, learner, batch, replay, sampler, losses, .. } =
            self;
        let harvest = std::thread::scope(|scope| {
            let driving = scope.spawn(|| drive_round(config, robots, explorers, acting, low, epsilon));
            while learner.updates() < due {
                batch.sample(replay, sampler);
                *losses = learner.update(batch);
            }
            driving.join()
        });
        let harvest = harvest.map_err(|_| anyhow::anyhow!("a robot's thread panicked: this is a defect"))?;
        ensure!(
            self.losses.is_sane(),
            "the high level diverged after {} updates (a loss or value has exploded): try a lower \
             high.dqn.learning_rate",
            self.learner.updates()
        );
        self.take_in(harvest);
        repack(&mut self.acting, self.learner.scorer(), None, ACTION_COUNT)?;
        Ok(())
    }

    fn take_in(&mut self, harvest: Harvest) {
        for transition in &harvest.transitions {
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
        for report in &harvest.reports {
            self.decisions += 1;
            self.env_steps += u64::from(report.steps);
            if report.outcome.is_over() {
                self.episodes.push(Ended {
                    succeeded: report.outcome == Outcome::Reached,
                    collided: report.outcome == Outcome::Collided,
                    returned: report.returned,
                });
            }
        }
    }

    /// Multiplies the learning rate, after a divergence.
    pub fn scale_learning_rate(&mut self, factor: f32) {
        self.rate_factor *= factor;
    }

    /// Decisions of all robots so far.
    pub fn decisions(&self) -> u64 {
        self.decisions
    }

    /// Steps of all robots so far.
    pub fn env_steps(&self) -> u64 {
        self.env_steps
    }

    /// The learner.
    pub fn learner(&self) -> &Dqn {
        &self.learner
    }

    /// What the newest update told.
    pub fn losses(&self) -> &DqnLosses {
        &self.losses
    }

    /// How the newest episodes ended (with exploration).
    pub fn episodes(&self) -> &Window {
        &self.episodes
    }

    /// The rows of the replay buffer, for a checkpoint.
    pub fn replay_rows(&self) -> &[f32] {
        self.replay.rows()
    }

    /// What a checkpoint keeps beside the rows.
    pub fn state(&self) -> HighState {
        let history = |robot: &HighRobot| (robot.history().0, robot.history().1.to_vec());
        HighState {
            learner: self.learner.state(),
            replay: self.replay.position(),
            histories: self.robots.iter().map(history).collect(),
            explorers: self.explorers.clone(),
            sampler: self.sampler.clone(),
            decisions: self.decisions,
            env_steps: self.env_steps,
            episodes: self.episodes.clone(),
            losses: self.losses,
            rate_factor: self.rate_factor,
        }
    }

    /// Continues exactly from a state and its rows.
    ///
    /// # Errors
    /// A state of another configuration.
    pub fn restore(&mut self, state: HighState, rows: Vec<f32>) -> Result<()> {
        const OTHER: &str = "the checkpoint is of another configuration than the run's config.toml";
        ensure!(state.histories.len() == self.robots.len(), OTHER);
        ensure!(state.explorers.len() == self.explorers.len(), OTHER);
        ensure!(self.learner.restore(state.learner), OTHER);
        self.replay = ReplayBuffer::restore(state.replay, rows).ok_or_else(|| anyhow::anyhow!(OTHER))?;
        for (robot, (number, actions)) in self.robots.iter_mut().zip(&state.histories) {
            robot.replay(*number, actions, &mut self.low);
        }
        self.explorers = state.explorers;
        self.sampler = state.sampler;
        self.decisions = state.decisions;
        self.env_steps = state.env_steps;
        self.episodes = state.episodes;
        self.losses = state.losses;
        self.rate_factor = state.rate_factor;
        repack(&mut self.acting, self.learner.scorer(), None, ACTION_COUNT)?;
        Ok(())
    }
}

/// One decision of every robot.
fn drive_round(
    config: &HighConfig,
    robots: &mut [HighRobot],
    explorers: &mut [Rng],
    acting: &mut ActingNetwork,
    low: &mut ActingNetwork,
    epsilon: f32,
) -> Harvest {
    let mut harvest = Harvest::default();
    let mut rows = vec![0.0; ACTION_COUNT * CANDIDATE_FEATURES];
    let mut values = [0.0; ACTION_COUNT];
    for (robot, rng) in robots.iter_mut().zip(explorers) {
        let explored = (rng.random::<f32>() < epsilon)
            .then(|| random_action(robot.mask(), config.random_goal_share, rng));
        let action = explored.unwrap_or_else(|| {
            expand_candidates(robot.observation(), &mut rows);
            acting.run(&rows, &mut values);
            robot.mask().best(&values, 0.0).unwrap_or(nav_core::task::ACTION_GOAL)
        });
        harvest.reports.push(robot.decide(action, low, &mut harvest.transitions));
    }
    harvest
}
