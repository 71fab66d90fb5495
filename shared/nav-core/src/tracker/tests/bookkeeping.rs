//! Time, forgetting, whose beams are whose, and room for those who count.

use super::scene::{Disc, Scene, person};
use super::*;

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
