//! Who walks is followed: alone, hidden for a while, crossing, on two legs, among many.

extern crate std;

use super::scene::{Disc, Scene, person};
use super::*;
use crate::geometry::Vector;
use std::vec::Vec;

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
