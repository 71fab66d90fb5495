//! The last seconds of a collision as pictures.

mod common;

use nav_core::geometry::{Point, Pose, Vector};
use nav_core::metrics::EpisodeEnd;
use nav_core::shield::{Hazard, Intervention};
use nav_core::task::Task;
use nav_core::twist::Twist;
use nav_sim::drawing::{EpisodeTrace, Seen, TraceStep, svg_strips, write_picture};
use nav_sim::people::PersonState;
use nav_sim::world::{Bounds, World};
use std::sync::Arc;

/// Somebody who walks up at 1 m/s and is believed to be a little beside, and a robot that wishes to drive on and does not.
fn collision() -> EpisodeTrace {
    let bounds = Bounds { min: Point::origin(), max: Point::new(14.0, 14.0) };
    let world = World { start: Pose::new(4.0, 2.0, 0.0), bounds, ..common::room(14.0) };
    let mut trace = EpisodeTrace::begin(&Arc::new(world), &Task::default());
    let walker = |x: f32, y: f32| PersonState {
        position: Point::new(x, y),
        velocity: Vector::new(-1.0, 0.0),
        radius_m: 0.3,
    };
    for index in 0..30_u8 {
        let x = 10.0 - 0.1 * f32::from(index);
        let seen = Seen {
            hits: vec![Point::new(x - 0.3, 2.0)],
            tracks: vec![walker(x, 3.0)],
            wish: Twist::new(1.0, 0.0),
            command: Twist::new(0.0, 1.0),
            intervention: Some(Intervention {
                hazard: Hazard::Person,
                bearing_rad: 0.0,
                in_s: 0.5,
                is_forced: true,
            }),
        };
        trace.steps.push(TraceStep {
            pose: Pose::new(4.0 + 0.1 * f32::from(index), 2.0, 0.0),
            people: vec![walker(x, 2.0)],
            seen: (index < 29).then_some(seen),
        });
    }
    EpisodeTrace { end: Some(EpisodeEnd::Collision), hit_while_standing: true, ..trace }
}

#[test]
fn a_strip_shows_moments_before_the_end_with_what_was_seen_and_done() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("strip.png");
    let text = svg_strips(&[collision(), collision()]);
    assert_eq!(text.matches("<title>").count(), 2);
    assert_eq!(text.matches("<clipPath").count(), 12, "six moments each, each with a name of its own");
    write_picture(&path, &text).expect("the strip can be written");
    let picture = image::open(&path).expect("a PNG").into_rgb8();
    // 2.9 s before the end, as far as the episode goes back: the way from x = 4 to 6.9 m is in the middle.
    let window = |column: u8, x: f32, y: f32| {
        let scale = 250.0 / 6.0;
        let (left, top) = (10.0 + 260.0 * f32::from(column), 30.0);
        let (x, y) = (left + (x - 2.45) * scale, top + (5.0 - y) * scale);
        picture.get_pixel((2.0 * x) as u32, (2.0 * y) as u32).0
    };
    let [red, _, blue] = window(4, 7.3 + 0.1, 2.0 + 0.15);
    assert!(red > blue + 30, "the person, 0.3 s before the end: {red} {blue}");
    let [red, green, _] = window(4, 6.8, 3.0);
    assert!(green > red + 40, "where the gate believes somebody to walk to: {red} {green}");
    let [red, _, blue] = window(5, 6.9 - 0.1, 2.0 + 0.1);
    assert!(red > blue + 40, "crashed: {red} {blue}");
    let [red, _, blue] = window(4, 6.6 - 0.1, 2.0 + 0.1);
    assert!(blue > red + 40, "and before: {red} {blue}");
}
