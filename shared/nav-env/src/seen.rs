//! What a robot saw and did at a moment, for pictures: its messages and tracks where they truly are.

use nav_core::geometry::Point;
use nav_core::tracker::Track;
use nav_core::twist::Twist;
use nav_sim::drawing::Seen;
use nav_sim::people::PersonState;
use nav_sim::simulation::Simulation;

use crate::messages::Messages;

/// What was measured at a simulation's present moment, and who is followed, in the world frame; nothing wished or done yet.
pub fn seen(simulation: &Simulation, messages: &Messages, tracks: &[Track]) -> Seen {
    let (Messages { scan, odom, .. }, pose) = (messages, simulation.pose());
    let lidar_pose = simulation.task().lidar.pose(pose);
    let hits = scan.ranges_m().iter().enumerate().filter(|(_, range_m)| **range_m < scan.range_max_m);
    let hits = hits.map(|(beam, range_m)| {
        let (sin, cos) = libm::sincosf(scan.angle_min_rad + beam as f32 * scan.angle_increment_rad);
        lidar_pose.parent_from_local(Point::new(range_m * cos, range_m * sin))
    });
    let world_from_odom = pose.after(&odom.pose.inverse());
    let tracks = tracks.iter().map(|track| {
        let position = world_from_odom.parent_from_local(track.position);
        let ahead = world_from_odom.parent_from_local(track.position + track.velocity);
        PersonState { position, velocity: ahead - position, radius_m: track.radius_m }
    });
    Seen {
        hits: hits.collect(),
        tracks: tracks.collect(),
        wish: Twist::ZERO,
        command: Twist::ZERO,
        intervention: None,
    }
}
