//! A differential-drive base: command latency, limits, lag, and exact arcs.

use crate::disturbance::{DrawnDisturbance, LATENCY_MAX_STEPS};
use nav_core::footprint::Footprint;
use nav_core::geometry::{Pose, Vector};
use nav_core::task::{Robot, Task};
use nav_core::twist::Twist;

/// The fewest parts into which a control period is split for motion and collision checks.
const SUBSTEPS_MIN: u32 = 2;
/// The most such parts.
const SUBSTEPS_MAX: u32 = 64;
/// Slots for commands on their way.
const QUEUE_LEN: usize = LATENCY_MAX_STEPS as usize + 1;

/// The moving base.
#[derive(Clone, Debug)]
pub struct Base {
    robot: Robot,
    pose: Pose,
    velocity: Twist,
    target: Twist,
    queue: [Twist; QUEUE_LEN],
    queue_at: usize,
    latency_steps: usize,
    gain: f32,
    /// Share of the remaining difference to the target that is made up in one substep.
    follow: f32,
    substep_s: f32,
    substeps: u32,
}

impl Base {
    /// A base at rest.
    pub fn new(task: &Task, disturbance: &DrawnDisturbance, pose: Pose) -> Self {
        let substeps = substeps(task, disturbance);
        let substep_s = task.control_period_s / substeps as f32;
        let lag_s = disturbance.actuation_lag_s;
        Self {
            robot: task.robot,
            pose,
            velocity: Twist::ZERO,
            target: Twist::ZERO,
            queue: [Twist::ZERO; QUEUE_LEN],
            queue_at: 0,
            latency_steps: disturbance.latency_steps.min(LATENCY_MAX_STEPS) as usize,
            gain: disturbance.velocity_gain,
            follow: if lag_s > 0.0 { 1.0 - libm::expf(-substep_s / lag_s) } else { 1.0 },
            substep_s,
            substeps,
        }
    }

    /// Takes the command of a control period; what was commanded `latency_steps` periods ago takes effect.
    pub fn command(&mut self, command: Twist) {
        self.queue[self.queue_at] = self.robot.limited(command);
        let effective = self.queue[(self.queue_at + QUEUE_LEN - self.latency_steps) % QUEUE_LEN];
        self.queue_at = (self.queue_at + 1) % QUEUE_LEN;
        self.target = Twist {
            linear_mps: self.gain * effective.linear_mps,
            angular_radps: self.gain * effective.angular_radps,
        };
    }

    /// Moves for one substep: a change of velocity within the acceleration limits, then an exact arc.
    pub fn advance(&mut self) {
        let towards = |now: f32, target: f32, acceleration: f32| {
            let limit = acceleration * self.substep_s;
            now + (self.follow * (target - now)).clamp(-limit, limit)
        };
        self.velocity = Twist {
            linear_mps: towards(
                self.velocity.linear_mps,
                self.target.linear_mps,
                self.robot.linear_acceleration_mps2,
            ),
            angular_radps: towards(
                self.velocity.angular_radps,
                self.target.angular_radps,
                self.robot.angular_acceleration_radps2,
            ),
        };
        self.pose = self.pose.advanced(self.velocity, self.substep_s);
    }

    /// True pose in the world.
    pub fn pose(&self) -> Pose {
        self.pose
    }

    /// True velocity.
    pub fn velocity(&self) -> Twist {
        self.velocity
    }

    /// True velocity in the world, m/s.
    pub fn velocity_in_world(&self) -> Vector {
        Vector::new(libm::cosf(self.pose.yaw_rad), libm::sinf(self.pose.yaw_rad)) * self.velocity.linear_mps
    }

    /// Duration of a substep, s.
    pub fn substep_s(&self) -> f32 {
        self.substep_s
    }

    /// Substeps of a control period.
    pub fn substeps(&self) -> u32 {
        self.substeps
    }
}

/// So many that nothing of the base moves by more than half its radius (of a rectangle, a quarter of its shorter side)
/// between collision checks; then no wall, however thin, is jumped, and a corner can be grazed unseen by 3 % of the radius
/// at most.
fn substeps(task: &Task, drawn: &DrawnDisturbance) -> u32 {
    let robot = &task.robot;
    // A disc that turns stays where it is.
    let (size_m, corner_mps) = match robot.footprint {
        Footprint::Circle { radius_m } => (radius_m, 0.0),
        Footprint::Rectangle { front_m, rear_m, half_width_m } => {
            let corner_mps = robot.angular_max_radps * robot.footprint.circumradius_m();
            (half_width_m.min(0.5 * (front_m + rear_m)), corner_mps)
        }
    };
    let fastest_m =
        (robot.linear_max_mps + corner_mps) * task.control_period_s * drawn.velocity_gain.max(1.0);
    ((2.0 * fastest_m / (size_m * drawn.radius_scale.min(1.0))) as u32 + 1).clamp(SUBSTEPS_MIN, SUBSTEPS_MAX)
}
