//! What each metric is on courses that can be worked out by hand.

use super::*;
use crate::twist::Twist;

/// Towards a goal 5 m ahead of the start.
const GOAL: Point = Point::new(5.0, 0.0);

fn drive(steps: u32, linear_mps: f32, angular_radps: f32) -> EpisodeRecorder {
    let mut recorder = EpisodeRecorder::new(Pose::default(), GOAL, &Task::default());
    let mut pose = Pose::default();
    for _ in 0..steps {
        pose = pose.advanced(Twist::new(linear_mps, angular_radps), 0.1);
        recorder.step(&StepTruth { pose, linear_mps, clearance_m: 1.0, time_to_collision_s: 4.0 });
    }
    recorder
}

#[test]
fn a_straight_drive_is_perfect() {
    let metrics = drive(50, 1.0, 0.0).finish(EpisodeEnd::Success, false, Some(5.0));
    assert!((metrics.spl.expect("a way is known") - 1.0).abs() < 1e-4 && (metrics.path_m - 5.0).abs() < 1e-3);
    assert!((metrics.smoothness - 1.0).abs() < 1e-6 && metrics.spin == 0.0);
    assert!((metrics.time_s - 5.0).abs() < 1e-4);
}

#[test]
fn what_is_left_is_measured_from_where_it_ended() {
    let metrics = drive(20, 1.0, 0.0).finish(EpisodeEnd::Timeout, false, None);
    assert!((metrics.euclidean_m - 5.0).abs() < 1e-6 && (metrics.distance_left_m - 3.0).abs() < 1e-4);
    let beyond = drive(60, 1.0, 0.0).finish(EpisodeEnd::Timeout, false, None).distance_left_m;
    assert!((beyond - 1.0).abs() < 1e-4, "a distance, whichever side of the goal: {beyond}");
}

#[test]
fn standing_counts_from_where_it_last_drove() {
    let mut recorder = drive(50, 1.0, 0.0);
    let pose = Pose::new(5.0, 0.0, 0.0);
    for _ in 0..30 {
        recorder.step(&StepTruth { pose, linear_mps: 0.0, clearance_m: 1.0, time_to_collision_s: 4.0 });
    }
    let stood_s = recorder.finish(EpisodeEnd::Timeout, false, None).stood_at_end_s;
    assert!((3.0..3.3).contains(&stood_s), "{stood_s}");
}

#[test]
fn without_a_shortest_way_only_the_straight_line_is_a_reference() {
    let metrics = drive(63, 1.0, 0.0).finish(EpisodeEnd::Success, false, None);
    assert!(metrics.spl.is_none() && metrics.path_efficiency.is_none());
    let straight = metrics.path_efficiency_euclidean.expect("a success");
    assert!((straight - 5.0 / 6.3).abs() < 1e-3, "{straight}");
}

#[test]
fn a_robot_that_turns_fast_may_turn_farther_before_it_spins() {
    let spin = |angular_max_radps, turn_radps| {
        let mut task = Task::default();
        task.robot.angular_max_radps = angular_max_radps;
        let mut recorder = EpisodeRecorder::new(Pose::default(), GOAL, &task);
        let mut pose = Pose::default();
        for _ in 0..100 {
            pose = pose.advanced(Twist::new(0.0, turn_radps), 0.1);
            recorder.step(&StepTruth { pose, clearance_m: 1.0, ..StepTruth::default() });
        }
        recorder.finish(EpisodeEnd::Timeout, false, None).spin
    };
    assert!(spin(1.0, 0.5) > 0.75 && spin(4.0, 2.0) > 0.75);
    assert!(spin(1.0, 0.3) == 0.0 && spin(4.0, 1.5) == 0.0);
    assert!(spin(4.0, 0.5) == 0.0, "what is half of one robot's best is an eighth of another's");
}

#[test]
fn turning_on_the_spot_is_spin_and_failure_has_no_spl() {
    let metrics = drive(100, 0.0, 1.0).finish(EpisodeEnd::Timeout, false, Some(5.0));
    assert!(metrics.spin > 0.75, "{}", metrics.spin);
    assert!(metrics.spl == Some(0.0) && metrics.path_efficiency.is_none());
    assert!(drive(100, 0.5, 1.0).finish(EpisodeEnd::Timeout, false, Some(5.0)).spin == 0.0);
}
