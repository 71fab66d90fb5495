//! The ceiling: a driver that knows how everybody is going to walk, how its own base answers, and the whole map.
//!
//! No robot can know that. What it reaches is what can be reached in a world with the same base, the same latency, lag
//! and gain: where it collides, nobody is to blame; where another does and it does not, prediction was missing.
//!
//! | step | what happens | file |
//! |---|---|---|
//! | 1 | everybody's motion is rolled on to the end of the episode, as if the robot stood | `future.rs` |
//! | 2 | a way through it is searched in space and time, led by where people will be | `search.rs`, `delay.rs` |
//! | 3 | the way is driven in a copy of the simulation, where those who see the robot make room for it | `future.rs` |
//! | 4 | where that ends in a collision, the search is repeated in the motion that step 3 has seen, harder | |
//!
//! A way that step 3 drives to the goal is driven as it is: the simulation is exact, and does the same again. Else half
//! of the best one is driven, or the robot stands where it can for longer, and the rest is searched from there. All of that happens when the truth is shown, before the
//! tick: the time of its ticks says nothing.

mod future;
mod delay;
mod search;

use future::{Future, Verdict};
use nav_core::messages::{CmdVel, Header, RunState};
use nav_core::task::{ACTION_GOAL, Task};
use nav_core::tick::{Inputs, Tick, TickStatus};
use nav_core::twist::Twist;
use nav_env::robot::Driver;
use nav_env::worlds::Place;
use nav_sim::geodesic::GeodesicField;
use nav_sim::simulation::Simulation;
use search::{Effort, Search};
use std::sync::Arc;

/// What is tried until a way holds, in this order.
const EFFORTS: [Effort; 6] = [
    Effort { beam: 60, gap_m: 0.1, goes_around: false },
    Effort { beam: 60, gap_m: 0.1, goes_around: true },
    Effort { beam: 100, gap_m: 0.05, goes_around: false },
    Effort { beam: 100, gap_m: 0.05, goes_around: true },
    Effort { beam: 300, gap_m: 0.02, goes_around: false },
    Effort { beam: 300, gap_m: 0.02, goes_around: true },
];

/// So long a way that does not lead to the goal is driven at most, s of the reference robot ([`nav_core::scale`]).
const DRIVEN_MAX_S: f32 = 3.0;

/// Plans in the future, and drives the plan.
pub struct Clairvoyant {
    task: Task,
    field: Option<Arc<GeodesicField>>,
    /// What is still to be commanded, the next last.
    plan: Vec<Twist>,
    commands: u64,
}

impl Clairvoyant {
    /// For a task.
    pub fn new(task: &Task) -> Self {
        Self { task: *task, field: None, plan: Vec::new(), commands: 0 }
    }
}

/// Commands to the goal, or the first half of those that last longest.
fn planned(truth: &Simulation, field: &GeodesicField) -> Vec<Twist> {
    let steps = truth.steps_left() as usize;
    let driven_max = truth.task().ticks(truth.task().scale().s(DRIVEN_MAX_S)) as usize;
    let standing = vec![Twist::ZERO; steps];
    let mut future = Future::of(truth, &standing, steps);
    let stands = future.lasts();
    let mut best = (0, Vec::new());
    for effort in EFFORTS {
        let way = Search::new(truth, field, &future, effort, steps).way();
        let driven = Future::of(truth, &way, steps);
        if driven.verdict == Verdict::Reached {
            return way;
        }
        let safe = driven.lasts().min(way.len());
        if safe > best.0 || best.1.is_empty() {
            best = (safe, way);
        }
        future = driven;
    }
    // Whoever has no way left had better stand.
    let (safe, mut way) = if best.0 < driven_max && stands > best.0 { (stands, standing) } else { best };
    way.truncate((safe / 2).clamp(1, driven_max));
    way
}

impl Driver for Clairvoyant {
    fn begin(&mut self, place: &Place) {
        self.field = Some(place.field.clone());
        self.plan.clear();
    }

    fn see(&mut self, truth: &Simulation) {
        let Some(field) = self.field.as_ref().filter(|_| self.plan.is_empty()) else { return };
        self.plan = planned(truth, field);
        self.plan.reverse();
    }
}

impl Tick for Clairvoyant {
    fn tick(&mut self, now_ns: u64, inputs: Inputs<'_>) -> (CmdVel, TickStatus) {
        let out = self.plan.pop().unwrap_or(Twist::ZERO);
        self.commands += 1;
        let command = CmdVel {
            header: Header { stamp_ns: now_ns, seq: self.commands },
            linear_mps: out.linear_mps,
            angular_radps: out.angular_radps,
            scan_seq: inputs.scan.header.seq,
            faults: 0,
            state: RunState::Driving as u32,
        };
        let goal = (inputs.goal.x_m, inputs.goal.y_m);
        let status = TickStatus {
            state: RunState::Driving,
            faults: 0,
            cause: None,
            wish: out,
            intervention: None,
            decided: None,
            action: ACTION_GOAL,
            subgoal_m: goal,
            goal_distance_m: libm::hypotf(goal.0 - inputs.odom.pose.x_m, goal.1 - inputs.odom.pose.y_m),
        };
        (command, status)
    }

    fn task(&self) -> &Task {
        &self.task
    }
}
