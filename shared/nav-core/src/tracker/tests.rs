//! Scenes with a known truth.

extern crate std;

use super::*;
use crate::geometry::Vector;
use crate::messages::LaserScan;
use crate::task::Lidar;
use std::vec::Vec;

/// A round thing with a velocity.
#[derive(Clone, Copy, Debug)]
struct Disc {
    at: Point,
    velocity: Vector,
    radius_m: f32,
}

fn person(x: f32, y: f32, vx: f32, vy: f32) -> Disc {
    Disc { at: Point::new(x, y), velocity: Vector::new(vx, vy), radius_m: 0.25 }
}

/// Discs and walls in the `odom` frame, and a robot.
struct Scene {
    tracker: Tracker,
    beams: Beams,
    lidar: Lidar,
    discs: Vec<Disc>,
    walls: Vec<(Point, Point)>,
    pose: Pose,
    turn_radps: f32,
    stamp_ns: u64,
}

impl Scene {
    fn new(beam_count: u32) -> Self {
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
    fn step(&mut self, dt_s: f32) {
        for disc in &mut self.discs {
            disc.at += disc.velocity * dt_s;
        }
        self.pose.yaw_rad = crate::geometry::wrap_angle(self.pose.yaw_rad + self.turn_radps * dt_s);
        self.stamp_ns += (f64::from(dt_s) * 1e9) as u64;
        let scan = LaserScan::of(&self.lidar, |angle| self.range_m(angle));
        self.beams.read(&scan, f32::INFINITY);
        self.tracker.update(&self.beams, self.pose, self.stamp_ns);
    }

    fn steps(&mut self, count: usize) {
        for _ in 0..count {
            self.step(0.1);
        }
    }

    fn nearest(&self, disc: usize) -> &Track {
        let at = self.discs[disc].at;
        let tracks = self.tracker.tracks().iter();
        tracks
            .min_by(|a, b| (a.position - at).norm().total_cmp(&(b.position - at).norm()))
            .expect("somebody is followed")
    }
}

#[test]
fn whoever_walks_is_followed_with_place_and_velocity() {
    for beams in [72, 180, 360, 720, 1440] {
        let mut scene = Scene::new(beams);
        scene.discs.push(person(2.0, -1.0, 0.0, 0.8));
        scene.steps(15);
        let (track, truth) = (scene.nearest(0), scene.discs[0]);
        assert!(track.is_moving(), "{beams} beams: {track:?}");
        assert!((track.position - truth.at).norm() < 0.1, "{beams} beams: {track:?}");
        assert!((track.velocity - truth.velocity).norm() < 0.15, "{beams} beams: {track:?}");
        assert_eq!(scene.tracker.tracks().len(), 1);
        scene.tracker.forget();
        assert!(scene.tracker.tracks().is_empty());
    }
}

#[test]
fn a_pillar_stands() {
    let mut scene = Scene::new(72);
    scene.discs.push(person(2.0, 0.3, 0.0, 0.0));
    scene.turn_radps = 0.7;
    scene.steps(40);
    let track = scene.nearest(0);
    assert!(!track.is_moving() && track.velocity == Vector::zeros(), "{track:?}");
}
