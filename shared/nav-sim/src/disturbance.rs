//! How the simulated robot differs from a perfect one: ranges, drawn once an episode.

use crate::families::UnknownName;
use crate::localiser::Localiser;
use nav_core::task::Robot;
use rand::{Rng, RngExt};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// The longest latency that can be simulated, control periods: 0.8 s at 50 Hz.
pub const LATENCY_MAX_STEPS: u32 = 40;
/// The longest latency that may be asked for, s.
const LATENCY_MAX_S: f32 = 2.0;
/// A base lags by this share of its longest latency at most.
const LAG_SHARE: f32 = 0.75;
/// The length of a straight run after which [`Disturbance::odometry_drift`] is calibrated, m.
pub const DRIFT_REFERENCE_M: f32 = 10.0;

/// Ranges `[low, high]` from which each episode draws evenly. The default is a perfect robot.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Disturbance {
    /// Standard deviation of the error of each range, m.
    pub range_noise_m: [f32; 2],
    /// Share of beams whose measurement fails: they read NaN, whatever is there.
    pub dropout: [f32; 2],
    /// Time from a command to its effect, s, in whole control periods; at most [`LATENCY_MAX_STEPS`] of them.
    pub latency_s: [f32; 2],
    /// Time constant with which the base follows a command, s; 0 follows at once.
    pub actuation_lag_s: [f32; 2],
    /// True velocity over commanded velocity, both linear and angular.
    pub velocity_gain: [f32; 2],
    /// Error of the odometry after a straight run of [`DRIFT_REFERENCE_M`], as a share of that distance. It
    /// comes from a wrong scale and a slow turn, in a mixture drawn each episode. The share holds at that distance
    /// only: the scale's part stays a share of the way, the turn's grows with its square. Where all of it is
    /// turn, 2 % after 10 m are 4 % after 20 m and 6 % after 30 m.
    pub odometry_drift: [f32; 2],
    /// True footprint radius over that of the task.
    pub radius_scale: [f32; 2],
    /// Share of episodes with a perfect robot, whatever the ranges say: a policy that has only ever seen noise may
    /// stand still for ever without it.
    pub clean_share: f32,
    /// What corrects the goal in the drifting `odom` frame; none in a clean episode, which does not drift.
    pub localiser: Localiser,
}

/// What one episode drew from a [`Disturbance`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DrawnDisturbance {
    /// Standard deviation of the error of each range, m.
    pub range_noise_m: f32,
    /// Probability that a beam's measurement fails.
    pub dropout: f32,
    /// Control periods from a command to its effect.
    pub latency_steps: u32,
    /// Time constant with which the base follows a command, s.
    pub actuation_lag_s: f32,
    /// True velocity over commanded velocity.
    pub velocity_gain: f32,
    /// Believed distance over true distance, minus 1.
    pub odometry_scale: f32,
    /// Believed minus true turn per distance driven, rad/m.
    pub odometry_turn_radpm: f32,
    /// True footprint radius over that of the task.
    pub radius_scale: f32,
    /// What corrects the goal.
    pub localiser: Localiser,
}

/// The disturbances that robots are scored with, by name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DisturbanceName {
    /// [`Disturbance::none`].
    None,
    /// [`Disturbance::usual`].
    #[default]
    Usual,
    /// [`Disturbance::without_localiser`].
    NoLocaliser,
}

impl DisturbanceName {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::None, Self::Usual, Self::NoLocaliser];

    /// Its name on command lines and in results.
    pub const fn id(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Usual => "usual",
            Self::NoLocaliser => "no_localiser",
        }
    }

    /// What it stands for, on a robot.
    pub fn disturbance(self, robot: &Robot) -> Disturbance {
        match self {
            Self::None => Disturbance::none(),
            Self::Usual => Disturbance::usual().on(robot),
            Self::NoLocaliser => Disturbance::without_localiser().on(robot),
        }
    }
}

impl fmt::Display for DisturbanceName {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(self.id())
    }
}

impl FromStr for DisturbanceName {
    type Err = UnknownName;

    fn from_str(name: &str) -> Result<Self, UnknownName> {
        Self::ALL.into_iter().find(|known| known.id() == name).ok_or_else(|| UnknownName {
            kind: "disturbance",
            name: name.into(),
            known: Self::ALL.map(Self::id).join(", "),
        })
    }
}

impl Default for Disturbance {
    fn default() -> Self {
        Self::none()
    }
}

impl Disturbance {
    /// A perfect robot.
    pub const fn none() -> Self {
        Self {
            range_noise_m: [0.0; 2],
            dropout: [0.0; 2],
            latency_s: [0.0; 2],
            actuation_lag_s: [0.0; 2],
            velocity_gain: [1.0; 2],
            odometry_drift: [0.0; 2],
            radius_scale: [1.0; 2],
            clean_share: 0.0,
            localiser: Localiser {
                period_s: 0.0,
                position_error_m: 0.0,
                heading_error_rad: 0.0,
                late_share: 0.0,
                late_s: 0.0,
            },
        }
    }

    /// What the shipped policies are trained with.
    pub const fn trained() -> Self {
        Self {
            range_noise_m: [0.01, 0.03],
            dropout: [0.0, 0.1],
            latency_s: [0.0, 0.2],
            actuation_lag_s: [0.0, 0.15],
            velocity_gain: [0.9, 1.1],
            odometry_drift: [0.0, 0.02],
            radius_scale: [0.9, 1.1],
            clean_share: 0.2,
            localiser: Localiser::usual(),
        }
    }

    /// What published figures are measured with: as in training, and never clean.
    pub const fn usual() -> Self {
        Self { clean_share: 0.0, ..Self::trained() }
    }

    /// With latency and lag as they are to be expected of a robot.
    pub fn on(self, robot: &Robot) -> Self {
        let Robot { latency_s, .. } = *robot;
        Self { latency_s: [0.0, latency_s], actuation_lag_s: [0.0, LAG_SHARE * latency_s], ..self }
    }

    /// A stress: as [`Self::usual`], but nothing corrects the odometry's drift.
    pub const fn without_localiser() -> Self {
        Self { localiser: Self::none().localiser, ..Self::usual() }
    }

    /// The first thing about these ranges that makes no sense, as a sentence.
    ///
    /// # Errors
    /// A field whose range is empty or reaches outside its limits.
    pub fn validate(&self) -> Result<(), &'static str> {
        let within = |range: [f32; 2], low: f32, high: f32| {
            range[0] >= low && range[0] <= range[1] && range[1] <= high
        };
        let checks = [
            (within(self.range_noise_m, 0.0, 1.0), "range_noise_m must be [low, high] within [0, 1]"),
            (within(self.dropout, 0.0, 1.0), "dropout must be [low, high] within [0, 1]"),
            (within(self.latency_s, 0.0, LATENCY_MAX_S), "latency_s must be [low, high] within [0, 2]"),
            (within(self.actuation_lag_s, 0.0, 5.0), "actuation_lag_s must be [low, high] within [0, 5]"),
            (within(self.velocity_gain, 0.1, 2.0), "velocity_gain must be [low, high] within [0.1, 2]"),
            (within(self.odometry_drift, 0.0, 0.5), "odometry_drift must be [low, high] within [0, 0.5]"),
            (within(self.radius_scale, 0.1, 2.0), "radius_scale must be [low, high] within [0.1, 2]"),
            (within([self.clean_share; 2], 0.0, 1.0), "clean_share must lie in [0, 1]"),
            (
                within([self.localiser.period_s; 2], 0.0, 3600.0),
                "localiser.period_s must lie in [0, 3600] s; 0 is no localiser",
            ),
            (
                within([self.localiser.position_error_m; 2], 0.0, 10.0),
                "localiser.position_error_m must lie in [0, 10] m",
            ),
            (
                within([self.localiser.heading_error_rad; 2], 0.0, 3.0),
                "localiser.heading_error_rad must lie in [0, 3] rad",
            ),
            (within([self.localiser.late_share; 2], 0.0, 1.0), "localiser.late_share must lie in [0, 1]"),
            (within([self.localiser.late_s; 2], 0.0, 3600.0), "localiser.late_s must lie in [0, 3600] s"),
        ];
        match checks.into_iter().find(|(fine, _)| !fine) {
            Some((_, sentence)) => Err(sentence),
            None => Ok(()),
        }
    }

    /// Draws an episode at a control period. The number of draws does not depend on the ranges.
    pub fn draw(&self, period_s: f32, rng: &mut impl Rng) -> DrawnDisturbance {
        let mut uniform = |[low, high]: [f32; 2]| low + (high - low) * rng.random::<f32>();
        let latency =
            self.latency_s.map(|latency_s| ((latency_s / period_s).round() as u32).min(LATENCY_MAX_STEPS));
        let latency_share = uniform([0.0, 1.0]);
        let choices = latency[1].saturating_sub(latency[0]) + 1;
        let drift = uniform(self.odometry_drift);
        let mixture_rad = uniform([0.0, std::f32::consts::TAU]);
        let drawn = DrawnDisturbance {
            range_noise_m: uniform(self.range_noise_m),
            dropout: uniform(self.dropout),
            latency_steps: latency[0] + ((latency_share * choices as f32) as u32).min(choices - 1),
            actuation_lag_s: uniform(self.actuation_lag_s),
            velocity_gain: uniform(self.velocity_gain),
            odometry_scale: drift * libm::cosf(mixture_rad),
            // A steady turn of b rad/m puts a straight run of L off by b L²/2 sideways.
            odometry_turn_radpm: 2.0 * drift * libm::sinf(mixture_rad) / DRIFT_REFERENCE_M,
            radius_scale: uniform(self.radius_scale),
            localiser: self.localiser,
        };
        if uniform([0.0, 1.0]) < self.clean_share { DrawnDisturbance::none() } else { drawn }
    }
}

impl DrawnDisturbance {
    /// A perfect robot.
    pub const fn none() -> Self {
        Self {
            range_noise_m: 0.0,
            dropout: 0.0,
            latency_steps: 0,
            actuation_lag_s: 0.0,
            velocity_gain: 1.0,
            odometry_scale: 0.0,
            odometry_turn_radpm: 0.0,
            radius_scale: 1.0,
            localiser: Disturbance::none().localiser,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_xoshiro::Xoshiro256PlusPlus;

    #[test]
    fn both_presets_are_valid_and_nonsense_is_not() {
        assert_eq!(Disturbance::none().validate(), Ok(()));
        assert_eq!(Disturbance::trained().validate(), Ok(()));
        let wrong = Disturbance { dropout: [0.2, 0.1], ..Disturbance::none() };
        assert_eq!(wrong.validate(), Err("dropout must be [low, high] within [0, 1]"));
        let wrong = Disturbance { range_noise_m: [0.0, f32::NAN], ..Disturbance::none() };
        assert!(wrong.validate().is_err());
    }

    #[test]
    fn draws_stay_inside_their_ranges_and_reach_both_ends_of_the_latency() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
        let mut latencies = [0_u32; 3];
        for _ in 0..1000 {
            let drawn = Disturbance::usual().draw(0.1, &mut rng);
            assert!((0.01..=0.03).contains(&drawn.range_noise_m));
            assert!((0.0..=0.1).contains(&drawn.dropout));
            assert!((0.9..=1.1).contains(&drawn.velocity_gain) && (0.9..=1.1).contains(&drawn.radius_scale));
            let sideways = drawn.odometry_turn_radpm * DRIFT_REFERENCE_M / 2.0;
            assert!(drawn.odometry_scale.hypot(sideways) <= 0.02 + 1e-6);
            latencies[drawn.latency_steps as usize] += 1;
        }
        assert!(latencies.iter().all(|&count| count > 250), "{latencies:?}");
    }

    #[test]
    fn the_latency_is_a_time_whatever_the_rate_and_the_robot_says_which() {
        assert_eq!(Disturbance::usual().on(&Robot::default()), Disturbance::usual());
        let robot = Robot { latency_s: 0.4, ..Robot::default() };
        let late = Disturbance::usual().on(&robot);
        for (period_s, most) in [(0.2, 2), (0.1, 4), (0.05, 8), (0.02, 20), (0.005, LATENCY_MAX_STEPS)] {
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(7);
            let draws = (0..500).map(|_| late.draw(period_s, &mut rng).latency_steps);
            assert_eq!(draws.max(), Some(most), "{period_s}");
        }
    }

    #[test]
    fn a_share_of_the_episodes_is_clean_in_everything() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(6);
        let draws: Vec<_> = (0..2000).map(|_| Disturbance::trained().draw(0.1, &mut rng)).collect();
        let clean = draws.iter().filter(|drawn| **drawn == DrawnDisturbance::none()).count();
        assert!((300..500).contains(&clean), "{clean} of 2000, a fifth was asked for");
        assert!(draws.iter().all(|drawn| (drawn.dropout > 0.0) == drawn.localiser.exists()));
        assert!(
            Disturbance::usual().localiser.exists() && !Disturbance::without_localiser().localiser.exists()
        );
    }
}
