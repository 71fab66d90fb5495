//! The time of an update, apart from everything else.

use super::quantile;
use nav_core::geometry::{Pose, Vector};
use nav_core::messages::LaserScan;
use nav_core::scan::beams::Beams;
use nav_core::task::{Lidar, Task};
use nav_core::tracker::Tracker;
use nav_sim::lidar::ray_disc_m;
use std::time::Instant;

/// Time of an update, in a loop that does nothing else, with 32 people who walk round the robot in a ring: followed tracks
/// (median), and time (median and 99th percentile, us).
pub(crate) fn ring(beam_count: u32) -> (f32, f32, f32) {
    let lidar = Lidar { beam_count, range_max_m: 8.0, ..Lidar::default() };
    let task = Task { lidar, ..Task::default() };
    let (mut tracker, mut beams) = (Box::new(Tracker::new(&task)), Box::new(Beams::new()));
    let (mut tracks, mut update_ns) = (Vec::new(), Vec::new());
    for step in 1..=2000_u32 {
        let people = (0..32_u32).map(|person| {
            let (sin, cos) = libm::sincosf(person as f32 * 0.196_35 + step as f32 * 0.012);
            Vector::new(4.4 * cos, 4.4 * sin)
        });
        let people: Vec<Vector> = people.collect();
        let scan = LaserScan::of(&lidar, |angle_rad| {
            let (sin, cos) = libm::sincosf(angle_rad);
            let ranges = people.iter().map(|person| ray_disc_m(cos, sin, *person, 0.25));
            ranges.fold(f32::INFINITY, f32::min)
        });
        let begun = Instant::now();
        beams.read(&scan, f32::INFINITY);
        tracker.update(&beams, Pose::default(), u64::from(step) * 100_000_000);
        if step > 100 {
            update_ns.push(begun.elapsed().as_nanos() as f32);
            tracks.push(tracker.tracks().len() as f32);
        }
    }
    (quantile(&mut tracks, 0.5), quantile(&mut update_ns, 0.5) / 1e3, quantile(&mut update_ns, 0.99) / 1e3)
}
