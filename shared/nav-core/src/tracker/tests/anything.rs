//! Any scan, any pose, any walker.

extern crate std;

use super::scene::{Scene, person};
use super::*;
use crate::geometry::Vector;
use crate::messages::LaserScan;
use proptest::prelude::*;
use std::vec::Vec;

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
