//! Stage A's robots: each drives from target to target, random subgoals in free corridors and the world's
//! goal, until its episode ends.
//!
//! | field | value |
//! |---|---|
//! | observation | [`nav_core::observation`], low level, 82 numbers |
//! | action | forward speed and turning rate, each in [-1, 1] |
//! | reward | [`LowReward`](nav_core::reward::LowReward) |
//! | terminated | target reached, or collision, or a wrong belief to be at the goal |
//! | truncated | target given up after `subgoal_s`, or the episode's time over |

mod attempt;
mod config;

pub use self::attempt::{Attempt, StepReport};
pub use self::config::{LowRobotConfig, Progress};

use nav_core::geometry::{Point, Pose, wrap_angle};
use nav_core::observation::{LOW_ACTION, LOW_OBSERVATION};
use nav_core::reward::LowStep;
use nav_core::task::Task;
use nav_sim::disturbance::Disturbance;
use nav_sim::simulation::Outcome;
use rand::{RngExt, SeedableRng};
use std::collections::VecDeque;
use std::sync::Arc;

use crate::episode::Episode;
use crate::seeds::{Rng, derive};
use crate::worlds::Place;

/// Kept free around a random subgoal, m of the reference robot ([`nav_core::scale`]).
const SUBGOAL_MARGIN_M: f32 = 0.15;
/// Added to the footprint when its corridor is measured, m of the reference robot.
const CLEARANCE_M: f32 = 0.02;
/// It is measured so far beyond the farthest subgoal, m of the reference robot.
const BEYOND_M: f32 = 0.5;

/// A return over up to n steps, as stored.
#[derive(Clone, Debug)]
pub struct LowTransition {
    /// Raw observation before the first step.
    pub observation: [f32; LOW_OBSERVATION],
    /// What was done there.
    pub action: [f32; LOW_ACTION],
    /// Discounted sum of the rewards until the next observation.
    pub reward: f32,
    /// Discount of the next observation's value; 0 after a terminated attempt.
    pub discount: f32,
    /// Raw observation up to n steps later.
    pub next_observation: [f32; LOW_OBSERVATION],
}

/// A robot of stage A.
#[derive(Clone, Debug)]
pub struct LowRobot {
    config: LowRobotConfig,
    places: Arc<Vec<Place>>,
    /// This robot's own seed.
    seed: u64,
    episodes: u64,
    /// Targets and worlds of this episode: restarted with each episode, so that an episode follows from its
    /// number and its actions.
    rng: Rng,
    episode: Episode,
    target: Point,
    target_is_goal: bool,
    target_steps: u32,
    /// The shortest way to the goal, m, as far as it was known last.
    way_m: f32,
    last_action: [f32; LOW_ACTION],
    /// Steps of this attempt whose returns are not complete yet, and over how many ticks they go so far.
    pending: VecDeque<(usize, LowTransition)>,
    /// A return begins each so many ticks: each step of learning ([`nav_core::scale`]), however fast the robot ticks.
    ticks_a_step: usize,
    observation: [f32; LOW_OBSERVATION],
    /// Actions since the episode began, to rebuild it after an interruption.
    actions: Vec<[f32; LOW_ACTION]>,
}

impl LowRobot {
    /// A robot in its first episode.
    pub fn new(
        config: LowRobotConfig,
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
            rng: Rng::seed_from_u64(seed),
            episode,
            target: Point::origin(),
            target_is_goal: false,
            target_steps: 0,
            way_m: 0.0,
            last_action: [0.0; LOW_ACTION],
            pending: VecDeque::new(),
            ticks_a_step: task.ticks(task.scale().step_s()) as usize,
            observation: [0.0; LOW_OBSERVATION],
            actions: Vec::new(),
        };
        robot.begin(0);
        robot
    }

    /// The same in its first episode behind the safety gate, to be scored: training never has it.
    #[must_use]
    pub fn behind_gate(self) -> Self {
        let mut robot = Self { episode: self.episode.behind_gate(), ..self };
        robot.begin(0);
        robot
    }

    /// Begins episode `number` of this robot.
    fn begin(&mut self, number: u64) {
        self.episodes = number;
        self.actions.clear();
        self.pending.clear();
        self.rng = Rng::seed_from_u64(derive(self.seed, number));
        let place = self.places[self.rng.random_range(0..self.places.len())].clone();
        let seed = self.rng.random();
        self.episode.restart(place, seed);
        self.way_m = self.true_way_m();
        self.last_action = [self.episode.simulation().task().robot.action_at_rest(), 0.0];
        self.choose_target();
    }

    /// Rebuilds the state from an episode number and its actions so far.
    pub fn replay(&mut self, number: u64, actions: &[[f32; LOW_ACTION]]) {
        self.begin(number);
        for &action in actions {
            self.step(action, &mut Vec::new());
        }
    }

    /// Episode number and actions since it began.
    pub fn history(&self) -> (u64, &[[f32; LOW_ACTION]]) {
        (self.episodes, &self.actions)
    }

    fn choose_target(&mut self) {
        self.target_steps = 0;
        let random =
            (self.rng.random::<f32>() >= self.config.goal_share).then(|| self.random_subgoal()).flatten();
        self.target_is_goal = random.is_none();
        self.target = random.unwrap_or_else(|| self.episode.navigator().goal());
        self.episode.encode_low_towards(self.target, &mut self.observation);
    }

    /// A random point at the end of a free corridor that the robot can turn to, `odom` frame.
    fn random_subgoal(&mut self) -> Option<Point> {
        let navigator = self.episode.navigator();
        let task = self.episode.simulation().task();
        let scale = task.scale();
        let robot = &task.robot;
        let lane = robot.footprint.lane(scale.m(CLEARANCE_M));
        let turns = navigator.scan().turns(&robot.footprint);
        let [least_m, most_m] = self.config.subgoal_m;
        let limit_m = most_m + scale.m(BEYOND_M);
        for _ in 0..10 {
            let bearing = self.rng.random_range(-std::f32::consts::PI..std::f32::consts::PI);
            let (sin, cos) = libm::sincosf(bearing);
            let free_m = navigator.scan().corridor_m(cos, sin, &lane, limit_m) - scale.m(SUBGOAL_MARGIN_M);
            if free_m > least_m && turns.lead_to(bearing, robot.reverses()) {
                let distance_m = self.rng.random_range(least_m..=free_m.min(most_m));
                let local = Point::new(distance_m * cos, distance_m * sin);
                return Some(navigator.pose().parent_from_local(local));
            }
        }
        None
    }

    /// What the policy sees now.
    pub fn observation(&self) -> &[f32; LOW_OBSERVATION] {
        &self.observation
    }

    /// Takes a step, adds the returns that are complete to `transitions`, and begins the next target or episode where one
    /// ends.
    pub fn step(&mut self, action: [f32; LOW_ACTION], transitions: &mut Vec<LowTransition>) -> StepReport {
        let observation = self.observation;
        let before = self.episode.navigator().pose();
        let outcome = self.episode.drive(action);
        self.actions.push(action);
        self.target_steps += 1;
        let after = self.episode.navigator().pose();
        if self.target_is_goal {
            // A localiser may have corrected it.
            self.target = self.episode.navigator().goal();
        }
        let limit = if self.target_is_goal { u32::MAX } else { self.subgoal_steps() };
        let attempt = if outcome == Outcome::Collided {
            Attempt::Collided
        } else if self.has_reached(outcome, after) {
            Attempt::Reached
        } else if self.target_is_goal && self.episode.navigator().goal_reached() {
            Attempt::Astray
        } else if self.target_steps >= limit || (outcome.is_over() && self.target_is_goal) {
            Attempt::GivenUp
        } else if outcome.is_over() {
            Attempt::Cut
        } else {
            Attempt::Running
        };
        let way_m = self.true_way_m();
        let nearer_m = std::mem::replace(&mut self.way_m, way_m) - way_m;
        let reward = self.reward(action, attempt, [before, after], nearer_m);
        self.episode.encode_low_towards(self.target, &mut self.observation);
        let is_terminated = matches!(attempt, Attempt::Reached | Attempt::Collided | Attempt::Astray);
        let report = StepReport { reward, attempt, is_terminated };
        self.settle(observation, action, report, transitions);
        self.last_action = action;
        if outcome.is_over() || attempt == Attempt::Astray {
            self.begin(self.episodes + 1);
        } else if attempt != Attempt::Running {
            self.choose_target();
        }
        report
    }

    /// Adds a step to the returns that wait, and hands out those that are complete.
    fn settle(
        &mut self,
        observation: [f32; LOW_OBSERVATION],
        action: [f32; LOW_ACTION],
        report: StepReport,
        transitions: &mut Vec<LowTransition>,
    ) {
        let StepReport { reward, attempt, is_terminated } = report;
        let (discount, next_observation) = (self.config.discount, self.observation);
        for (ticks, waiting) in &mut self.pending {
            *ticks += 1;
            waiting.reward += waiting.discount * reward;
            waiting.discount *= discount;
        }
        if (self.actions.len() - 1).is_multiple_of(self.ticks_a_step) {
            self.pending
                .push_back((1, LowTransition { observation, action, reward, discount, next_observation }));
        }
        let is_complete = |ticks: usize| attempt != Attempt::Running || ticks >= self.config.n_step;
        let complete = self.pending.iter().take_while(|(ticks, _)| is_complete(*ticks)).count();
        for (_, mut done) in self.pending.drain(..complete) {
            done.next_observation = next_observation;
            done.discount = if is_terminated { 0.0 } else { done.discount };
            transitions.push(done);
        }
    }

    /// The shortest way to the goal, m, or as it was known last; 0 where nobody asks for it.
    fn true_way_m(&self) -> f32 {
        match self.config.progress {
            Progress::Straight => 0.0,
            Progress::Geodesic => self.episode.way_m().unwrap_or(self.way_m),
        }
    }

    fn subgoal_steps(&self) -> u32 {
        self.episode.simulation().task().ticks(self.config.subgoal_s)
    }

    /// A subgoal is where odometry says, and ends as near as it does for the high level; the goal is where it truly is.
    fn has_reached(&self, outcome: Outcome, after: Pose) -> bool {
        if self.target_is_goal {
            return outcome == Outcome::Reached;
        }
        let reached_m = self.episode.simulation().task().decision.subgoal_reached_m;
        (self.target - after.position()).norm() < reached_m
    }

    /// Of a step between two poses that brought the goal nearer by `nearer_m` along the shortest way.
    fn reward(
        &self,
        action: [f32; LOW_ACTION],
        attempt: Attempt,
        [before, after]: [Pose; 2],
        nearer_m: f32,
    ) -> f32 {
        let distance = |pose: Pose| (self.target - pose.position()).norm();
        let navigator = self.episode.navigator();
        let error_rad = wrap_angle(after.bearing_to(self.target) - after.yaw_rad);
        self.config.reward.of_step(&LowStep {
            progress_m: match self.config.progress {
                Progress::Geodesic if self.target_is_goal => nearer_m,
                Progress::Geodesic | Progress::Straight => distance(before) - distance(after),
            },
            target_m: distance(before),
            moved_m: (after.position() - before.position()).norm(),
            direction_error_deg: error_rad.to_degrees(),
            action,
            last_action: self.last_action,
            command: navigator.decode_low(action),
            clearance_m: self.episode.simulation().clearance_m(),
            nearest_m: navigator.scan().nearest_m(),
            reached: attempt == Attempt::Reached,
            collided: attempt == Attempt::Collided,
        })
    }

    /// Whether it drives at the world's goal, not at a random subgoal.
    pub fn target_is_goal(&self) -> bool {
        self.target_is_goal
    }

    /// What it drives at, world frame, for all that odometry is wrong about it now.
    pub fn true_target(&self) -> Point {
        let local = self.episode.navigator().pose().local_from_parent(self.target);
        self.episode.simulation().pose().parent_from_local(local)
    }

    /// The episode it drives.
    pub fn episode(&self) -> &Episode {
        &self.episode
    }
}
