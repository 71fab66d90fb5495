//! A beam search in time: every few steps the best places that the robot can be at, one of each kind.
//!
//! The base is moved as the simulation moves it, with its limits, latency, lag and gain. A command is held for
//! [`HOLD_S`]; walls and people are checked at every substep. Metres and seconds of the constants are those of the
//! reference robot ([`nav_core::scale`]).

use nav_core::geometry::Point;
use nav_core::scale::Scale;
use nav_core::twist::Twist;
use nav_sim::body::Body;
use nav_sim::dynamics::Base;
use nav_sim::geodesic::GeodesicField;
use nav_sim::simulation::Simulation;
use nav_sim::world::Disc;
use std::collections::{HashMap, HashSet};
use std::f32::consts::{PI, TAU};

use super::delay::Delay;
use super::future::Future;

/// A command is held so long, s.
const HOLD_S: f32 = 0.3;
/// Commands, as shares of the fastest; and backwards as fast as the robot may.
const SPEEDS: [f32; 3] = [1.0, 0.5, 0.0];
const TURNS: [f32; 5] = [0.0, 0.5, -0.5, 1.0, -1.0];
/// Two places are of one kind in the same square of this side, m, and with alike directions, speeds and turning rates:
/// parts of a turn, of the fastest speed and of the fastest turn.
const CELL_M: f32 = 0.2;
const DIRECTIONS: f32 = 16.0;
const SPEED_PARTS: f32 = 3.0;
const TURN_PARTS: f32 = 1.5;
/// So many are kept in a larger square: the others are looked for elsewhere.
const CROWDED: usize = 30;
const SQUARE_M: f32 = 1.0;
/// How far ahead of the robot the way to the goal is compared with that from its place, m.
const AHEAD_M: f32 = 0.3;
/// The delay of a place from which the goal seems out of reach, s.
const LOST_S: f32 = 1e3;

/// How hard to search.
#[derive(Clone, Copy, Debug)]
pub(super) struct Effort {
    /// Places kept at each moment.
    pub(super) beam: usize,
    /// Kept to people, m.
    pub(super) gap_m: f32,
    /// Whether to keep off where people often are, rather than wait for a gap between them.
    pub(super) goes_around: bool,
}

/// A search from the present moment of a simulation.
pub(super) struct Search<'a> {
    scale: Scale,
    truth: &'a Simulation,
    field: &'a GeodesicField,
    future: &'a Future,
    effort: Effort,
    steps: usize,
    /// Steps for which a command is held.
    hold: usize,
    /// Where there are people.
    delay: Option<Delay>,
}

/// Where the robot can be.
struct Node {
    base: Base,
    /// Index of the last command in the history; `None` before the first.
    came_by: Option<usize>,
    /// What the rest seems to take, s.
    rest_s: f32,
}

/// A command that was held, and the one before.
struct Held {
    command: Twist,
    before: Option<usize>,
}

/// Where a command leads.
enum Leads {
    Nowhere,
    On(Box<Base>),
    /// After so many steps.
    ToTheGoal(usize),
}

impl<'a> Search<'a> {
    /// Prepares a search over so many steps.
    pub(super) fn new(
        truth: &'a Simulation,
        field: &'a GeodesicField,
        future: &'a Future,
        effort: Effort,
        steps: usize,
    ) -> Self {
        let scale = truth.task().scale();
        let hold = truth.task().ticks(scale.s(HOLD_S)) as usize;
        let has_people = !truth.people().is_empty();
        let delay = has_people.then(|| Delay::new(truth, future, steps, hold, effort.gap_m));
        Self { scale, truth, field, future, effort, steps, hold, delay }
    }

    /// Commands to the goal; else those that last longest, then come nearest.
    pub(super) fn way(&self) -> Vec<Twist> {
        let mut history: Vec<Held> = Vec::new();
        let mut layer = vec![Node { base: self.truth.base().clone(), came_by: None, rest_s: 0.0 }];
        let mut step = 0;
        while step < self.steps {
            let held = self.hold.min(self.steps - step);
            let mut next = Vec::new();
            let mut arrival: Option<(usize, usize)> = None;
            for node in &layer {
                for command in self.commands() {
                    match self.led(&node.base, command, step, held) {
                        Leads::Nowhere => continue,
                        Leads::ToTheGoal(count) => {
                            if arrival.is_none_or(|(least, _)| count < least) {
                                arrival = Some((count, history.len()));
                            }
                        }
                        Leads::On(base) => {
                            let rest_s = self.rest_s(&base, step + held);
                            next.push(Node { base: *base, came_by: Some(history.len()), rest_s });
                        }
                    }
                    history.push(Held { command, before: node.came_by });
                }
            }
            if let Some((count, last)) = arrival {
                return self.written(&history, Some(last), step + count);
            }
            if next.is_empty() {
                break;
            }
            layer = self.best(next);
            step += held;
        }
        self.written(&history, layer[0].came_by, step)
    }

    fn commands(&self) -> impl Iterator<Item = Twist> {
        let robot = self.truth.task().robot;
        let forward = SPEEDS.map(|speed| speed * robot.linear_max_mps);
        let backwards = robot.reverses().then_some(robot.linear_min_mps);
        forward.into_iter().chain(backwards).flat_map(move |linear_mps| {
            TURNS.map(|turn| Twist::new(linear_mps, turn * robot.angular_max_radps))
        })
    }

    /// Holds a command for so many steps from a step on.
    fn led(&self, from: &Base, command: Twist, step: usize, held: usize) -> Leads {
        let mut base = from.clone();
        let substeps = base.substeps() as usize;
        let world = self.truth.world();
        let footprint = self.truth.footprint();
        for count in 0..held {
            base.command(command);
            for substep in 0..substeps {
                base.advance();
                let body = Body::new(footprint, base.pose());
                let people = self.future.after((step + count) * substeps + substep);
                let hits = people.iter().zip(&world.people).any(|(&center, person)| {
                    body.touches_disc(&Disc { center, radius_m: person.radius_m }, self.effort.gap_m)
                });
                if hits || self.truth.obstacles().touches(&body) {
                    return Leads::Nowhere;
                }
                if (world.goal - body.position()).norm() <= self.truth.task().goal_radius_m {
                    return Leads::ToTheGoal(count + 1);
                }
            }
        }
        Leads::On(Box::new(base))
    }

    /// What the rest seems to take after so many steps, s: the way, with what turning towards it costs and speed saves.
    fn rest_s(&self, base: &Base, step: usize) -> f32 {
        let robot = &self.truth.task().robot;
        let (pose, speed_mps) = (base.pose(), base.velocity().linear_mps.max(0.0));
        let Some(here_s) = self.way_s(pose.position(), step) else {
            // Nearer to an obstacle than ways keep: not far from one, but none to prefer.
            return self.scale.s(LOST_S)
                + (self.truth.world().goal - pose.position()).norm() / robot.linear_max_mps;
        };
        let ahead_m = self.scale.m(AHEAD_M);
        let ahead_s = ahead_m / robot.linear_max_mps;
        let ahead = pose.parent_from_local(Point::new(ahead_m, 0.0));
        let gained_s = self.way_s(ahead, step).map_or(-ahead_s, |way_s| here_s - way_s);
        // 0 along the way, 1 against it.
        let turned = (0.5 * (1.0 - gained_s / ahead_s)).clamp(0.0, 1.0);
        let saved_s = speed_mps * speed_mps / (2.0 * robot.linear_acceleration_mps2 * robot.linear_max_mps);
        here_s + turned * PI / robot.angular_max_radps - saved_s
    }

    /// Time from a place to the goal round static obstacles, with what people cost, s.
    fn way_s(&self, place: Point, step: usize) -> Option<f32> {
        let way_s = self.field.distance_m(place)? / self.truth.task().robot.linear_max_mps;
        let Some(delay) = &self.delay else { return Some(way_s) };
        match (delay.at_s(place, step), self.effort.goes_around) {
            (late_s, _) if late_s.is_infinite() => Some(way_s + self.scale.s(LOST_S)),
            (_, true) => delay.around_s(place),
            (late_s, false) => Some(way_s + late_s),
        }
    }

    /// The best of each kind, as many as are kept, best first.
    fn best(&self, mut nodes: Vec<Node>) -> Vec<Node> {
        // Stable: equal ones stay in the order in which they were found.
        nodes.sort_by(|a, b| a.rest_s.total_cmp(&b.rest_s));
        let robot = &self.truth.task().robot;
        let (cell_m, square_m) = (self.scale.m(CELL_M), self.scale.m(SQUARE_M));
        let part = |value: f32, size: f32| (value / size).round() as i32;
        let mut kinds = HashSet::new();
        let mut squares: HashMap<_, usize> = HashMap::new();
        nodes.retain(|node| {
            let (pose, velocity) = (node.base.pose(), node.base.velocity());
            let kept = squares.entry((part(pose.x_m, square_m), part(pose.y_m, square_m))).or_default();
            let kind = (
                part(pose.x_m, cell_m),
                part(pose.y_m, cell_m),
                part(pose.yaw_rad, TAU / DIRECTIONS),
                part(velocity.linear_mps, robot.linear_max_mps / SPEED_PARTS),
                part(velocity.angular_radps, robot.angular_max_radps / TURN_PARTS),
            );
            let is_kept = kinds.len() < self.effort.beam && *kept < CROWDED && kinds.insert(kind);
            *kept += usize::from(is_kept);
            is_kept
        });
        nodes
    }

    /// The commands that end with an entry of the history, so many steps of them.
    fn written(&self, history: &[Held], last: Option<usize>, steps: usize) -> Vec<Twist> {
        let mut commands = Vec::with_capacity(steps + self.hold);
        let mut at = last;
        while let Some(index) = at {
            commands.extend(std::iter::repeat_n(history[index].command, self.hold));
            at = history[index].before;
        }
        commands.reverse();
        // The last may have been held for less.
        commands.truncate(steps);
        commands
    }
}
