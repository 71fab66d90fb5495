//! What the safety gate did, as the report tells it.

use nav_core::messages::{Goal, LaserScan, Odometry};
use nav_core::shield::{Hazard, Intervention};
use nav_core::task::ShieldMode;
use nav_core::tick::{Inputs, TickStatus};
use runtime::run::plan::{DrivePlan, Pace};
use runtime::run::report::Report;
use runtime::run::tally::{ShieldTally, Tally};

#[test]
fn what_the_gate_did_is_counted_by_cause_and_told() {
    let mut tally = Tally::new(100);
    let mut note = |hazard: Option<Hazard>, is_forced: bool| {
        let act = |hazard| Intervention { hazard, bearing_rad: 0.0, in_s: 0.5, is_forced };
        let status = TickStatus { intervention: hazard.map(act), ..TickStatus::default() };
        let (scan, odom, goal) = (LaserScan::default(), Odometry::default(), Goal::default());
        tally.note(&Inputs { scan: &scan, odom: &odom, goal: &goal }, &status, 0.1);
    };
    for (hazard, is_forced, ticks) in [
        (Some(Hazard::Person), false, 3),
        (Some(Hazard::Person), true, 2),
        (Some(Hazard::Standing), false, 4),
        (Some(Hazard::Standing), true, 2),
        (None, false, 7),
    ] {
        (0..ticks).for_each(|_| note(hazard, is_forced));
    }
    assert_eq!(tally.shield, ShieldTally { persons: 5, obstacles: 6, forced: 4 });
    let plan = DrivePlan {
        pace: Pace::Clock,
        duration: None,
        idle_exit: None,
        exit_with_peer: false,
        assert_no_alloc: false,
        period_ns: None,
    };
    let report = |mode| Report::new(&tally, &plan, "robot", mode, "here".to_owned());
    let (on, off) = (report(ShieldMode::On), report(ShieldMode::Off));
    let counted = (on.shield.person_ticks, on.shield.obstacle_ticks, on.shield.forced_ticks);
    assert_eq!(counted, (5, 6, 4));
    let told = "shield on: wish not safe in 5 ticks for people, 6 for obstacles; no safe way in 4";
    assert!(on.to_string().lines().any(|line| line == told), "{on}");
    assert!(off.to_string().lines().any(|line| line == "shield off"), "{off}");
}
