//! A planar lidar.
//!
//! Instead of testing each beam against each obstacle, each obstacle in range is turned into the few beams
//! that can hit it (`span.rs`), and only those are tested, exactly (`cast.rs`). The angle of an obstacle is
//! approximated, but always outwards: a beam too many costs a test, and no beam is ever left out.
//!
//! `parry2d` 0.31 was measured against this on one core (AMD EPYC, 5th generation), 72 beams of 5 m: 20 discs
//! 1.1 µs here, 9.8 µs with its bounding volume hierarchy and 13.7 µs testing all; 64 walls 3.0 µs, 12.3 µs and
//! 66.5 µs. Its ranges were the same.

mod span;
mod cast;
mod noise;

pub use cast::{ray_disc_m, ray_segment_m};
pub use noise::measure;

use crate::obstacles::Obstacles;
use crate::world::Disc;
use nav_core::geometry::{Pose, Vector};
use nav_core::messages::MAX_BEAMS;
use nav_core::task;
use span::Spans;

/// The beams of a lidar and the room for one scan.
#[derive(Clone, Debug)]
pub struct Lidar {
    spec: task::Lidar,
    spans: Spans,
    /// Directions of the beams in the lidar's frame, x and y apart.
    x: Vec<f32>,
    y: Vec<f32>,
    ranges_m: Vec<f32>,
}

impl Lidar {
    /// The lidar of a task. More than [`MAX_BEAMS`] beams are cut.
    pub fn new(spec: &task::Lidar) -> Self {
        let count = (spec.beam_count as usize).clamp(1, MAX_BEAMS);
        let angle_rad = |k: usize| spec.angle_min_rad() + k as f32 * spec.angle_increment_rad();
        Self {
            spec: *spec,
            spans: Spans::new(spec.angle_min_rad(), spec.angle_increment_rad(), count),
            x: (0..count).map(|k| libm::cosf(angle_rad(k))).collect(),
            y: (0..count).map(|k| libm::sinf(angle_rad(k))).collect(),
            ranges_m: vec![f32::INFINITY; count],
        }
    }

    /// The lidar's geometry.
    pub fn spec(&self) -> &task::Lidar {
        &self.spec
    }

    /// The true distance along each beam from `pose` to the first static or moving obstacle, m. `INFINITY`
    /// where there is none within the longest range; 0 all round when `pose` lies inside a disc.
    pub fn cast(&mut self, pose: Pose, obstacles: &Obstacles, moving: impl Iterator<Item = Disc>) -> &[f32] {
        self.ranges_m.fill(f32::INFINITY);
        let (sin, cos) = (libm::sinf(pose.yaw_rad), libm::cosf(pose.yaw_rad));
        let origin = pose.position();
        let lidar_from_world = |x: Vector| Vector::new(cos * x.x + sin * x.y, cos * x.y - sin * x.x);
        for disc in moving {
            self.cast_disc(lidar_from_world(disc.center - origin), disc.radius_m);
        }
        for (beyond_m, cells) in obstacles.rings(origin) {
            if beyond_m > self.farthest_m() {
                break;
            }
            for (edges, discs) in cells {
                for disc in discs {
                    self.cast_disc(lidar_from_world(disc.center - origin), disc.radius_m);
                }
                for edge in edges {
                    self.cast_segment(lidar_from_world(edge.a - origin), lidar_from_world(edge.b - origin));
                }
            }
        }
        let range_max_m = self.spec.range_max_m;
        for range_m in &mut self.ranges_m {
            if *range_m > range_max_m {
                *range_m = f32::INFINITY;
            }
        }
        &self.ranges_m
    }

    /// Nothing beyond this can change the scan any more, m.
    fn farthest_m(&self) -> f32 {
        self.ranges_m.iter().fold(0.0_f32, |far, &range| far.max(range)).min(self.spec.range_max_m)
    }

    fn cast_disc(&mut self, center: Vector, radius_m: f32) {
        let reach_m = self.spec.range_max_m + radius_m;
        let distance_m2 = center.norm_squared();
        if distance_m2 > reach_m * reach_m {
            return;
        }
        if distance_m2 <= radius_m * radius_m {
            self.ranges_m.fill(0.0);
            return;
        }
        for beams in self.spans.of_disc(center, radius_m) {
            let lanes =
                self.x[beams.clone()].iter().zip(&self.y[beams.clone()]).zip(&mut self.ranges_m[beams]);
            for ((&x, &y), range_m) in lanes {
                *range_m = range_m.min(ray_disc_m(x, y, center, radius_m));
            }
        }
    }

    fn cast_segment(&mut self, a: Vector, b: Vector) {
        if cast::is_segment_beyond(a, b, self.spec.range_max_m) {
            return;
        }
        for beams in self.spans.of_segment(a, b) {
            let lanes =
                self.x[beams.clone()].iter().zip(&self.y[beams.clone()]).zip(&mut self.ranges_m[beams]);
            for ((&x, &y), range_m) in lanes {
                *range_m = range_m.min(ray_segment_m(x, y, a, b));
            }
        }
    }
}
