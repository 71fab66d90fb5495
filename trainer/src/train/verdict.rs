//! What a run reached, and which thresholds of its gate it missed.

use nav_core::task::Task;
use nav_sim::families::Family;
use serde::{Deserialize, Serialize};

use super::gate::FamilyScore;
use super::low_score::{LowReport, LowScore};
use crate::config::Config;

/// What a run reached, and what it missed.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct GateReport {
    /// The low level alone.
    pub low: LowReport,
    /// The whole policy, by family.
    pub families: Vec<FamilyScore>,
    /// The low level driven straight at the goal, by family: the flat rival.
    pub flat: Vec<FamilyScore>,
    /// Every threshold that was missed, as a sentence; empty when the gate is passed.
    pub missed: Vec<String>,
}

impl GateReport {
    /// For the logs: `gate/low_reach`, `gate/maze_success` and so on, shares; `gate/missed` counts what was missed.
    pub fn scalars(&self, task: &Task) -> Vec<(String, f64)> {
        let mut scalars = vec![
            ("gate/missed".to_owned(), self.missed.len() as f64),
            ("gate/deviation_margin".to_owned(), f64::from(task.decision.deviation_margin)),
            ("gate/low_reach".to_owned(), f64::from(self.low.all.reach)),
            ("gate/low_collision".to_owned(), f64::from(self.low.all.collision)),
        ];
        for (prefix, scores) in [("gate/", &self.families), ("gate/flat_", &self.flat)] {
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

/// Which thresholds are missed, as sentences.
pub fn missed(config: &Config, low: &LowScore, families: &[FamilyScore], is_hybrid: bool) -> Vec<String> {
    let gate = &config.gate;
    let mut missed = Vec::new();
    let mut at_least = |what: &str, value: f32, least: f32| {
        if value.is_nan() || value < least {
            missed.push(format!(
                "{what} is {:.1} %, at least {:.1} % is needed",
                100.0 * value,
                100.0 * least
            ));
        }
    };
    let of = |family: Family| {
        families.iter().find(|score| score.family == family).map_or(f32::NAN, FamilyScore::success)
    };
    at_least("success in clutter", of(Family::Clutter), gate.clutter_success);
    if is_hybrid {
        at_least("success in u_trap", of(Family::UTrap), gate.u_trap_success);
        at_least("the low level's reach", low.reach, gate.low_reach);
    }
    // Turning towards a random subgoal behind is no fault, so that spin is judged where the policy drives; a flat
    // policy only in clutter, because it turns about in traps that it has no means to leave.
    let judged: Vec<f32> = families
        .iter()
        .filter(|score| is_hybrid || score.family == Family::Clutter)
        .map(|score| score.spin)
        .collect();
    let spin = judged.iter().sum::<f32>() / judged.len().max(1) as f32;
    let mut limits = vec![("spin on validation worlds".to_owned(), spin, gate.spin)];
    if is_hybrid {
        limits.push(("the low level's collision rate".to_owned(), low.collision, gate.low_collision));
    }
    for score in families {
        let most = if score.family.has_people() { gate.people_collision } else { gate.static_collision };
        limits.push((format!("the collision rate in {}", score.family), score.collision(), most));
    }
    for (what, value, most) in limits {
        if value.is_nan() || value > most {
            missed.push(format!(
                "{what} is {:.1} %, at most {:.1} % is allowed",
                100.0 * value,
                100.0 * most
            ));
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
    fn a_policy_that_hits_people_in_two_worlds_of_three_is_refused_by_the_family() {
        let config = Config::default();
        let low = LowScore { attempts: 1, reach: 1.0, collision: 0.0 };
        let good = [Family::Clutter, Family::UTrap, Family::Crowd].map(|family| scored(family, 0.0));
        assert_eq!(missed(&config, &low, &good, true), Vec::<String>::new());
        for (at, collided) in [(2, 67), (0, 20)] {
            for is_hybrid in [true, false] {
                let mut families = good.clone();
                families[at].collided = collided;
                let missed = missed(&config, &low, &families, is_hybrid);
                assert_eq!(missed.len(), 1, "{missed:?}");
                assert!(missed[0].contains(&families[at].family.to_string()), "{missed:?}");
            }
        }
    }

    #[test]
    fn a_flat_policy_may_turn_about_in_a_trap_but_not_in_clutter() {
        let config = Config::default();
        let low = LowScore { attempts: 1, reach: 1.0, collision: 0.0 };
        let in_a_trap = [scored(Family::Clutter, 0.0), scored(Family::UTrap, 0.5)];
        let in_clutter = [scored(Family::Clutter, 0.5), scored(Family::UTrap, 0.0)];
        assert_eq!(missed(&config, &low, &in_a_trap, false), Vec::<String>::new());
        assert_eq!(missed(&config, &low, &in_clutter, false).len(), 1);
        assert_eq!(missed(&config, &low, &in_a_trap, true).len(), 1);
    }
}
