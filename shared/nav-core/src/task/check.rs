//! What a task must be to make sense. Lengths and times are measured by the robot's own ([`crate::scale`]).

use super::{CORRIDOR_LIMIT_M, SUBGOAL_MIN_M, Task};
use crate::messages::MAX_BEAMS;
use core::f32::consts::TAU;

/// Ticks that fit into a second of the reference robot at most: memory of the past has room for so many.
const TICKS_A_SECOND_MAX: f32 = 500.0;

impl Task {
    /// The first thing about this task that makes no sense, as a sentence.
    ///
    /// # Errors
    /// A field outside its range, named with its unit.
    pub fn validate(&self) -> Result<(), &'static str> {
        let within = |value: f32, low: f32, high: f32| value >= low && value <= high;
        let (robot, decision, scale) = (&self.robot, &self.decision, self.scale());
        let within_m = |value: f32, low: f32, high: f32| within(value, scale.m(low), scale.m(high));
        let checks = [
            (within(self.control_period_s, 0.001, 1.0), "control_period_s must lie in [0.001, 1]"),
            (within(robot.radius_m, 0.02, 5.0), "robot.radius_m must lie in [0.02, 5]"),
            (within(robot.linear_max_mps, 0.01, 5.0), "robot.linear_max_mps must lie in [0.01, 5]"),
            (
                within(robot.linear_min_mps, -robot.linear_max_mps, 0.0),
                "robot.linear_min_mps must lie in [-robot.linear_max_mps, 0]",
            ),
            (within(robot.angular_max_radps, 0.01, 10.0), "robot.angular_max_radps must lie in [0.01, 10]"),
            (
                within(robot.linear_acceleration_mps2, 0.01, 50.0),
                "robot.linear_acceleration_mps2 must lie in [0.01, 50]",
            ),
            (
                within(robot.angular_acceleration_radps2, 0.01, 100.0),
                "robot.angular_acceleration_radps2 must lie in [0.01, 100]",
            ),
            (within(robot.latency_s, 0.0, 2.0), "robot.latency_s must lie in [0, 2]"),
            (
                scale.time <= TICKS_A_SECOND_MAX * self.control_period_s,
                "control_period_s must be at least a 500th of the time in which the robot drives five radii",
            ),
            (
                within(self.episode_s, self.control_period_s, 86_400.0),
                "episode_s must lie in [control_period_s, 86400]",
            ),
            (within_m(self.goal_radius_m, 0.05, 2.0), "goal_radius_m must lie in [0.25, 10] robot radii"),
            (
                (1..=MAX_BEAMS).contains(&(self.lidar.beam_count as usize)),
                "lidar.beam_count must lie in [1, 1440]",
            ),
            (
                within(self.lidar.field_of_view_rad, 0.1, TAU + 1e-3),
                "lidar.field_of_view_rad must lie in [0.1, 2 pi]",
            ),
            (
                within(self.lidar.range_min_m, 0.0, scale.m(1.0)),
                "lidar.range_min_m must lie in [0, 5] robot radii",
            ),
            (
                within(self.lidar.range_max_m, scale.m(1.0), 100.0),
                "lidar.range_max_m must be at least 5 robot radii, and 100 at most",
            ),
            (
                within(decision.hold_s, self.control_period_s, scale.s(20.0)),
                "decision.hold_s must be at least a control period, and at most the time in which the robot drives 100 radii",
            ),
            (
                within_m(decision.subgoal_distance_m, 0.5, 10.0),
                "decision.subgoal_distance_m must lie in [2.5, 50] robot radii",
            ),
            (
                within_m(decision.subgoal_reached_m, 0.05, 2.0),
                "decision.subgoal_reached_m must lie in [0.25, 10] robot radii",
            ),
            (
                within_m(decision.corridor_margin_m, 0.0, 2.0),
                "decision.corridor_margin_m must lie in [0, 10] robot radii",
            ),
            (
                within(decision.time_to_collision_s, 0.0, scale.s(10.0)),
                "decision.time_to_collision_s must lie between 0 and the time in which the robot drives 50 radii",
            ),
            (within(decision.horizon_s, 1.0, 86_400.0), "decision.horizon_s must lie in [1, 86400]"),
            (decision.deviation_margin.is_finite(), "decision.deviation_margin must be finite"),
            (
                decision.subgoal_distance_m > scale.m(SUBGOAL_MIN_M)
                    && decision.subgoal_distance_m + decision.corridor_margin_m <= scale.m(CORRIDOR_LIMIT_M),
                "decision.subgoal_distance_m must exceed 3 robot radii, and with decision.corridor_margin_m be 20 at most",
            ),
            (
                decision.subgoal_reached_m < scale.m(SUBGOAL_MIN_M),
                "decision.subgoal_reached_m must be below 3 robot radii, the shortest subgoal",
            ),
        ];
        match checks.into_iter().find(|(fine, _)| !fine) {
            Some((_, sentence)) => Err(sentence),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::task::Robot;

    #[test]
    fn robots_of_all_sizes_and_speeds_have_defaults_that_make_sense_at_5_to_50_hz() {
        for (radius_m, linear_max_mps, linear_acceleration_mps2) in [
            (0.105, 0.22, 2.5),
            (0.2, 1.0, 0.3),
            (0.27, 2.0, 20.0),
            (0.6, 1.0, 1.0),
            (0.72, 0.5, 0.3),
            (0.05, 0.5, 2.0),
        ] {
            let robot = Robot { radius_m, linear_max_mps, linear_acceleration_mps2, ..Robot::default() };
            for control_period_s in [0.2, 0.1, 0.05, 0.02] {
                let task = Task { control_period_s, ..Task::of(robot) };
                assert_eq!(task.validate(), Ok(()), "{task:?}");
            }
        }
    }

    #[test]
    fn limits_are_the_robots_own() {
        let small = Task::of(Robot { radius_m: 0.1, ..Robot::default() });
        let mut task = small;
        task.decision.subgoal_distance_m = 2.0;
        assert!(
            task.validate().is_err_and(|sentence| sentence.contains("20 at most")),
            "20 radii of a small robot"
        );
        let fast = Task { control_period_s: 0.001, ..small };
        assert!(fast.validate().is_ok());
        let slow = Task { control_period_s: 0.001, ..Task::of(Robot { radius_m: 0.8, ..Robot::default() }) };
        assert!(slow.validate().is_err_and(|sentence| sentence.contains("500th")));
    }
}
