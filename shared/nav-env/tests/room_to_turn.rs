//! A box that the safety gate stops before something can still turn aside and drive on.

use nav_core::footprint::Footprint;
use nav_core::geometry::{Point, Pose, wrap_angle};
use nav_core::guard::Guard;
use nav_core::messages::LaserScan;
use nav_core::shield::{Open, Shield};
use nav_core::task::{Robot, Task};
use nav_core::twist::Twist;
use nav_sim::disturbance::Disturbance;
use nav_sim::simulation::{Outcome, Simulation};
use nav_sim::world::{Bounds, Segment, World};
use std::sync::Arc;

/// A wall before the robot.
fn world() -> World {
    let middle = Point::new(4.0, 4.0);
    World {
        name: "before a wall".into(),
        bounds: Bounds { min: Point::origin(), max: Point::new(8.0, 8.0) },
        discs: Vec::new(),
        segments: vec![Segment { a: Point::new(middle.x + 2.0, 2.0), b: Point::new(middle.x + 2.0, 6.0) }],
        polygons: Vec::new(),
        people: Vec::new(),
        start: Pose::new(middle.x, middle.y, 0.0),
        goal: Point::new(-100.0, 0.0),
    }
}

/// So far aside it is turned, rad.
const ASIDE_RAD: f32 = 1.6;

/// How far it turned, rad, within 12 s of wishing so, after it was driven up to what stands there for 6 s and stopped; and how far it
/// drove on ahead within the next 4 s, m.
fn turned_and_driven(task: &Task, turn_radps: f32) -> (f32, f32) {
    let mut simulation = Simulation::new(Arc::new(world()), task, &Disturbance::none(), 1);
    let (mut guard, mut shield) = (Guard::new(task), Shield::new(task));
    let mut scan = Box::<LaserScan>::default();
    let ahead = Twist::new(task.robot.linear_max_mps, 0.0);
    let (mut turned_rad, mut driven_m) = (0.0, 0.0);
    for step in 0..240 {
        simulation.scan(&mut scan);
        let odom = simulation.odometry();
        shield.see(&scan, odom.pose);
        let wish = match step {
            0..60 => ahead,
            60..80 => Twist::ZERO,
            80..200 if f32::abs(turned_rad) < ASIDE_RAD => Twist::new(0.0, turn_radps),
            80..200 => Twist::ZERO,
            _ => ahead,
        };
        let (safe, _) = shield.filter(wish, odom.twist(), guard.sent(), Open { ahead: true, behind: true });
        let (command, _) = guard.limit(safe);
        assert!(simulation.step(command) != Outcome::Collided, "it touched something after {step} steps");
        match step {
            0..79 => {}
            79 => {
                assert!(simulation.velocity().linear_mps.abs() < 0.01, "it should stand");
                let away_m = simulation.clearance_m();
                assert!(away_m < 0.4, "it should stand near something: {away_m} m");
            }
            80..200 => turned_rad += wrap_angle(simulation.pose().yaw_rad - odom.pose.yaw_rad),
            _ => driven_m += (simulation.pose().position() - odom.pose.position()).norm(),
        }
    }
    (turned_rad, driven_m)
}

#[test]
fn a_box_that_was_driven_up_to_something_can_turn_aside_either_way() {
    let rectangle = |front_m, rear_m, half_width_m| Footprint::Rectangle { front_m, rear_m, half_width_m };
    for (footprint, linear_min_mps) in [
        (rectangle(0.1, 0.3, 0.2), 0.0),
        (rectangle(0.0, 0.4, 0.25), 0.0),
        (rectangle(0.3, 0.3, 0.2), 0.0),
        (rectangle(0.3, 0.1, 0.2), -0.5),
    ] {
        let robot = Robot { footprint, linear_min_mps, ..Robot::default() };
        let task = Task { robot, episode_s: 1_000.0, ..Task::default() };
        for turn_radps in [0.6, -0.6] {
            let (turned_rad, driven_m) = turned_and_driven(&task, turn_radps);
            assert!(
                turned_rad * turn_radps.signum() > 1.5 && driven_m > 1.0,
                "{footprint}, {turn_radps} rad/s: turned by {turned_rad} rad, then drove {driven_m} m"
            );
        }
    }
}
