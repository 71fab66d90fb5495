//! Stage B's robots: each decides, drives its frozen low level until the next decision is due, and so on.
//!
//! | field | value |
//! |---|---|
//! | observation | [`nav_core::observation`], high level, 108 numbers |
//! | action | 16 directions, GOAL, WAIT, masked |
//! | reward | [`HighReward`]: a step's, discounted and summed over the decision |
//! | terminated | goal reached, or collision, or a wrong belief to have arrived, which costs the rest of the time |
//! | truncated | the episode's time over |

use nav_core::geometry::{Point, Pose, wrap_angle};
use nav_core::navigator::Navigator;
use nav_core::observation::{HIGH_OBSERVATION, LOW_ACTION, LOW_OBSERVATION};
use nav_core::reward::{HighDecision, HighReward, HighStep};
use nav_core::subgoal::{ActionMask, CORRIDOR_CLEARANCE_M};
use nav_core::task::{ACTION_GOAL, Task};
use nav_sim::disturbance::Disturbance;
use nav_sim::simulation::Outcome;
use rand::{RngExt, SeedableRng};
use std::collections::VecDeque;
use std::sync::Arc;

use crate::ActingNetwork;
use crate::episode::Episode;
use crate::seeds::{Rng, derive};
use crate::worlds::Place;

/// What stands nearer ahead is an obstacle to the paper's reward, m of the reference robot ([`nav_core::scale`]).
const AHEAD_M: f32 = 1.0;

/// What a robot of stage B is paid for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HighRobotConfig {
    /// Discount of a step (a decision of n steps discounts by its n-th power).
    pub discount: f32,
    /// Decisions of a return before it bootstraps.
    pub n_step: usize,
    /// What it is paid for.
    pub reward: HighReward,
}

/// A return over up to n decisions, as stored.
#[derive(Clone, Debug)]
pub struct HighTransition {
    /// Observation when deciding.
    pub observation: [f32; HIGH_OBSERVATION],
    /// The action chosen.
    pub action: usize,
    /// Discounted sum of the rewards until the next observation.
    pub reward: f32,
    /// Discount of the next observation's value; 0 after a terminated episode.
    pub discount: f32,
    /// Observation up to n decisions later.
    pub next_observation: [f32; HIGH_OBSERVATION],
    /// What is legal there.
    pub next_mask: ActionMask,
}

/// A decision whose return is not complete yet.
#[derive(Clone, Debug)]
struct Pending {
    observation: [f32; HIGH_OBSERVATION],
    action: usize,
    reward: f32,
    discount: f32,
}

/// What a decision led to.
#[derive(Clone, Copy, Debug)]
pub struct DecisionReport {
    /// Steps driven.
    pub steps: u32,
    /// How the episode stands.
    pub outcome: Outcome,
    /// What the decision earned: its steps' rewards, discounted and summed.
    pub reward: f32,
    /// Discount from the decision to the next one.
    pub discount: f32,
    /// Whether it ended the episode for good, so that nothing follows.
    pub is_terminated: bool,
    /// Sum of the rewards since the episode began, undiscounted.
    pub returned: f32,
}

/// A robot of stage B, always at a moment of decision.
#[derive(Clone, Debug)]
pub struct HighRobot {
    config: HighRobotConfig,
    places: Arc<Vec<Place>>,
    seed: u64,
    episodes: u64,
    episode: Episode,
    pending: VecDeque<Pending>,
    /// Rewards since the episode began, summed.
    returned: f32,
    way_m: f32,
    observation: [f32; HIGH_OBSERVATION],
    mask: ActionMask,
    last_course_rad: f32,
    /// Actions since the episode began, to rebuild it after an interruption.
    actions: Vec<u8>,
}

impl HighRobot {
    /// A robot in its first episode.
    pub fn new(
        config: HighRobotConfig,
        places: Arc<Vec<Place>>,
        task: &Task,
        disturbance: &Disturbance,
        seed: u64,
    ) -> Self {
        let episode = Episode::new(places[0].clone(), task, disturbance, seed);
        let mut robot = Self {
            config,
            places,
            seed,
            episodes: 0,
            episode,
            pending: VecDeque::new(),
            returned: 0.0,
            way_m: 0.0,
            observation: [0.0; HIGH_OBSERVATION],
            mask: ActionMask::default(),
            last_course_rad: 0.0,
            actions: Vec::new(),
        };
        robot.begin(0);
        robot
    }

    fn begin(&mut self, number: u64) {
        self.episodes = number;
        self.actions.clear();
        self.pending.clear();
        self.returned = 0.0;
        let mut rng = Rng::seed_from_u64(derive(self.seed, number));
        let place = self.places[rng.random_range(0..self.places.len())].clone();
        self.episode.restart(place, rng.random());
        self.way_m = self.episode.way_m().unwrap_or(0.0);
        self.last_course_rad = self.episode.pose().yaw_rad;
        self.prepare();
    }

    fn prepare(&mut self) {
        let (observation, mask) = self.episode.navigator_mut().prepare_decision();
        self.observation = *observation;
        self.mask = mask;
    }

    /// Rebuilds the state from an episode number and its actions so far.
    pub fn replay(&mut self, number: u64, actions: &[u8], low: &mut ActingNetwork) {
        self.begin(number);
        for &action in actions {
            self.decide(usize::from(action), low, &mut Vec::new());
        }
    }

    /// Episode number and actions since it began.
    pub fn history(&self) -> (u64, &[u8]) {
        (self.episodes, &self.actions)
    }

    /// What the policy sees now.
    pub fn observation(&self) -> &[f32; HIGH_OBSERVATION] {
        &self.observation
    }

    /// What is legal now.
    pub fn mask(&self) -> ActionMask {
        self.mask
    }

    /// The episode it drives.
    pub fn episode(&self) -> &Episode {
        &self.episode
    }

    /// Carries out a legal `action` until the next decision is due or the episode ends, adds the returns
    /// that are complete to `transitions`, and begins the next episode where one ends.
    pub fn decide(
        &mut self,
        action: usize,
        low: &mut ActingNetwork,
        transitions: &mut Vec<HighTransition>,
    ) -> DecisionReport {
        self.actions.push(action as u8);
        self.episode.navigator_mut().commit(action);
        let start = self.episode.navigator().pose();
        let target =
            self.episode.navigator().decision().map_or(start.position(), |decision| decision.subgoal);
        let task = self.episode.simulation().task();
        let lane = task.robot.footprint.lane(task.scale().m(CORRIDOR_CLEARANCE_M));
        let ahead_m = task.scale().m(AHEAD_M);
        let free_m = self.episode.navigator().scan().corridor_m(1.0, 0.0, &lane, ahead_m);
        let obstacle_ahead = free_m < ahead_m;
        let mut pending = Pending { observation: self.observation, action, reward: 0.0, discount: 1.0 };
        let mut steps = 0;
        let (outcome, is_astray) = loop {
            let outcome = drive_step(&mut self.episode, low);
            steps += 1;
            let is_astray = self.episode.is_astray();
            let progress_m = match self.episode.way_m() {
                Some(way_m) => std::mem::replace(&mut self.way_m, way_m) - way_m,
                None => 0.0,
            };
            let step = HighStep {
                progress_m,
                reached: outcome == Outcome::Reached,
                collided: outcome == Outcome::Collided,
                stands_for_steps: if is_astray { self.episode.simulation().steps_left() } else { 0 },
            };
            let reward = self.config.reward.of_step(&step, self.config.discount);
            pending.reward += pending.discount * reward;
            self.returned += reward;
            pending.discount *= self.config.discount;
            if outcome.is_over() || is_astray {
                break (outcome, is_astray);
            }
            // As the controller: a robot that believes it has arrived decides nothing until a correction says otherwise.
            let navigator = self.episode.navigator();
            if !navigator.goal_reached() && navigator.decision_due().is_some() {
                break (outcome, false);
            }
        };
        let decision = self.decision(start, target, obstacle_ahead, outcome);
        let reward = self.config.reward.of_decision(&decision);
        pending.reward += reward;
        self.returned += reward;
        self.prepare();
        // What comes after a wrong arrival is known: nothing.
        let is_terminated = outcome.is_terminated() || is_astray;
        let outcome = if is_astray { Outcome::TimedOut } else { outcome };
        let Pending { reward, discount, .. } = pending;
        self.settle(pending, outcome.is_over(), is_terminated, transitions);
        let report =
            DecisionReport { steps, outcome, reward, discount, is_terminated, returned: self.returned };
        if outcome.is_over() {
            self.begin(self.episodes + 1);
        }
        report
    }

    /// Adds a decision to the returns that wait, and hands out those that are complete.
    fn settle(
        &mut self,
        newest: Pending,
        is_over: bool,
        is_terminated: bool,
        transitions: &mut Vec<HighTransition>,
    ) {
        for waiting in &mut self.pending {
            waiting.reward += waiting.discount * newest.reward;
            waiting.discount *= newest.discount;
        }
        self.pending.push_back(newest);
        let complete = if is_over {
            self.pending.len()
        } else {
            (self.pending.len() + 1).saturating_sub(self.config.n_step)
        };
        for done in self.pending.drain(..complete) {
            transitions.push(HighTransition {
                observation: done.observation,
                action: done.action,
                reward: done.reward,
                discount: if is_terminated { 0.0 } else { done.discount },
                next_observation: self.observation,
                next_mask: self.mask,
            });
        }
    }

    /// What a decision led to, for the reward.
    fn decision(
        &mut self,
        start: Pose,
        target: Point,
        obstacle_ahead: bool,
        outcome: Outcome,
    ) -> HighDecision {
        let pose = self.episode.navigator().pose();
        let moved = pose.position() - start.position();
        let course_rad = if moved.norm() > 1e-3 { libm::atan2f(moved.y, moved.x) } else { pose.yaw_rad };
        let error = wrap_angle(course_rad - start.bearing_to(target));
        let change = wrap_angle(course_rad - self.last_course_rad);
        self.last_course_rad = course_rad;
        HighDecision {
            direction_error_deg: error.to_degrees(),
            moved_m: moved.norm(),
            target_m: (target - start.position()).norm(),
            obstacle_ahead,
            direction_change_deg: change.to_degrees(),
            collided: outcome == Outcome::Collided,
        }
    }
}

/// One step of the low level towards the decision's subgoal, or of waiting.
pub fn drive_step(episode: &mut Episode, low: &mut ActingNetwork) -> Outcome {
    let navigator: &Navigator = episode.navigator();
    // A robot that believes it has arrived stands, on the road as here.
    if navigator.is_waiting() || navigator.goal_reached() {
        return episode.wait();
    }
    let mut observation = [0.0; LOW_OBSERVATION];
    episode.encode_low(&mut observation);
    let mut action = [0.0; LOW_ACTION];
    low.run(&observation, &mut action);
    episode.drive(action)
}

/// A random legal action: GOAL in a given share of draws, else any.
pub fn random_action(mask: ActionMask, goal_share: f32, rng: &mut Rng) -> usize {
    if rng.random::<f32>() < goal_share {
        return ACTION_GOAL;
    }
    let pick = rng.random_range(0..mask.count()) as usize;
    mask.actions().nth(pick).unwrap_or(ACTION_GOAL)
}
