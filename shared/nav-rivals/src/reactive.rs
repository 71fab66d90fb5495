//! A reactive rival without memory, after the vector field histogram (Borenstein and Koren 1991): the free
//! direction closest to the goal's, with a little inertia. Metres of the constants are those of the reference robot
//! ([`nav_core::scale`]).

use nav_core::geometry::{Point, wrap_angle};
use nav_core::messages::CmdVel;
use nav_core::scale::Scale;
use nav_core::shield::Shield;
use nav_core::task::Task;
use nav_core::tick::{Inputs, Tick, TickStatus};
use nav_env::robot::Driver;

use crate::follow::Follower;

/// Directions tried.
const DIRECTIONS: usize = 72;
/// A direction is free when the footprint can go this far, m (or to the goal).
const FREE_M: f32 = 1.2;
/// Kept beside the footprint, m.
const BESIDE_M: f32 = 0.08;
/// What a metre too little costs, rad.
const BLOCKED_RADPM: f32 = 10.0;
/// How much nearer to the goal's direction another must be to be preferred to the last one, rad.
const INERTIA_RAD: f32 = 0.3;

/// Steers by the newest scan.
pub struct Reactive {
    follower: Follower,
    scale: Scale,
    last_course_rad: Option<f32>,
}

impl Reactive {
    /// For a task.
    pub fn new(task: &Task) -> Self {
        Self { follower: Follower::new(task), scale: task.scale(), last_course_rad: None }
    }

    fn course_rad(&self) -> f32 {
        let navigator = &self.follower.navigator;
        let pose = navigator.pose();
        let goal_course = pose.bearing_to(navigator.goal());
        let needed_m = self.scale.m(FREE_M).min(navigator.goal_distance_m());
        let lane = self.follower.task.robot.footprint.lane(self.scale.m(BESIDE_M));
        let mut best = (f32::INFINITY, goal_course);
        for k in 0..DIRECTIONS {
            let course = goal_course + k as f32 * (std::f32::consts::TAU / DIRECTIONS as f32);
            let bearing = course - pose.yaw_rad;
            let (sin, cos) = libm::sincosf(bearing);
            let free_m = navigator.scan().corridor_m(cos, sin, &lane, needed_m);
            let blocked = (needed_m - free_m) / self.scale.length * BLOCKED_RADPM;
            let away = wrap_angle(course - goal_course).abs();
            let inertia = self
                .last_course_rad
                .map_or(0.0, |last| INERTIA_RAD * (wrap_angle(course - last).abs() / std::f32::consts::PI));
            let cost = blocked + away + inertia;
            if cost < best.0 {
                best = (cost, course);
            }
        }
        best.1
    }
}

impl Driver for Reactive {
    fn shield(&self) -> Option<&Shield> {
        self.follower.shield()
    }
}

impl Tick for Reactive {
    fn tick(&mut self, now_ns: u64, inputs: Inputs<'_>) -> (CmdVel, TickStatus) {
        if self.follower.observe(&inputs) {
            self.last_course_rad = None;
        }
        let course = self.course_rad();
        self.last_course_rad = Some(course);
        let position = self.follower.navigator.pose().position();
        let (sin, cos) = libm::sincosf(course);
        let ahead_m = self.scale.m(1.0);
        let target = Point::new(position.x + ahead_m * cos, position.y + ahead_m * sin);
        self.follower.towards(now_ns, &inputs, target)
    }

    fn task(&self) -> &Task {
        &self.follower.task
    }
}
