//! Robots that decide above a low level that does not change, for DQN to learn from.
//!
//! A round: every robot takes a decision on one thread while the learner makes the updates that are due on another,
//! from the rounds before.

use anyhow::{Context, Result, ensure};
use nav_core::observation::{CANDIDATE_FEATURES, HIGH_OBSERVATION, expand_candidates};
use nav_core::task::{ACTION_COUNT, ACTION_GOAL};
use nav_env::ActingNetwork;
use nav_env::high::{DecisionReport, HighRobot, HighTransition, random_action};
use nav_env::seeds::derive;
use nav_env::worlds::Place;
use nav_sim::simulation::Outcome;
use rand::{RngExt, SeedableRng};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

use super::high_learner::HighLearner;
use super::learners::Learners;
use super::low_learner::OTHER;
use super::plan::StagePlan;
use super::stage::{STAGE, Stage};
use super::trail::Trail;
use super::window::{Ended, Window};
use crate::checkpoint::{Checkpoint, Contents};
use crate::config::{Config, HighConfig};
use crate::logs::Status;
use crate::nn::Rng;

/// The robots of a high level that learns.
pub struct HighStage {
    budget: u64,
    /// Whether it goes on where an earlier stage ended.
    goes_on: bool,
    config: HighConfig,
    robots: Vec<HighRobot>,
    explorers: Vec<Rng>,
    decisions: u64,
    env_steps: u64,
    episodes: Window,
    /// Each robot's present episode.
    trails: Vec<Trail>,
}

/// What a checkpoint keeps of the stage.
#[derive(Serialize, Deserialize)]
struct HighStageState {
    histories: Vec<(u64, Vec<u8>)>,
    explorers: Vec<Rng>,
    decisions: u64,
    env_steps: u64,
    episodes: Window,
    trails: Vec<Trail>,
}

/// What the robots bring back from a round.
#[derive(Default)]
struct Harvest {
    transitions: Vec<HighTransition>,
    /// Of each robot what it saw and chose, and what came of it.
    decisions: Vec<([f32; HIGH_OBSERVATION], usize, DecisionReport)>,
}

impl HighStage {
    /// Robots at their first decision.
    pub fn new(config: &Config, plan: &StagePlan, places: Arc<Vec<Place>>) -> Self {
        let streams = plan.streams.map(|first| (first..).take(plan.robots).map(|s| derive(config.seed, s)));
        let [seeds, exploration] = streams;
        let high = &config.high;
        let robot =
            |seed| HighRobot::new(high.robot(), places.clone(), &config.task, &config.disturbance, seed);
        Self {
            budget: plan.budget,
            goes_on: plan.goes_on,
            config: high.clone(),
            robots: seeds.map(robot).collect(),
            explorers: exploration.map(Rng::seed_from_u64).collect(),
            decisions: 0,
            env_steps: 0,
            episodes: Window::new(400),
            trails: vec![Trail::default(); plan.robots],
        }
    }

    /// Share of random choices now.
    fn epsilon(&self) -> f32 {
        let [start, end] = self.config.epsilon;
        if self.goes_on {
            return end;
        }
        let span = self.config.epsilon_share * self.budget as f32;
        start + (end - start) * (self.decisions as f32 / span.max(1.0)).min(1.0)
    }

    /// What the learning rate goes by.
    fn progress(&self) -> f32 {
        if self.goes_on { 1.0 } else { self.decisions as f32 / self.budget as f32 }
    }

    fn take_in(&mut self, harvest: &Harvest, high: &mut HighLearner) {
        for (trail, (observation, action, report)) in self.trails.iter_mut().zip(&harvest.decisions) {
            self.decisions += 1;
            self.env_steps += u64::from(report.steps);
            trail.push(&[observation, &[*action as f32]], report.reward, report.discount);
            if report.outcome.is_over() {
                self.episodes.push(Ended {
                    succeeded: report.outcome == Outcome::Reached,
                    collided: report.outcome == Outcome::Collided,
                    returned: report.returned,
                    judged: report.is_terminated.then(|| trail.judge(|inputs| high.values(inputs))),
                });
                trail.clear();
            }
        }
    }
}

impl Stage for HighStage {
    fn round(&mut self, learners: &mut Learners) -> Result<()> {
        let Learners { low, high } = learners;
        let high = high.as_mut().context("a flat policy has no high level: this is a defect")?;
        let (epsilon, progress) = (self.epsilon(), self.progress());
        let (goal_share, robots, explorers) =
            (self.config.random_goal_share, &mut self.robots, &mut self.explorers);
        let low = low.acting();
        let harvest = high.learn_beside(progress, |acting| {
            drive_round(robots, explorers, acting, low, (epsilon, goal_share))
        })?;
        self.take_in(&harvest, high);
        high.take_in(harvest.decisions.len() as u64, &harvest.transitions)
    }

    fn is_finished(&self) -> bool {
        self.decisions >= self.budget
    }

    fn collapse(&self, _: &Learners) -> Option<String> {
        None
    }

    fn can_save(&self, _: &Learners) -> bool {
        true
    }

    fn status(&self, learners: &Learners) -> Status {
        Status {
            position: self.decisions,
            steps: self.env_steps,
            updates: learners.high.as_ref().map_or(0, |high| high.learner().updates()),
            success: (self.episodes.total() > 0).then(|| self.episodes.success()),
        }
    }

    fn scalars(&self, learners: &Learners) -> Vec<(&'static str, f64)> {
        let losses = learners.high.as_ref().map(|high| *high.losses()).unwrap_or_default();
        let scalars: [(&str, f32); 9] = [
            ("high/success", self.episodes.success()),
            ("high/collision", self.episodes.collision()),
            ("high/return", self.episodes.mean_return()),
            ("high/epsilon", self.epsilon()),
            ("dqn/loss", losses.loss),
            ("dqn/q_mean", losses.q_mean),
            ("dqn/q_max", losses.q_max),
            ("dqn/error_mean", losses.error_mean),
            ("dqn/gradient_norm", losses.gradient_norm),
        ];
        let mut scalars = scalars.to_vec();
        if let Some((returned, bias)) = self.episodes.discounted_return_and_bias() {
            scalars.extend([("high/discounted_return", returned), ("dqn/q_bias", bias)]);
        }
        scalars.into_iter().map(|(name, value)| (name, f64::from(value))).collect()
    }

    fn add_to(&self, contents: &mut Contents<'_>) -> Result<()> {
        let history = |robot: &HighRobot| (robot.history().0, robot.history().1.to_vec());
        let state = HighStageState {
            histories: self.robots.iter().map(history).collect(),
            explorers: self.explorers.clone(),
            decisions: self.decisions,
            env_steps: self.env_steps,
            episodes: self.episodes.clone(),
            trails: self.trails.clone(),
        };
        Ok(contents.value(STAGE, &state)?)
    }

    fn restore_from(&mut self, checkpoint: &Checkpoint, learners: &mut Learners) -> Result<()> {
        let state: HighStageState = checkpoint.value(STAGE)?;
        let lengths = [state.histories.len(), state.explorers.len(), state.trails.len()];
        ensure!(lengths == [self.robots.len(); 3], OTHER);
        for (robot, (number, actions)) in self.robots.iter_mut().zip(&state.histories) {
            robot.replay(*number, actions, learners.low.acting());
        }
        self.explorers = state.explorers;
        self.decisions = state.decisions;
        self.env_steps = state.env_steps;
        self.episodes = state.episodes;
        self.trails = state.trails;
        Ok(())
    }
}

/// One decision of every robot; a share `epsilon` of them random, a share `goal_share` of those GOAL.
fn drive_round(
    robots: &mut [HighRobot],
    explorers: &mut [Rng],
    acting: &mut ActingNetwork,
    low: &mut ActingNetwork,
    (epsilon, goal_share): (f32, f32),
) -> Harvest {
    let mut harvest = Harvest::default();
    let mut rows = vec![0.0; ACTION_COUNT * CANDIDATE_FEATURES];
    let mut values = [0.0; ACTION_COUNT];
    for (robot, rng) in robots.iter_mut().zip(explorers) {
        let explored = (rng.random::<f32>() < epsilon).then(|| random_action(robot.mask(), goal_share, rng));
        let action = explored.unwrap_or_else(|| {
            expand_candidates(robot.observation(), &mut rows);
            acting.run(&rows, &mut values);
            robot.mask().best(&values, 0.0).unwrap_or(ACTION_GOAL)
        });
        let observation = *robot.observation();
        let report = robot.decide(action, low, &mut harvest.transitions);
        harvest.decisions.push((observation, action, report));
    }
    harvest
}
