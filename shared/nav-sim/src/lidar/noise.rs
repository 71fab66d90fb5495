//! From true ranges to what a lidar reports.

use crate::normal::standard_normal;
use nav_core::messages::LaserScan;
use nav_core::task;
use rand::{Rng, RngExt};

/// Fills a scan (all but its header) from true ranges.
///
/// Each beam fails with probability `dropout` and then reads NaN: a failed measurement says nothing about
/// what is there, so it must not look like free space (`INFINITY`). Otherwise a hit is off by a normal error
/// of standard deviation `noise_m`; what then lies beyond the longest range reads `INFINITY`, and what lies
/// below the shortest reads 0.
pub fn measure(
    true_ranges_m: &[f32],
    spec: &task::Lidar,
    noise_m: f32,
    dropout: f32,
    rng: &mut impl Rng,
    into: &mut LaserScan,
) {
    into.angle_min_rad = spec.angle_min_rad();
    into.angle_increment_rad = spec.angle_increment_rad();
    into.range_min_m = spec.range_min_m;
    into.range_max_m = spec.range_max_m;
    into.beam_count = true_ranges_m.len() as u32;
    into.reserved = 0;
    for (range_m, &true_m) in into.ranges_m.iter_mut().zip(true_ranges_m) {
        let error_m = if noise_m > 0.0 { noise_m * standard_normal(rng) } else { 0.0 };
        let measured_m = true_m + error_m;
        *range_m = if dropout > 0.0 && rng.random::<f32>() < dropout {
            f32::NAN
        } else if measured_m > spec.range_max_m {
            f32::INFINITY
        } else if measured_m < spec.range_min_m {
            0.0
        } else {
            measured_m
        };
    }
}
