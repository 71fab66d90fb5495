//! What a run reached, and which thresholds of its gate it missed.

use nav_core::task::Task;
use nav_sim::families::Family;
use serde::{Deserialize, Serialize};

use super::gate::FamilyScore;
use super::low_score::{LowReport, LowScore};
use crate::config::{Config, GateConfig};

/// A run that misses no threshold by more than this may pass with another seed; a share, 5 percentage points.
pub const NARROW: f32 = 0.05;

/// A threshold that was missed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Miss {
    /// What was reached, and what is needed.
    pub sentence: String,
    /// By how much, a share; not a number where nothing was measured.
    pub by: f32,
    /// Whether it says something of the low level alone.
    pub is_of_low: bool,
}

/// What a run reached, and what it missed.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct GateReport {
    /// The low level alone.
    pub low: LowReport,
    /// The whole policy, by family.
    pub families: Vec<FamilyScore>,
    /// The low level driven straight at the goal, by family: the flat rival.
    pub flat: Vec<FamilyScore>,
    /// The reactive rival behind the same safety gate, in the families with people.
    pub reactive: Vec<FamilyScore>,
    /// What it was judged by.
    pub thresholds: GateConfig,
    /// Every threshold that was missed; empty when the gate is passed.
    pub missed: Vec<Miss>,
}

impl GateReport {
    /// Whether every threshold was met.
    pub fn is_passed(&self) -> bool {
        self.missed.is_empty()
    }

    /// Whether it was missed, and no threshold by more than [`NARROW`]: luck may be to blame.
    pub fn is_missed_narrowly(&self) -> bool {
        // A millionth for the rounding of shares.
        !self.is_passed() && self.missed.iter().all(|miss| miss.by <= NARROW + 1e-6)
    }

    /// What was missed, in a line.
    pub fn sentences(&self) -> String {
        let sentences: Vec<_> = self.missed.iter().map(|miss| miss.sentence.as_str()).collect();
        sentences.join("; ")
    }

    /// For the logs: `gate/low_reach`, `gate/maze_success` and so on, shares; `gate/missed` counts what was missed.
    pub fn scalars(&self, task: &Task) -> Vec<(String, f64)> {
        let mut scalars = vec![
            ("gate/missed".to_owned(), self.missed.len() as f64),
            ("gate/deviation_margin".to_owned(), f64::from(task.decision.deviation_margin)),
            ("gate/low_reach".to_owned(), f64::from(self.low.all.reach)),
            ("gate/low_collision".to_owned(), f64::from(self.low.all.collision)),
        ];
        for (prefix, scores) in
            [("gate/", &self.families), ("gate/flat_", &self.flat), ("gate/reactive_", &self.reactive)]
        {
            for score in scores {
                let figures =
                    [("success", score.success()), ("collision", score.collision()), ("spin", score.spin)];
                scalars.extend(
                    figures
                        .map(|(name, value)| (format!("{prefix}{}_{name}", score.family), f64::from(value))),
                );
            }
        }
        scalars
    }
}

/// Which thresholds are missed, by what the policy and the reactive rival did in each family.
///
/// How often people are met depends on the robot: one that is slower than they are is walked into whatever it does. So the
/// reactive rule, which needs no training, is the measure among people.
pub fn missed(
    config: &Config,
    low: &LowScore,
    (families, reactive): (&[FamilyScore], &[FamilyScore]),
    is_hybrid: bool,
) -> Vec<Miss> {
    let gate = &config.gate;
    let mut missed = Vec::new();
    let mut at_least = |what: &str, value: f32, least: f32, is_of_low: bool| {
        if value.is_nan() || value < least {
            let (is, needed) = (100.0 * value, 100.0 * least);
            let sentence = format!("{what} is {is:.1} %, at least {needed:.1} % is needed");
            missed.push(Miss { sentence, by: least - value, is_of_low });
        }
    };
    let of = |family: Family| {
        families.iter().find(|score| score.family == family).map_or(f32::NAN, FamilyScore::success)
    };
    at_least("success in clutter", of(Family::Clutter), gate.clutter_success, false);
    if is_hybrid {
        at_least("success in u_trap", of(Family::UTrap), gate.u_trap_success, false);
        at_least("the low level's reach", low.reach, gate.low_reach, true);
    }
    // Turning towards a random subgoal behind is no fault, so that spin is judged where the policy drives; a flat
    // policy only in clutter, because it turns about in traps that it has no means to leave.
    let judged: Vec<f32> = families
        .iter()
        .filter(|score| is_hybrid || score.family == Family::Clutter)
        .map(|score| score.spin)
        .collect();
    let spin = judged.iter().sum::<f32>() / judged.len().max(1) as f32;
    let mut limits = vec![("spin on validation worlds".to_owned(), spin, gate.spin, "", false)];
    if is_hybrid {
        limits.push((
            "the low level's collision rate".to_owned(),
            low.collision,
            gate.low_collision,
            "",
            true,
        ));
    }
    for score in families {
        let rival = reactive.iter().find(|rival| rival.family == score.family);
        let (most, why) = if score.family.has_people() {
            let rivals = rival.map_or(f32::NAN, FamilyScore::collision);
            (rivals + gate.people_collision_beyond_reactive, ", by what the reactive rival does there")
        } else {
            (gate.static_collision, "")
        };
        limits.push((format!("the collision rate in {}", score.family), score.collision(), most, why, false));
    }
    for (what, value, most, why, is_of_low) in limits {
        if value.is_nan() || most.is_nan() || value > most {
            let (is, allowed) = (100.0 * value, 100.0 * most);
            let sentence = format!("{what} is {is:.1} %, at most {allowed:.1} % is allowed{why}");
            missed.push(Miss { sentence, by: value - most, is_of_low });
        }
    }
    missed
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scored(family: Family, spin: f32) -> FamilyScore {
        FamilyScore { family, worlds: 100, reached: 100, collided: 0, spin }
    }

    #[test]
    fn a_policy_that_hits_people_more_often_than_a_reactive_rule_is_refused_by_the_family() {
        let config = Config::default();
        let low = LowScore { attempts: 1, reach: 1.0, collision: 0.0 };
        let good = [Family::Clutter, Family::UTrap, Family::Crowd].map(|family| scored(family, 0.0));
        // A slow robot, which is walked into whatever drives it.
        let slow = [FamilyScore { collided: 71, ..scored(Family::Crowd, 0.0) }];
        let fast = [scored(Family::Crowd, 0.0)];
        let judged = |families: &[FamilyScore], rival: &[FamilyScore]| {
            missed(&config, &low, (families, rival), true).len()
        };
        let hit = |collided| {
            let mut families = good.clone();
            families[2].collided = collided;
            families
        };
        assert_eq!([judged(&hit(63), &slow), judged(&hit(76), &slow), judged(&hit(77), &slow)], [0, 0, 1]);
        assert_eq!([judged(&hit(5), &fast), judged(&hit(6), &fast)], [0, 1]);
        assert_eq!(judged(&hit(0), &[]), 1, "nobody measured what is possible");
        for (at, collided) in [(2, 67), (0, 20)] {
            for is_hybrid in [true, false] {
                let mut families = good.clone();
                families[at].collided = collided;
                let missed = missed(&config, &low, (&families, &fast), is_hybrid);
                assert_eq!(missed.len(), 1, "{missed:?}");
                assert!(missed[0].sentence.contains(&families[at].family.to_string()), "{missed:?}");
            }
        }
    }

    #[test]
    fn a_flat_policy_may_turn_about_in_a_trap_but_not_in_clutter() {
        let config = Config::default();
        let low = LowScore { attempts: 1, reach: 1.0, collision: 0.0 };
        let in_a_trap = [scored(Family::Clutter, 0.0), scored(Family::UTrap, 0.5)];
        let in_clutter = [scored(Family::Clutter, 0.5), scored(Family::UTrap, 0.0)];
        assert_eq!(missed(&config, &low, (&in_a_trap, &[]), false), Vec::new());
        assert_eq!(missed(&config, &low, (&in_clutter, &[]), false).len(), 1);
        assert_eq!(missed(&config, &low, (&in_a_trap, &[]), true).len(), 1);
    }

    #[test]
    fn a_narrow_miss_is_one_that_luck_may_be_to_blame_for() {
        let config = Config::default();
        let report = |reach: f32, collided: usize| {
            let low = LowScore { attempts: 400, reach, collision: 0.0 };
            let mut families = [Family::Clutter, Family::UTrap, Family::Crowd].map(|of| scored(of, 0.0));
            families[2].collided = collided;
            let rival = [FamilyScore { collided: 55, ..scored(Family::Crowd, 0.0) }];
            GateReport { missed: missed(&config, &low, (&families, &rival), true), ..GateReport::default() }
        };
        // At least 90 % reached, at most 60 % hit: 5 more than by the rival.
        for (reach, collided, is_passed, is_narrow) in [
            (0.9, 60, true, false),
            (0.86, 60, false, true),
            (0.86, 64, false, true),
            (0.86, 66, false, false),
            (0.84, 60, false, false),
            (f32::NAN, 60, false, false),
        ] {
            let report = report(reach, collided);
            assert_eq!(report.is_passed(), is_passed, "{report:?}");
            assert_eq!(report.is_missed_narrowly(), is_narrow, "{report:?}");
        }
        assert_eq!(report(0.84, 66).sentences().matches(" %, at ").count(), 2);
    }
}
