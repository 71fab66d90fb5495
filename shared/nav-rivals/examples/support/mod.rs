//! What the examples measure with.

use nav_core::geometry::Vector;
use nav_core::messages::LaserScan;
use nav_core::task::{Lidar, Task};
use nav_sim::lidar::ray_disc_m;

/// A robot among walkers, with a lidar that sees all of them.
pub(crate) fn task_among_walkers(beam_count: u32) -> Task {
    Task { lidar: Lidar { beam_count, range_max_m: 8.0, ..Lidar::default() }, ..Task::default() }
}

/// What a robot sees round which 32 people walk in a ring of 4.4 m, everybody as near to the next as they come before they
/// touch each other, once they have walked through an angle.
pub(crate) fn ring_of_walkers(lidar: &Lidar, walked_rad: f32) -> LaserScan {
    let people: Vec<Vector> = (0..32_u32)
        .map(|person| {
            let (sin, cos) = libm::sincosf(person as f32 * 0.196_35 + walked_rad);
            Vector::new(4.4 * cos, 4.4 * sin)
        })
        .collect();
    LaserScan::of(lidar, |angle_rad| {
        let (sin, cos) = libm::sincosf(angle_rad);
        let ranges = people.iter().map(|person| ray_disc_m(cos, sin, *person, 0.25));
        ranges.fold(f32::INFINITY, f32::min)
    })
}

/// The value below which a share of the values lies.
pub(crate) fn quantile(values: &mut [f32], share: f32) -> f32 {
    values.sort_by(f32::total_cmp);
    let place = (share * values.len().saturating_sub(1) as f32) as usize;
    values.get(place).copied().unwrap_or(f32::NAN)
}
