//! The safety gate from outside: what it says of what it does, and what it forgets.

use nav_core::geometry::{Point, Pose, Vector};
use nav_core::messages::{Header, LaserScan};
use nav_core::sent::Sent;
use nav_core::shield::{Hazard, Intervention, Mover, Open, Shield};
use nav_core::task::Task;
use nav_core::twist::Twist;
use std::f32::consts::PI;

const AHEAD: Twist = Twist::new(1.0, 0.0);
const OPEN: Open = Open { ahead: true, behind: true };

/// What becomes of full speed ahead of a robot that stands.
fn asked(shield: &Shield) -> (Twist, Option<Intervention>) {
    shield.filter(AHEAD, Twist::ZERO, &Sent::default(), OPEN)
}

fn scan(task: &Task, seq: u64, range_m: impl Fn(f32) -> f32) -> LaserScan {
    LaserScan { header: Header { stamp_ns: seq * 100_000_000, seq }, ..LaserScan::of(&task.lidar, range_m) }
}

#[test]
fn an_intervention_says_what_from_where_and_when() {
    let degrees = |degrees: f32| degrees * PI / 180.0;
    for (bearing_deg, side) in [
        (0.0, "ahead"),
        (22.0, "ahead"),
        (-22.0, "ahead"),
        (23.0, "from the left"),
        (90.0, "from the left"),
        (112.0, "from the left"),
        (-23.0, "from the right"),
        (-90.0, "from the right"),
        (-112.0, "from the right"),
        (113.0, "from behind"),
        (-113.0, "from behind"),
        (180.0, "from behind"),
        (-180.0, "from behind"),
    ] {
        for (hazard, what) in [(Hazard::Person, "person"), (Hazard::Standing, "obstacle")] {
            for (is_forced, end) in [(false, ""), (true, ", no safe way")] {
                let intervention =
                    Intervention { hazard, bearing_rad: degrees(bearing_deg), in_s: 0.84, is_forced };
                assert_eq!(intervention.to_string(), format!("shield: {what} {side}, 0.8 s{end}"));
            }
        }
    }
}

/// A wall on one side, and somebody who comes from one side: what is said is where it is.
#[test]
fn it_names_the_side_that_the_danger_is_on() {
    let task = Task::default();
    let mut shield = Shield::new(&task);
    shield.see(&scan(&task, 1, |angle| if angle.abs() < 0.6 { 0.25 } else { 4.0 }), Pose::default());
    let (command, intervention) = asked(&shield);
    assert!(command.linear_mps < 1.0);
    let said = intervention.expect("it acts").to_string();
    assert!(said.starts_with("shield: obstacle ahead"), "{said}");
    for (y_m, side) in [(1.6, "from the left"), (-1.6, "from the right")] {
        let mut shield = Shield::new(&task);
        let mover = Mover {
            position: Point::new(0.9, y_m),
            velocity: Vector::new(0.0, -y_m.signum()),
            radius_m: 0.25,
        };
        shield.inform([mover].into_iter());
        shield.see(&scan(&task, 1, |_| f32::INFINITY), Pose::default());
        let (command, intervention) = asked(&shield);
        assert!(command != AHEAD);
        let said = intervention.expect("it acts").to_string();
        assert!(said.contains("person") && (said.contains(side) || said.contains("ahead")), "{side}: {said}");
    }
}

#[test]
fn what_is_forgotten_stops_nobody() {
    let task = Task::default();
    let mut shield = Shield::new(&task);
    let mover = Mover { position: Point::new(1.0, 0.0), velocity: Vector::new(-1.0, 0.0), radius_m: 0.25 };
    shield.inform([mover].into_iter());
    // A wall close by, and somebody who walks, as the tracker sees it.
    for seq in 1..=12 {
        let walked_m = 2.5 - 0.1 * seq as f32;
        let range_m = |angle: f32| {
            let person = angle.abs() < (0.25_f32 / walked_m).asin();
            if (angle - 2.0).abs() < 0.5 {
                0.3
            } else if person {
                walked_m - 0.25
            } else {
                5.0
            }
        };
        shield.see(&scan(&task, seq, range_m), Pose::default());
    }
    assert!(asked(&shield).0 != AHEAD, "somebody comes");
    assert!(!shield.tracker().tracks().is_empty());
    shield.forget();
    assert!(shield.tracker().tracks().is_empty());
    assert_eq!(asked(&shield), (AHEAD, None), "neither walls nor people are known");
}

/// The end of a wall, hit by one beam and then by none: no beam of a coarse lidar need hit it again. What is wide would be.
#[test]
fn thin_things_that_no_beam_hits_any_more_are_not_gone_at_once() {
    let task = Task::default();
    let after = |width_rad: f32, unseen: u64| {
        let mut shield = Shield::new(&task);
        for seq in 1..=10 + unseen {
            let is_hit = |angle: f32| seq <= 10 && angle.abs() < 0.5 * width_rad;
            shield.see(&scan(&task, seq, |angle| if is_hit(angle) { 0.27 } else { 4.0 }), Pose::default());
        }
        asked(&shield).0
    };
    for (width_rad, what) in [(0.1, "one or two beams"), (1.2, "thirteen beams")] {
        assert!(after(width_rad, 0) != AHEAD, "{what} hit it");
        assert_eq!(after(width_rad, 100), AHEAD, "{what} hit it ten seconds ago");
    }
    assert!(after(0.1, 20) != AHEAD, "two seconds ago one or two beams hit it");
    assert_eq!(after(1.2, 20), AHEAD, "something wide is gone after two seconds");
}
