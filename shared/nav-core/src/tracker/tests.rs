//! Scenes with a known truth.

extern crate std;

use super::*;
use crate::geometry::{Vector, wrap_angle};
use crate::messages::LaserScan;
use crate::task::Lidar;
use proptest::prelude::*;
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
    noise_m: f32,
    failed_share: f32,
    /// Error of the believed pose, m and rad.
    jitter: f32,
    seed: u64,
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
    fn step(&mut self, dt_s: f32) {
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

    fn steps(&mut self, count: usize) {
        for _ in 0..count {
            self.step(0.1);
        }
    }

    fn wall(&mut self, a: (f32, f32), b: (f32, f32)) {
        self.walls.push((Point::new(a.0, a.1), Point::new(b.0, b.1)));
    }

    fn nearest(&self, disc: usize) -> &Track {
        let at = self.discs[disc].at;
        let tracks = self.tracker.tracks().iter();
        tracks
            .min_by(|a, b| (a.position - at).norm().total_cmp(&(b.position - at).norm()))
            .expect("somebody is followed")
    }

    fn assert_followed(&self, disc: usize, what: &str) {
        let (track, truth) = (self.nearest(disc), self.discs[disc]);
        assert!(track.is_moving(), "{what}: {track:?}");
        assert!((track.position - truth.at).norm() < 0.15, "{what}: {} {track:?}", truth.at);
        assert!((track.velocity - truth.velocity).norm() < 0.2, "{what}: {track:?}");
    }
}

/// An even number in [-1, 1] for each argument.
fn hashed(a: u64, b: u64) -> f32 {
    let mut z = a.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ b.wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 30)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^= z >> 31;
    (z >> 40) as f32 / 8_388_608.0 - 1.0
}

#[test]
fn whoever_walks_is_followed_with_place_and_velocity() {
    for beams in [72, 180, 360, 720, 1440] {
        let mut scene = Scene::new(beams);
        scene.discs.push(person(2.0, -1.0, 0.0, 0.8));
        scene.steps(15);
        scene.assert_followed(0, &std::format!("{beams} beams"));
        assert_eq!(scene.tracker.tracks().len(), 1);
    }
}

#[test]
fn whoever_walks_close_along_a_wall_is_followed() {
    for beams in [180, 720] {
        let mut scene = Scene::new(beams);
        scene.wall((2.4, -5.0), (2.4, 5.0));
        scene.discs.push(person(2.0, -1.2, 0.0, 0.7));
        scene.steps(25);
        scene.assert_followed(0, &std::format!("{beams} beams"));
    }
}

/// Where the last beam neighbours the first.
#[test]
fn whoever_comes_from_behind_is_followed() {
    for beams in [180, 720] {
        let mut scene = Scene::new(beams);
        scene.discs.push(person(-3.2, 0.05, 0.8, 0.0));
        scene.steps(14);
        scene.assert_followed(0, &std::format!("{beams} beams"));
        assert_eq!(scene.tracker.tracks().len(), 1);
    }
}

#[test]
fn a_corner_is_nobody() {
    let mut scene = Scene::new(720);
    scene.wall((1.6, -0.35), (2.0, 0.0));
    scene.wall((2.0, 0.0), (1.6, 0.35));
    scene.steps(5);
    assert!(scene.tracker.tracks().is_empty(), "{:?}", scene.tracker.tracks());
}

#[test]
fn a_pillar_stands() {
    let mut scene = Scene::new(72);
    scene.discs.push(person(2.0, 0.3, 0.0, 0.0));
    scene.turn_radps = 0.7;
    scene.steps(40);
    let track = scene.nearest(0);
    assert!(!track.is_moving() && !track.has_moved() && track.velocity == Vector::zeros(), "{track:?}");
}

/// Walls with a door, a corner, a thin wall's end and a pillar, with noise, around a robot that turns and drives.
#[test]
fn what_stands_makes_no_mover_while_the_robot_turns_and_drives() {
    for beams in [72, 180, 720] {
        let mut scene = Scene::new(beams);
        scene.noise_m = 0.02;
        for (a, b) in [
            ((2.0, -4.0), (2.0, -0.5)),
            ((2.0, 0.6), (2.0, 4.0)),
            ((-3.0, -4.0), (-3.0, 4.0)),
            ((-3.0, 4.0), (4.0, 4.0)),
            ((-3.0, -4.0), (4.0, -4.0)),
            ((4.0, -4.0), (4.0, 4.0)),
            ((0.5, -1.5), (0.5, -3.0)),
        ] {
            scene.wall(a, b);
        }
        scene.discs.push(Disc { radius_m: 0.3, ..person(-1.5, 2.0, 0.0, 0.0) });
        scene.discs.push(Disc { radius_m: 0.15, ..person(3.0, 0.8, 0.0, 0.0) });
        for step in 0..300_u16 {
            scene.turn_radps = 0.8 * libm::sinf(f32::from(step) * 0.05);
            let (sin, cos) = libm::sincosf(f32::from(step) * 0.02);
            (scene.pose.x_m, scene.pose.y_m) = (1.2 * cos - 1.2, 1.2 * sin);
            scene.step(0.1);
            let mover = scene.tracker.tracks().iter().find(|track| track.is_moving());
            assert!(mover.is_none(), "{beams} beams, step {step}: {mover:?}");
        }
    }
}

/// Thin walls that the robot drives along and round, with a pose that is off by a centimetre and half a degree.
#[test]
fn a_wall_seen_along_its_length_makes_no_mover() {
    for beams in [180, 360, 720] {
        let mut scene = Scene::new(beams);
        (scene.noise_m, scene.jitter) = (0.02, 0.01);
        scene.wall((1.5, 0.0), (4.0, 0.0));
        scene.wall((-1.5, 0.3), (-4.0, 0.3));
        scene.wall((-4.5, -4.5), (4.5, -4.5));
        scene.wall((-4.5, 4.5), (4.5, 4.5));
        for step in 0..300_u16 {
            scene.pose.y_m = 0.8 * libm::sinf(f32::from(step) * 0.07);
            scene.turn_radps = 0.5 * libm::cosf(f32::from(step) * 0.05);
            scene.step(0.1);
            let mover = scene.tracker.tracks().iter().find(|track| track.is_moving());
            assert!(mover.is_none(), "{beams} beams, step {step}: {mover:?}");
        }
    }
}

#[test]
fn whoever_passes_behind_a_pillar_is_the_same_afterwards() {
    let mut scene = Scene::new(360);
    scene.discs.push(person(3.0, -1.5, 0.0, 1.0));
    scene.discs.push(Disc { radius_m: 0.35, ..person(1.5, 0.0, 0.0, 0.0) });
    scene.steps(8);
    let id = scene.nearest(0).id;
    let mut was_hidden = false;
    for _ in 0..22 {
        scene.step(0.1);
        was_hidden |= scene.nearest(0).unseen_s > 0.25;
    }
    assert!(was_hidden, "the pillar hides nobody");
    assert_eq!(scene.nearest(0).id, id);
    scene.assert_followed(0, "afterwards");
}

#[test]
fn two_who_cross_keep_their_ids() {
    for beams in [180, 720] {
        let mut scene = Scene::new(beams);
        scene.discs.push(person(2.0, -1.2, 0.0, 0.8));
        scene.discs.push(person(2.7, 1.2, 0.0, -0.8));
        scene.steps(8);
        let ids = [scene.nearest(0).id, scene.nearest(1).id];
        scene.steps(16);
        assert_eq!([scene.nearest(0).id, scene.nearest(1).id], ids, "{beams} beams");
    }
}

/// A lidar at the height of shins: two thin discs that swing against each other.
#[test]
fn a_pair_of_legs_is_one_person() {
    for beams in [720, 1440] {
        let mut scene = Scene::new(beams);
        let leg = Disc { radius_m: 0.06, ..person(0.0, 0.0, 0.0, 0.0) };
        scene.discs = std::vec![leg, leg];
        for step in 0..40_u16 {
            let time_s = f32::from(step) * 0.1;
            let middle = Point::new(2.0, -1.6 + 0.8 * time_s);
            let swing_m = 0.2 * libm::sinf(2.0 * core::f32::consts::PI * 0.9 * time_s);
            scene.discs[0].at = middle + Vector::new(0.1, swing_m);
            scene.discs[1].at = middle + Vector::new(-0.1, -swing_m);
            scene.step(0.1);
            if step > 12 {
                let tracks = scene.tracker.tracks();
                let movers: Vec<&Track> = tracks.iter().filter(|track| track.is_moving()).collect();
                assert_eq!((tracks.len(), movers.len()), (1, 1), "{beams} beams, step {step}: {tracks:?}");
                let off_m = (movers[0].position - middle).norm();
                assert!(off_m < 0.25, "{beams} beams, step {step}: {off_m} m off");
                let off_mps = (movers[0].velocity - Vector::new(0.0, 0.8)).norm();
                assert!(off_mps < 0.6, "{beams} beams, step {step}: {:?}", movers[0].velocity);
            }
        }
    }
}

#[test]
fn a_mirrored_scene_makes_mirrored_tracks() {
    let run = |side: f32| {
        let mut scene = Scene::new(180);
        scene.wall((3.0, -4.0), (3.0, 4.0));
        scene.wall((-1.0, side * 2.0), (1.0, side * 2.5));
        scene.discs.push(person(2.0, -side, 0.1, side * 0.7));
        scene.discs.push(person(-1.5, side * 1.0, 0.3, -0.5 * side));
        scene.turn_radps = side * 0.4;
        scene.steps(20);
        [scene.nearest(0).clone(), scene.nearest(1).clone()]
    };
    for (left, right) in run(1.0).iter().zip(&run(-1.0)) {
        let apart = Vector::new(left.position.x - right.position.x, left.position.y + right.position.y);
        let faster = Vector::new(left.velocity.x - right.velocity.x, left.velocity.y + right.velocity.y);
        assert!(apart.norm() < 0.02 && faster.norm() < 0.1, "{left:?} {right:?}");
        assert_eq!(left.is_moving(), right.is_moving());
    }
}

#[test]
fn time_comes_from_stamps_and_scans_may_be_missed() {
    let mut scene = Scene::new(180);
    scene.discs.push(person(2.0, -1.5, 0.0, 0.8));
    for step in 0..14 {
        scene.step([0.1, 0.2, 0.05, 0.3][step % 4]);
    }
    scene.assert_followed(0, "uneven steps");
    let (id, stamp_ns) = (scene.nearest(0).id, scene.stamp_ns);
    // The same scan again: nobody ages.
    let age_s = scene.nearest(0).age_s;
    scene.tracker.update(&scene.beams, scene.pose, stamp_ns);
    assert_eq!((scene.nearest(0).id, scene.nearest(0).age_s.to_bits()), (id, age_s.to_bits()));
    // A clock that has begun anew, and a pause: nobody is known any more.
    scene.tracker.update(&scene.beams, scene.pose, stamp_ns - 1);
    assert!(scene.tracker.tracks().is_empty(), "a stamp of the past");
    scene.steps(3);
    assert!(!scene.tracker.tracks().is_empty());
    scene.step(3.0);
    assert!(scene.tracker.tracks().is_empty(), "a long pause");
}

#[test]
fn a_robot_that_was_set_down_elsewhere_knows_nobody() {
    let mut scene = Scene::new(180);
    scene.discs.push(person(2.0, -1.0, 0.0, 0.8));
    scene.steps(10);
    assert!((0..180).any(|beam| scene.tracker.owner(beam).is_some()));
    let mut carried = scene.tracker.clone();
    carried.update(&scene.beams, Pose::new(30.0, 0.0, 0.0), scene.stamp_ns + 100_000_000);
    assert!(carried.tracks().is_empty());
    scene.tracker.forget();
    assert!(scene.tracker.tracks().is_empty() && (0..180).all(|beam| scene.tracker.owner(beam).is_none()));
}

#[test]
fn beams_belong_to_whom_they_hit() {
    for turned_rad in [0.0, 3.1] {
        let mut scene = Scene::new(360);
        scene.pose.yaw_rad = turned_rad;
        scene.wall((3.5, -4.0), (3.5, 4.0));
        scene.discs.push(person(2.0, -1.0, 0.0, 0.6));
        scene.steps(20);
        for (index, beam) in scene.beams.as_slice().iter().enumerate() {
            let hit = scene.pose.parent_from_local(point_of(beam));
            let is_person = beam.is_hit() && (hit - scene.discs[0].at).norm() < 0.3;
            let owner = scene.tracker.owner(index).map(|owner| scene.tracker.tracks()[owner].id);
            assert_eq!(owner.is_some(), is_person, "beam {index}: {hit}");
            assert!(owner.is_none_or(|id| id == scene.nearest(0).id));
        }
    }
}

#[test]
fn who_walks_finds_room_among_many_that_stand() {
    let mut scene = Scene::new(1440);
    scene.lidar.range_max_m = 8.0;
    for index in 0..40_u16 {
        let (sin, cos) = libm::sincosf(f32::from(index) * 0.15);
        let far_m = 5.0 + 0.5 * f32::from(index % 3);
        scene.discs.push(Disc { radius_m: 0.2, ..person(far_m * cos, far_m * sin, 0.0, 0.0) });
    }
    scene.steps(5);
    assert_eq!(scene.tracker.tracks().len(), TRACKS_MAX);
    scene.discs.push(person(2.0, -1.0, 0.0, 0.8));
    scene.steps(15);
    scene.assert_followed(40, "a full house");
    assert_eq!(scene.tracker.tracks().len(), TRACKS_MAX);
}

/// Any scan of any layout.
fn any_scan() -> impl Strategy<Value = LaserScan> {
    let any_float = prop_oneof![
        Just(0.0_f32),
        Just(f32::NAN),
        Just(f32::INFINITY),
        Just(f32::NEG_INFINITY),
        Just(f32::MIN_POSITIVE),
        Just(f32::MAX),
        -10.0_f32..10.0,
    ];
    let increment = prop_oneof![-0.2_f32..0.2, any_float.clone()];
    let range = prop_oneof![4 => 0.0_f32..9.0, 1 => any_float.clone()];
    let ranges = proptest::collection::vec(range, 0..200);
    (any_float.clone(), increment, any_float.clone(), any_float, 0_u32..3000, ranges, 0_u8..4).prop_map(
        |(angle_min_rad, angle_increment_rad, range_min_m, range_max_m, beam_count, ranges, stretch)| {
            let mut scan = LaserScan {
                angle_min_rad,
                angle_increment_rad,
                range_min_m,
                range_max_m,
                beam_count,
                ..LaserScan::default()
            };
            if stretch > 0 {
                (scan.range_min_m, scan.range_max_m) = (0.05, 10.0);
            }
            for (beam, range_m) in scan.ranges_m.iter_mut().enumerate() {
                *range_m = ranges.get((beam >> stretch) % ranges.len().max(1)).copied().unwrap_or(f32::NAN);
            }
            scan
        },
    )
}

fn any_pose() -> impl Strategy<Value = Pose> {
    let place =
        prop_oneof![8 => -5.0_f32..5.0, 1 => Just(f32::NAN), 1 => Just(f32::MAX), 1 => Just(-1e20_f32)];
    (place.clone(), place, -4.0_f32..4.0).prop_map(|(x_m, y_m, yaw_rad)| Pose { x_m, y_m, yaw_rad })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn no_scan_is_too_strange(scans in proptest::collection::vec((any_scan(), any_pose(), 0_u64..400_000_000), 1..12)) {
        let run = || {
            let (mut tracker, mut beams, mut stamp_ns) = (Tracker::new(&Task::default()), Beams::new(), 0_u64);
            let mut seen = Vec::new();
            for (scan, pose, later_ns) in &scans {
                stamp_ns += later_ns;
                beams.read(scan, f32::INFINITY);
                tracker.update(&beams, *pose, stamp_ns);
                for track in tracker.tracks() {
                    let numbers = [track.position.x, track.position.y, track.velocity.x, track.velocity.y,
                        track.radius_m, track.position_sd_m, track.velocity_sd_mps, track.age_s, track.unseen_s];
                    assert!(numbers.iter().all(|number| number.is_finite()), "{track:?}");
                    assert!(track.covariance().iter().all(|number| number.is_finite()), "{track:?}");
                    seen.push((track.id, numbers.map(f32::to_bits)));
                }
                let owners = (0..MAX_BEAMS + 1).filter_map(|beam| tracker.owner(beam));
                assert!(owners.max().is_none_or(|owner| owner < tracker.tracks().len()));
                assert!(tracker.tracks().len() <= TRACKS_MAX);
            }
            seen
        };
        prop_assert_eq!(run(), run());
    }

    /// Walkers at any place and speed, seen by any lidar, with noise and failed beams.
    #[test]
    fn walkers_in_the_open_are_followed(
        beams in 120_u32..1440,
        bearing_rad in -3.1_f32..3.1,
        course_rad in -3.1_f32..3.1,
        speed_mps in 0.4_f32..1.2,
        seed in 0_u64..1_000_000,
    ) {
        let mut scene = Scene::new(beams);
        (scene.noise_m, scene.failed_share, scene.seed) = (0.02, 0.1, seed);
        let (sin, cos) = libm::sincosf(course_rad);
        let velocity = Vector::new(cos, sin) * speed_mps;
        let (sin, cos) = libm::sincosf(bearing_rad);
        // Two metres away in the end.
        let start = Point::new(2.0 * cos, 2.0 * sin) - velocity * 2.0;
        prop_assume!(start.coords.norm() > 0.6 && start.coords.norm() < 4.5);
        scene.discs.push(person(start.x, start.y, velocity.x, velocity.y));
        for _ in 0..20 {
            scene.step(0.1);
            prop_assume!(scene.discs[0].at.coords.norm() > 0.5);
        }
        let (track, truth) = (scene.nearest(0), scene.discs[0]);
        prop_assert!(track.is_moving(), "{track:?}");
        prop_assert!((track.position - truth.at).norm() < 0.2, "{} {track:?}", truth.at);
        prop_assert!((track.velocity - truth.velocity).norm() < 0.4, "{track:?}");
    }
}
