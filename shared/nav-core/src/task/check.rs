//! What a task must be to make sense. Lengths and times are measured by the robot's own ([`crate::scale`]).

use super::{CORRIDOR_LIMIT_M, SUBGOAL_MIN_M, Task};
use crate::messages::MAX_BEAMS;
use core::f32::consts::{PI, TAU};

/// Ticks that fit into a second of the reference robot at most: memory of the past has room for so many.
const TICKS_A_SECOND_MAX: f32 = 500.0;
const FOOTPRINT: &str = "robot.footprint must be a circle with a radius_m in [0.02, 5], or a rectangle with front_m and \
     rear_m in [0, 5], half_width_m in [0.02, 5], front_m + rear_m at least 0.04, and one side at most 8 times the other";

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
            (robot.footprint.is_sound(), FOOTPRINT),
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
                within(self.lidar.mount.position().coords.norm(), 0.0, robot.footprint.circumradius_m()),
                "lidar.mount must lie within the circle that the robot turns in: x_m and y_m",
            ),
            (within(self.lidar.mount.yaw_rad, -PI, PI), "lidar.mount.yaw_rad must lie in [-pi, pi]"),
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
    use crate::footprint::Footprint;
    use crate::geometry::Pose;
    use crate::task::{Lidar, Robot};

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
            let footprint = Footprint::circle(radius_m);
            let robot = Robot { footprint, linear_max_mps, linear_acceleration_mps2, ..Robot::default() };
            for control_period_s in [0.2, 0.1, 0.05, 0.02] {
                let task = Task { control_period_s, ..Task::of(robot) };
                assert_eq!(task.validate(), Ok(()), "{task:?}");
            }
        }
    }

    #[test]
    fn a_lidar_sits_on_its_robot_and_a_footprint_is_a_robots() {
        let footprint = Footprint::Rectangle { front_m: 0.4, rear_m: 0.4, half_width_m: 0.3 };
        let of = Task::of(Robot { footprint, ..Robot::default() });
        let problem = |x_m: f32, yaw_rad: f32| {
            let mount = Pose::new(x_m, 0.2, yaw_rad);
            Task { lidar: Lidar { mount, ..of.lidar }, ..of }.validate()
        };
        assert_eq!([problem(0.4, 0.5), problem(-0.4, PI)], [Ok(()); 2]);
        assert!(problem(0.6, 0.0).is_err_and(|sentence| sentence.contains("lidar.mount must lie")));
        assert!(problem(f32::NAN, 0.0).is_err_and(|sentence| sentence.contains("lidar.mount must lie")));
        assert!(problem(0.0, 4.0).is_err_and(|sentence| sentence.contains("lidar.mount.yaw_rad")));
        let flat = Footprint::Rectangle { front_m: 0.4, rear_m: 0.4, half_width_m: 0.03 };
        let task = Task::of(Robot { footprint: flat, ..Robot::default() });
        assert!(task.validate().is_err_and(|sentence| sentence.contains("robot.footprint must be")));
    }

    #[test]
    fn limits_are_the_robots_own() {
        let robot = |radius_m| Robot { footprint: Footprint::circle(radius_m), ..Robot::default() };
        let small = Task::of(robot(0.15));
        let mut task = small;
        task.decision.subgoal_distance_m = 3.0;
        assert!(
            task.validate().is_err_and(|sentence| sentence.contains("20 at most")),
            "20 radii of a small robot"
        );
        let fast = Task { control_period_s: 0.002, ..small };
        assert!(fast.validate().is_ok());
        let slow = Task { control_period_s: 0.002, ..Task::of(robot(0.8)) };
        assert!(slow.validate().is_err_and(|sentence| sentence.contains("500th")));
    }
}
