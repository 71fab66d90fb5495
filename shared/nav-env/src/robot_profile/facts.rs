//! What follows from a robot, in its own lengths and times: what a run for it will be about.

use nav_core::task::CORRIDOR_LIMIT_M;
use nav_sim::families::{Family, Split, generate};

use super::RobotProfile;
use super::odd::stopping_m;

/// Narrowest door of the family `rooms`, m of the reference robot.
const DOOR_M: f32 = 1.0;

impl RobotProfile {
    /// It in a line: its size, speed and lidar.
    pub fn line(&self) -> String {
        format!(
            "{}, {} m/s, {} rad/s; {} beams, {:.0} degrees, {} m; {} Hz",
            self.robot.footprint,
            self.robot.linear_max_mps,
            self.robot.angular_max_radps,
            self.lidar.beam_count,
            self.lidar.field_of_view_rad.to_degrees(),
            self.lidar.range_max_m,
            1.0 / self.control_period_s
        )
    }

    /// What follows: what it is, and how much, with its unit.
    pub fn facts(&self) -> Vec<(&'static str, String)> {
        let task = self.task();
        let (robot, scale, decision) = (&task.robot, task.scale(), &task.decision);
        let world = |family: Family| {
            let bounds = generate(family, Split::Validation, 0).bounds;
            let size = (bounds.max - bounds.min) * family.world_length(&robot.footprint);
            format!("{family} {:.1} x {:.1} m", size.x, size.y)
        };
        let worlds = [Family::Clutter, Family::UTrap, Family::Rooms, Family::Maze, Family::Crowd].map(world);
        let maze_s = Family::Maze.episode_s(robot);
        vec![
            (
                "size",
                format!(
                    "{:.2} of the reference robot's lengths (radius 0.2 m), {:.2} of its times",
                    scale.length, scale.time
                ),
            ),
            (
                "drives its own size in",
                format!("{:.2} s", 2.0 * robot.footprint.circumradius_m() / robot.linear_max_mps),
            ),
            ("braking distance", format!("{:.2} m", robot.braking_m())),
            (
                "stops within",
                format!(
                    "{:.2} m of seeing something: a tick, {} s of latency, braking",
                    stopping_m(&task),
                    robot.latency_s
                ),
            ),
            (
                "a tick is",
                format!("{} s, {:.2} of a step of learning", task.control_period_s, task.step_share()),
            ),
            (
                "subgoals",
                format!(
                    "{:.2} m away, reached at {:.2} m, held for {:.1} s; corridors seen up to {:.1} m",
                    decision.subgoal_distance_m,
                    decision.subgoal_reached_m,
                    decision.hold_s,
                    scale.m(CORRIDOR_LIMIT_M)
                ),
            ),
            ("goal reached at", format!("{:.2} m", task.goal_radius_m)),
            (
                "an episode lasts",
                format!(
                    "{:.0} s ({} ticks), in mazes {maze_s:.0} s ({} ticks)",
                    task.episode_s,
                    task.episode_steps(),
                    task.ticks(maze_s)
                ),
            ),
            ("doors", format!("{:.2} m and wider", scale.m(DOOR_M))),
            ("worlds", worlds.join(", ")),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn facts_are_in_the_robots_own_size_and_time() {
        let text = |name: &str| {
            let facts = RobotProfile::read(name).expect("built in").facts();
            facts.into_iter().map(|(what, said)| format!("{what} {said}\n")).collect::<String>()
        };
        let agv = text("agv");
        // Two thirds of 0.721 m: 2.404 times as large, half as fast, 4.81 times as long for everything.
        for part in [
            "2.40 of",
            "4.81 of",
            "an episode lasts 240 s (1202 ticks)",
            "clutter 33.7 x 33.7 m",
            "doors 2.40 m",
        ] {
            assert!(agv.contains(part), "{part}: {agv}");
        }
        // People are as large as they are.
        assert!(text("turtlebot3_burger").contains("crowd 14.0 x 14.0 m"), "{}", text("turtlebot3_burger"));
    }
}
