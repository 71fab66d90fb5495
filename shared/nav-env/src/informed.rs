//! A ceiling for prediction: a controller whose safety gate is told where everybody is and how they walk.
//!
//! The gate hears of everybody within the lidar's range of the robot, also of those whom the lidar does not see, with their
//! true positions and velocities of the moment; nobody's plans. The policy sees the scan, as ever. What this reaches and
//! the robot does not is lost by following people ([`nav_core::tracker`]); what the rival `clairvoyant` reaches and
//! this does not, by not knowing what they are about to do.

use nav_core::controller::Controller;
use nav_core::geometry::Vector;
use nav_core::messages::CmdVel;
use nav_core::shield::{Mover, Shield};
use nav_core::task::Task;
use nav_core::tick::{Inputs, Tick, TickStatus};
use nav_sim::simulation::Simulation;

use crate::robot::Driver;

/// A controller that is told who moves.
#[derive(Debug)]
pub struct Informed<S>(pub Controller<S>);

impl<S: AsRef<[f32]> + AsMut<[f32]>> Tick for Informed<S> {
    fn tick(&mut self, now_ns: u64, inputs: Inputs<'_>) -> (CmdVel, TickStatus) {
        self.0.tick(now_ns, inputs)
    }

    fn task(&self) -> &Task {
        self.0.task()
    }
}

impl<S: AsRef<[f32]> + AsMut<[f32]>> Driver for Informed<S> {
    fn see(&mut self, truth: &Simulation) {
        if let Some(shield) = self.0.shield_mut() {
            shield.inform(movers(truth).into_iter());
        }
    }

    fn shield(&self) -> Option<&Shield> {
        self.0.shield()
    }
}

/// Everybody within the lidar's range, nearest first, in the frame that odometry believes in.
pub fn movers(truth: &Simulation) -> Vec<Mover> {
    let here = truth.pose();
    let odom_from_world = truth.odometry().pose.after(&here.inverse());
    let (sin, cos) = libm::sincosf(odom_from_world.yaw_rad);
    let turned = |v: Vector| Vector::new(cos * v.x - sin * v.y, sin * v.x + cos * v.y);
    let mut near: Vec<_> = truth
        .people()
        .iter()
        .map(|person| {
            let away_m = (person.position - here.position()).norm();
            let position = odom_from_world.parent_from_local(person.position);
            (away_m, Mover { position, velocity: turned(person.velocity), radius_m: person.radius_m })
        })
        .filter(|(away_m, _)| *away_m < truth.task().lidar.range_max_m)
        .collect();
    near.sort_by(|a, b| a.0.total_cmp(&b.0));
    near.into_iter().map(|(_, mover)| mover).collect()
}
