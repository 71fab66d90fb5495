//! Robots that drive to targets, for TD3 to learn from.
//!
//! A round: every robot takes a step of learning ([`nav_core::scale`]), which may be several ticks of its own, then the
//! learner makes the updates that are due. So a robot that ticks fast costs more simulation, and no more learning.

use anyhow::{Result, ensure};
use nav_core::observation::LOW_ACTION;
use nav_env::low::{Attempt, LowRobot};
use nav_env::seeds::derive;
use nav_env::worlds::Place;
use nav_sim::normal::standard_normal;
use rand::{RngExt, SeedableRng};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

use super::explore::{Held, explore};
use super::learners::Learners;
use super::low_learner::OTHER;
use super::plan::StagePlan;
use super::stage::{STAGE, Stage};
use super::trail::{Judged, Trail};
use super::window::{Ended, Window};
use crate::checkpoint::{Checkpoint, Contents};
use crate::config::{CollapseConfig, Config};
use crate::logs::Status;
use crate::nn::Rng;

/// The robots of a low level that learns.
pub struct LowStage {
    budget: u64,
    /// Whether it goes on where an earlier stage ended.
    goes_on: bool,
    /// Standard deviation of the exploration noise, `[least, most]`.
    noise: [f32; 2],
    collapse: CollapseConfig,
    robots: Vec<LowRobot>,
    explorers: Vec<Rng>,
    /// What each explores with, for as many ticks as are a step of learning.
    held: Vec<Held>,
    ticks_a_step: u32,
    env_steps: u64,
    attempts: Window,
    /// Each robot's present attempt.
    trails: Vec<Trail>,
}

/// What a checkpoint keeps of the stage.
#[derive(Serialize, Deserialize)]
struct LowStageState {
    histories: Vec<(u64, Vec<[f32; LOW_ACTION]>)>,
    explorers: Vec<Rng>,
    held: Vec<Held>,
    env_steps: u64,
    attempts: Window,
    trails: Vec<Trail>,
}

impl LowStage {
    /// Robots at their first step.
    pub fn new(config: &Config, plan: &StagePlan, places: Arc<Vec<Place>>) -> Self {
        let streams = plan.streams.map(|first| (first..).take(plan.robots).map(|s| derive(config.seed, s)));
        let [seeds, exploration] = streams;
        let low = &config.low;
        let robot =
            |seed| LowRobot::new(low.robot(), places.clone(), &config.task, &config.disturbance, seed);
        Self {
            budget: plan.budget,
            goes_on: plan.goes_on,
            noise: low.noise,
            collapse: low.collapse.clone(),
            robots: seeds.map(robot).collect(),
            explorers: exploration.map(Rng::seed_from_u64).collect(),
            held: vec![Held::default(); plan.robots],
            ticks_a_step: config.task.ticks(config.task.scale().step_s()),
            env_steps: 0,
            attempts: Window::new(1_000),
            trails: vec![Trail::default(); plan.robots],
        }
    }

    /// Share of the stage that is over.
    fn share(&self) -> f32 {
        self.env_steps as f32 / self.budget as f32
    }

    /// What exploration and learning rates go by.
    fn progress(&self) -> f32 {
        if self.goes_on { 1.0 } else { self.share() }
    }
}

impl Stage for LowStage {
    fn round(&mut self, learners: &mut Learners) -> Result<()> {
        let (low, progress, robots) = (&mut learners.low, self.progress(), self.robots.len());
        let mut transitions = Vec::new();
        for _ in 0..self.ticks_a_step {
            for (index, (robot, rng)) in self.robots.iter_mut().zip(&mut self.explorers).enumerate() {
                let held = &mut self.held[index];
                let action = if low.is_warm() {
                    let mut action = [0.0; LOW_ACTION];
                    low.acting().run(robot.observation(), &mut action);
                    let noise = held.next(self.ticks_a_step, || standard_normal(rng));
                    explore(self.noise, (index, robots), progress, action, noise)
                } else {
                    held.next(self.ticks_a_step, || rng.random_range(-1.0..=1.0))
                };
                let observation = *robot.observation();
                let report = robot.step(action, &mut transitions);
                let trail = &mut self.trails[index];
                trail.push(&[&observation, &action], report.reward, low.discount());
                if report.attempt != Attempt::Running {
                    let judged = report.is_terminated.then(|| trail.judge(|inputs| low.values(inputs)));
                    if let Some(ended) = ended(report.attempt, trail.total(), judged) {
                        self.attempts.push(ended);
                    }
                    trail.clear();
                }
            }
        }
        self.env_steps += robots as u64;
        transitions.into_iter().for_each(|transition| low.store(transition));
        low.learn(self.progress())
    }

    fn is_finished(&self) -> bool {
        self.env_steps >= self.budget
    }

    /// See [`CollapseConfig`].
    fn collapse(&self, learners: &Learners) -> Option<String> {
        let bounds = &self.collapse;
        let is_watched = self.share() >= bounds.from_share && self.attempts.is_full() && !self.is_finished();
        let (reach, saturation) = (self.attempts.success(), learners.low.losses().saturation);
        let has_collapsed = is_watched && reach < bounds.reach_min && saturation > bounds.saturation_max;
        has_collapsed.then(|| {
            format!(
                "the low level has collapsed: after {} of {} steps it reaches {:.1} % of its targets (at least {:.1} % \
                 is expected by now) while {:.1} % of its actions are saturated (beyond 0.99), from where its gradient \
                 hardly leads back. Train with another --seed, or lower low.td3.actor_learning_rate; \
                 low.collapse.from_share = 1 goes on regardless",
                self.env_steps,
                self.budget,
                100.0 * reach,
                100.0 * bounds.reach_min,
                100.0 * saturation
            )
        })
    }

    /// Not within the warm-up, which is seconds long.
    fn can_save(&self, learners: &Learners) -> bool {
        learners.low.is_warm()
    }

    fn status(&self, learners: &Learners) -> Status {
        Status {
            position: self.env_steps,
            steps: self.env_steps,
            updates: learners.low.learner().updates(),
            success: (self.attempts.total() > 0).then(|| self.attempts.success()),
        }
    }

    fn scalars(&self, learners: &Learners) -> Vec<(&'static str, f64)> {
        let losses = learners.low.losses();
        let scalars: [(&str, f32); 10] = [
            ("low/reach", self.attempts.success()),
            ("low/collision", self.attempts.collision()),
            ("low/return", self.attempts.mean_return()),
            ("td3/critic_loss", losses.critic),
            ("td3/actor_loss", losses.actor),
            ("td3/q_mean", losses.q_mean),
            ("td3/q_max", losses.q_max),
            ("td3/critic_gradient_norm", losses.critic_gradient_norm),
            ("td3/smooth_temporal", losses.smooth_temporal),
            ("td3/saturation", losses.saturation),
        ];
        let mut scalars = scalars.to_vec();
        if let Some((returned, bias)) = self.attempts.discounted_return_and_bias() {
            scalars.extend([("low/discounted_return", returned), ("td3/q_bias", bias)]);
        }
        scalars.into_iter().map(|(name, value)| (name, f64::from(value))).collect()
    }

    fn add_to(&self, contents: &mut Contents<'_>) -> Result<()> {
        let history = |robot: &LowRobot| (robot.history().0, robot.history().1.to_vec());
        let state = LowStageState {
            histories: self.robots.iter().map(history).collect(),
            explorers: self.explorers.clone(),
            held: self.held.clone(),
            env_steps: self.env_steps,
            attempts: self.attempts.clone(),
            trails: self.trails.clone(),
        };
        Ok(contents.value(STAGE, &state)?)
    }

    fn restore_from(&mut self, checkpoint: &Checkpoint, _: &mut Learners) -> Result<()> {
        let state: LowStageState = checkpoint.value(STAGE)?;
        let lengths = [state.histories.len(), state.explorers.len(), state.held.len(), state.trails.len()];
        ensure!(lengths == [self.robots.len(); 4], OTHER);
        for (robot, (number, actions)) in self.robots.iter_mut().zip(&state.histories) {
            robot.replay(*number, actions);
        }
        self.explorers = state.explorers;
        self.held = state.held;
        self.env_steps = state.env_steps;
        self.attempts = state.attempts;
        self.trails = state.trails;
        Ok(())
    }
}

/// What the window keeps of an attempt; nothing of one that goes on or was cut.
fn ended(attempt: Attempt, returned: f32, judged: Option<Judged>) -> Option<Ended> {
    let (succeeded, collided) = match attempt {
        Attempt::Running | Attempt::Cut => return None,
        Attempt::Reached => (true, false),
        Attempt::Collided => (false, true),
        Attempt::GivenUp | Attempt::Astray => (false, false),
    };
    Some(Ended { succeeded, collided, returned, judged })
}
