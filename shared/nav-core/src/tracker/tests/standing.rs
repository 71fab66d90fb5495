//! What stands makes no mover, however the robot moves.

use super::scene::{Disc, Scene, person};
use crate::geometry::Vector;

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
