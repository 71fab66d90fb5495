//! A localiser, as robots in the field have one: it knows the map and now and then says where the `odom` frame lies
//! in it, so that a goal of the map can be followed by odometry that drifts.
//!
//! | what | how |
//! |---|---|
//! | correction | each [`Localiser::period_s`], from the true and the believed pose of that moment |
//! | error | position and heading of the estimate are off by normal errors, drawn anew each time |
//! | delay | a share of the corrections comes [`Localiser::late_s`] late, and until then no other comes |
//!
//! Between corrections the last one holds, so that odometry's drift since then is not corrected. Before the first one
//! the frames coincide, as they do at reset.

use crate::normal::standard_normal;
use nav_core::geometry::Pose;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::{Deserialize, Serialize};

/// How well a localiser works. The default is none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Localiser {
    /// Time from one correction to the next, s; 0 is no localiser at all.
    pub period_s: f32,
    /// Root mean square of the error in position, m.
    pub position_error_m: f32,
    /// Standard deviation of the error in heading, rad.
    pub heading_error_rad: f32,
    /// Share of the corrections that come late.
    pub late_share: f32,
    /// How late those come, s.
    pub late_s: f32,
}

impl Localiser {
    /// A good one: each second, 5 cm and 1 degree, one correction in ten 2 s late.
    pub const fn usual() -> Self {
        Self {
            period_s: 1.0,
            position_error_m: 0.05,
            heading_error_rad: 1.0 * std::f32::consts::PI / 180.0,
            late_share: 0.1,
            late_s: 2.0,
        }
    }

    /// Whether there is one.
    pub fn exists(&self) -> bool {
        self.period_s > 0.0
    }
}

/// A localiser at work.
#[derive(Clone, Debug)]
pub(crate) struct Localisation {
    localiser: Localiser,
    rng: Xoshiro256PlusPlus,
    odom_from_map: Pose,
    /// When the next correction is measured, s.
    next_s: f32,
    /// A late correction, and when it comes, s.
    late: Option<(f32, Pose)>,
}

impl Localisation {
    /// At reset: both frames coincide.
    pub(crate) fn new(localiser: &Localiser, seed: u64) -> Self {
        Self {
            localiser: *localiser,
            rng: Xoshiro256PlusPlus::seed_from_u64(seed),
            odom_from_map: Pose::default(),
            next_s: localiser.period_s,
            late: None,
        }
    }

    /// A step has ended at `time_s` since reset, with the robot at `map_from_robot` in truth and at `odom_from_robot`
    /// as odometry believes.
    pub(crate) fn advance(&mut self, time_s: f32, map_from_robot: Pose, odom_from_robot: Pose) {
        if !self.localiser.exists() {
            return;
        }
        if let Some((due_s, odom_from_map)) = self.late {
            if time_s < due_s {
                return;
            }
            (self.odom_from_map, self.late) = (odom_from_map, None);
        }
        // Half a millisecond covers the rounding of times.
        if time_s + 5e-4 < self.next_s {
            return;
        }
        while self.next_s <= time_s + 5e-4 {
            self.next_s += self.localiser.period_s;
        }
        let measured = self.measured(map_from_robot, odom_from_robot);
        if self.rng.random::<f32>() < self.localiser.late_share {
            self.late = Some((time_s + self.localiser.late_s, measured));
        } else {
            self.odom_from_map = measured;
        }
    }

    /// `odom_from_map`, from an estimate of the robot's pose in the map.
    fn measured(&mut self, map_from_robot: Pose, odom_from_robot: Pose) -> Pose {
        let mut normal = |deviation: f32| deviation * standard_normal(&mut self.rng);
        // Two axes share the error.
        let axis_m = self.localiser.position_error_m * std::f32::consts::FRAC_1_SQRT_2;
        let estimate = Pose::new(
            map_from_robot.x_m + normal(axis_m),
            map_from_robot.y_m + normal(axis_m),
            map_from_robot.yaw_rad + normal(self.localiser.heading_error_rad),
        );
        odom_from_robot.after(&estimate.inverse())
    }

    /// Where the map lies in the `odom` frame, as the newest correction says.
    pub(crate) fn odom_from_map(&self) -> Pose {
        self.odom_from_map
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nav_core::geometry::Point;

    /// Odometry that was turned by 0.1 rad and is half a metre off.
    const DRIFTED: (Pose, Pose) = (Pose::new(4.0, 2.0, 0.3), Pose::new(4.5, 2.0, 0.4));

    fn localised_goal(localisation: &Localisation) -> Point {
        localisation.odom_from_map().parent_from_local(Point::new(9.0, 2.0))
    }

    #[test]
    fn an_exact_one_puts_the_goal_where_odometry_will_find_it() {
        let exact = Localiser { period_s: 1.0, ..Localiser::default() };
        let mut localisation = Localisation::new(&exact, 1);
        let (truth, belief) = DRIFTED;
        localisation.advance(0.9, truth, belief);
        assert_eq!(localisation.odom_from_map(), Pose::default(), "not before its time");
        localisation.advance(1.0, truth, belief);
        let seen = belief.local_from_parent(localised_goal(&localisation));
        let expected = truth.local_from_parent(Point::new(9.0, 2.0));
        assert!((seen - expected).norm() < 1e-5, "{seen} {expected}");
    }

    #[test]
    fn errors_are_as_large_as_it_says_and_late_ones_hold_up_the_rest() {
        let mut localisation = Localisation::new(&Localiser::usual(), 7);
        let (truth, belief) = DRIFTED;
        let (mut squares, mut corrections, mut unchanged) = (0.0, 0, 0);
        let mut before = localisation.odom_from_map();
        for step in 1..=100_000_u32 {
            localisation.advance(step as f32 * 0.1, truth, belief);
            if localisation.odom_from_map() != before {
                before = localisation.odom_from_map();
                let robot = before.parent_from_local(truth.position());
                // Seen from the robot the heading's error does not matter.
                squares += (robot - belief.position()).norm_squared();
                corrections += 1;
            } else if step % 10 == 0 {
                unchanged += 1;
            }
        }
        let error_m = (squares / corrections as f32).sqrt();
        assert!((error_m - 0.05).abs() < 0.005, "{error_m}");
        // Each late correction (a tenth) is missed at its time and takes the place of the one two seconds later.
        assert!((800..1700).contains(&unchanged), "{unchanged} of 10,000 seconds without a correction");
    }

    #[test]
    fn none_never_corrects() {
        let mut localisation = Localisation::new(&Localiser::default(), 1);
        localisation.advance(100.0, DRIFTED.0, DRIFTED.1);
        assert_eq!(localisation.odom_from_map(), Pose::default());
    }
}
