//! What a length, a time and a speed are to a robot.
//!
//! Every constant that shapes learning or deciding was chosen for one robot, the *reference robot*: a radius of 0.2 m,
//! 1 m/s. What is written for it in metres, seconds and metres a second means something else to a robot of another size
//! or speed, and this says what.
//!
//! **Why two factors are enough.** A base on a plane has quantities of two dimensions, length and time. Measured in
//! lengths of its own footprint and in the time that it takes to drive such a length, a robot is described by numbers
//! without a unit: acceleration * time² / length, turning rate * time, control period / time, lidar range / length, range
//! noise / length, latency / time. Two robots for which these are the same, in worlds that differ by the factor of their
//! lengths, obey the same equations: they drive the same trajectory, one of them larger and slower or faster. So a policy,
//! a reward or a rule that sees only such numbers need not know which of them it drives, and an optimum stays where it is.
//! Where the numbers differ (a heavy robot brakes late for its size), the robots do differ, and have to learn it.
//!
//! | dimension | for the reference robot | for another |
//! |---|---|---|
//! | length, m | x | x * `length`, [`Scale::m`] |
//! | time, s | x | x * `time`, [`Scale::s`] |
//! | speed, m/s | x | x * `length` / `time`, [`Scale::mps`] |
//! | acceleration, m/s² | x | x * `length` / `time`² |
//! | angle, rad | x | x |
//! | turning rate, rad/s | x | x / `time` |
//! | share, count of things | x | x |
//!
//! **The length of a robot** ([`size_m`](crate::footprint::Footprint::size_m)) is half of its width, as the radius is for a
//! disc, so that a door is the same multiple of the width for every robot. A long robot must turn, too: its length is at
//! least two thirds of the radius of the circle that it turns in, so that it can turn wherever a family keeps start and goal
//! clear and in all but the narrowest passages, which it has to enter straight. And no robot is less than 0.7 of the reference
//! robot: what a lidar errs by and what the safety gate keeps free do not shrink with it, and a gap must leave room for them.
//!
//! What is a person's (sizes, walking speeds, the room that people are given) or a sensor's (noise, drift) is what it is
//! whoever drives past, and is not scaled. Settings are in metres and seconds; what follows from the robot are their
//! defaults.
//!
//! **Ticks.** The robots may tick at 5 to 50 Hz. What lasts a while is said in seconds, and becomes whole ticks of the
//! task's control period by [`Task::ticks`](crate::task::Task::ticks). What is paid or discounted a step was chosen for
//! steps of 0.1 s of the reference robot: [`Scale::step_s`], of which a tick is the
//! [`step_share`](crate::task::Task::step_share).

use crate::footprint::Footprint;
use crate::task::Robot;

/// Radius of the footprint of the reference robot, m.
pub const REFERENCE_RADIUS_M: f32 = 0.2;
/// Fastest speed of the reference robot, m/s.
pub const REFERENCE_MPS: f32 = 1.0;
/// A robot that is smaller than this share of the reference robot drives as if it were not.
const LEAST_LENGTH: f32 = 0.7;
/// The step for which rewards, discounts and observations of the past were chosen, s of the reference robot.
pub const REFERENCE_STEP_S: f32 = 0.1;

/// How many times as large as the reference robot one is. Here, and nowhere else, it is said which of its measures is its
/// size.
pub fn length_of(footprint: &Footprint) -> f32 {
    (footprint.size_m() / REFERENCE_RADIUS_M).max(LEAST_LENGTH)
}

/// Factors between the reference robot and another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// Of lengths.
    pub length: f32,
    /// Of times: how much longer than the reference robot this one takes for a length of its own.
    pub time: f32,
}

impl Scale {
    /// The reference robot's own: everything is as it is written.
    pub const REFERENCE: Self = Self { length: 1.0, time: 1.0 };

    /// Of a robot.
    pub fn of(robot: &Robot) -> Self {
        let length = length_of(&robot.footprint);
        Self { length, time: length / (robot.linear_max_mps / REFERENCE_MPS) }
    }

    /// A length, m.
    pub fn m(&self, reference_m: f32) -> f32 {
        reference_m * self.length
    }

    /// A time, s.
    pub fn s(&self, reference_s: f32) -> f32 {
        reference_s * self.time
    }

    /// A speed, m/s.
    pub fn mps(&self, reference_mps: f32) -> f32 {
        reference_mps * (self.length / self.time)
    }

    /// A time, ns.
    pub fn ns(&self, reference_s: f32) -> u64 {
        libm::round(f64::from(self.s(reference_s)) * 1e9) as u64
    }

    /// The step for which rewards, discounts and observations of the past were chosen, s.
    pub fn step_s(&self) -> f32 {
        self.s(REFERENCE_STEP_S)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::task::Task;

    fn task(radius_m: f32, linear_max_mps: f32, control_period_s: f32) -> Task {
        let footprint = Footprint::circle(radius_m);
        let robot = Robot { footprint, linear_max_mps, ..Robot::default() };
        Task { control_period_s, ..Task::of(robot) }
    }

    #[test]
    fn the_reference_robot_is_the_default_one() {
        assert_eq!(Scale::of(&Robot::default()), Scale::REFERENCE);
        let task = Task::default();
        assert_eq!((task.step_share().to_bits(), task.ticks(0.3)), (1.0_f32.to_bits(), 3));
        assert_eq!(task.decision.corridor_margin_m.to_bits(), 0.35_f32.to_bits());
    }

    #[test]
    fn a_robot_is_as_large_as_it_is_wide_or_turns_and_never_tiny() {
        let rectangle =
            |front_m, rear_m, half_width_m| Footprint::Rectangle { front_m, rear_m, half_width_m };
        for (footprint, length) in [
            (Footprint::circle(0.3), 1.5),
            (Footprint::circle(0.05), 0.7),
            // Wide, and long: half of the width, two thirds of the 0.5 m that it turns in.
            (rectangle(0.1, 0.1, 0.4), 2.0),
            (rectangle(0.4, 0.2, 0.3), 0.5 / 1.5 / 0.2),
        ] {
            assert!((length_of(&footprint) - length).abs() < 1e-6, "{footprint}");
        }
    }

    #[test]
    fn each_dimension_has_its_factor() {
        // Twice as large, and a quarter as fast for its size.
        let scale = task(0.4, 0.5, 0.1).scale();
        let found = [scale.m(0.3), scale.s(0.5), scale.mps(0.2), scale.step_s()];
        assert_eq!(found.map(f32::to_bits), [0.6, 2.0, 0.1, 0.4_f32].map(f32::to_bits));
        assert_eq!(scale.ns(0.25), 1_000_000_000);
    }

    #[test]
    fn a_time_is_at_least_a_tick() {
        for (period_s, ticks) in
            [(0.2, [1, 2, 10]), (0.1, [1, 3, 20]), (0.05, [1, 6, 40]), (0.02, [1, 15, 100])]
        {
            let task = task(0.2, 1.0, period_s);
            assert_eq!([0.001, 0.3, 2.0].map(|s| task.ticks(s)), ticks, "{period_s}");
            assert!((task.step_share() - period_s / 0.1).abs() < 1e-6);
        }
    }
}
