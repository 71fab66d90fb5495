//! A scene with a known truth, and a robot that looks at it.

extern crate std;

use super::super::*;
use crate::geometry::{Vector, wrap_angle};
use crate::messages::LaserScan;
use crate::task::Lidar;
use std::vec::Vec;

/// A round thing with a velocity.
#[derive(Clone, Copy, Debug)]
pub(super) struct Disc {
    pub(super) at: Point,
    pub(super) velocity: Vector,
    pub(super) radius_m: f32,
}

pub(super) fn person(x: f32, y: f32, vx: f32, vy: f32) -> Disc {
    Disc { at: Point::new(x, y), velocity: Vector::new(vx, vy), radius_m: 0.25 }
}

/// Discs and walls in the `odom` frame, and a robot.
pub(super) struct Scene {
    pub(super) tracker: Tracker,
    pub(super) beams: Beams,
    pub(super) lidar: Lidar,
    pub(super) discs: Vec<Disc>,
    walls: Vec<(Point, Point)>,
    pub(super) pose: Pose,
    pub(super) turn_radps: f32,
    pub(super) stamp_ns: u64,
    pub(super) noise_m: f32,
    pub(super) failed_share: f32,
    /// Error of the believed pose, m and rad.
    pub(super) jitter: f32,
    pub(super) seed: u64,
}

impl Scene {
    pub(super) fn new(beam_count: u32) -> Self {
        let lidar = Lidar { beam_count, ..Lidar::default() };
        Self {
            tracker: Tracker::new(&Task::default()),
            beams: Beams::new(),
            lidar,
            discs: Vec::new(),
            walls: Vec::new(),
            pose: Pose::default(),
            turn_radps: 0.0,
            stamp_ns: 1_000_000_000,
            noise_m: 0.0,
            failed_share: 0.0,
            jitter: 0.0,
            seed: 0,
        }
    }

    fn range_m(&self, angle_rad: f32) -> f32 {
        let (y, x) = libm::sincosf(self.pose.yaw_rad + angle_rad);
        let here = self.pose.position();
        let discs = self.discs.iter().map(|disc| {
            let to = disc.at - here;
            let (along, aside) = (x * to.x + y * to.y, x * to.y - y * to.x);
            let half2 = disc.radius_m * disc.radius_m - aside * aside;
            if half2 >= 0.0 && along > 0.0 { along - libm::sqrtf(half2) } else { f32::INFINITY }
        });
        let walls = self.walls.iter().map(|(a, b)| {
            let (a, b) = (a - here, b - here);
            let (aside_a, aside_b) = (x * a.y - y * a.x, x * b.y - y * b.x);
            let (along_a, along_b) = (x * a.x + y * a.y, x * b.x + y * b.y);
            let hit = along_a + aside_a / (aside_a - aside_b) * (along_b - along_a);
            if aside_a * aside_b <= 0.0 && hit >= 0.0 { hit } else { f32::INFINITY }
        });
        let nearest = discs.chain(walls).fold(f32::INFINITY, f32::min);
        if nearest > self.lidar.range_max_m { f32::INFINITY } else { nearest }
    }

    /// Everybody moves, then a scan is taken in.
    pub(super) fn step(&mut self, dt_s: f32) {
        for disc in &mut self.discs {
            disc.at += disc.velocity * dt_s;
        }
        self.pose.yaw_rad = wrap_angle(self.pose.yaw_rad + self.turn_radps * dt_s);
        self.stamp_ns += (f64::from(dt_s) * 1e9) as u64;
        let mut scan = LaserScan::of(&self.lidar, |angle| self.range_m(angle));
        for (beam, range_m) in scan.ranges_m.iter_mut().enumerate() {
            let salt = self.stamp_ns ^ (self.seed << 32);
            *range_m += 1.7 * self.noise_m * hashed(salt, beam as u64);
            if hashed(salt, beam as u64 + 5000) < 2.0 * self.failed_share - 1.0 {
                *range_m = f32::NAN;
            }
        }
        self.beams.read(&scan, f32::INFINITY);
        let jitter = |salt: u64| self.jitter * hashed(self.stamp_ns, salt);
        let believed = Pose {
            x_m: self.pose.x_m + jitter(7001),
            y_m: self.pose.y_m + jitter(7002),
            yaw_rad: wrap_angle(self.pose.yaw_rad + jitter(7003)),
        };
        self.tracker.update(&self.beams, believed, self.stamp_ns);
    }

    pub(super) fn steps(&mut self, count: usize) {
        for _ in 0..count {
            self.step(0.1);
        }
    }

    pub(super) fn wall(&mut self, a: (f32, f32), b: (f32, f32)) {
        self.walls.push((Point::new(a.0, a.1), Point::new(b.0, b.1)));
    }

    pub(super) fn nearest(&self, disc: usize) -> &Track {
        let at = self.discs[disc].at;
        let tracks = self.tracker.tracks().iter();
        tracks
            .min_by(|a, b| (a.position - at).norm().total_cmp(&(b.position - at).norm()))
            .expect("somebody is followed")
    }

    pub(super) fn assert_followed(&self, disc: usize, what: &str) {
        let (track, truth) = (self.nearest(disc), self.discs[disc]);
        assert!(track.is_moving(), "{what}: {track:?}");
        assert!((track.position - truth.at).norm() < 0.15, "{what}: {} {track:?}", truth.at);
        assert!((track.velocity - truth.velocity).norm() < 0.2, "{what}: {track:?}");
    }
}

/// An even number in [-1, 1] for each argument.
pub(super) fn hashed(a: u64, b: u64) -> f32 {
    let mut z = a.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ b.wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 30)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^= z >> 31;
    (z >> 40) as f32 / 8_388_608.0 - 1.0
}
