//! The time of an update, apart from everything else.

use super::support::{quantile, ring_of_walkers, task_among_walkers};
use nav_core::geometry::Pose;
use nav_core::scan::beams::Beams;
use nav_core::tracker::Tracker;
use std::time::Instant;

/// Time of an update, in a loop that does nothing else, with 32 people who walk round the robot in a ring at 0.5 m/s: followed
/// tracks (median), and time (median and 99th percentile, us).
pub(crate) fn ring(beam_count: u32) -> (f32, f32, f32) {
    let task = task_among_walkers(beam_count);
    let (mut tracker, mut beams) = (Box::new(Tracker::new(&task)), Box::new(Beams::new()));
    let (mut tracks, mut update_ns) = (Vec::new(), Vec::new());
    for step in 1..=2000_u32 {
        let scan = ring_of_walkers(&task.lidar, step as f32 * 0.012);
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
