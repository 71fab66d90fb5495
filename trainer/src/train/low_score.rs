//! How a low level does on random subgoals, by family: the half of the gate that needs no high level.

use anyhow::Result;
use nav_core::observation::LOW_ACTION;
use nav_env::ActingNetwork;
use nav_env::low::{Attempt, LowRobot, LowRobotConfig};
use nav_env::seeds::derive;
use nav_env::worlds::generate_places;
use nav_sim::families::{Family, Split};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

use super::low_learner::LowLearner;
use crate::acting::pack;
use crate::config::Config;

/// Attempts in each family. A share near 97 % of six times as many is known to 0.35 percentage points.
const ATTEMPTS: usize = 400;
/// Validation worlds of each family.
const WORLDS: u64 = 50;
/// Robots that share the attempts.
const ROBOTS: u64 = 8;

/// How the low level does on random subgoals in static worlds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LowScore {
    /// Attempts.
    pub attempts: usize,
    /// Share reached.
    pub reach: f32,
    /// Share that collided.
    pub collision: f32,
}

/// [`LowScore`] over all families, and of each.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LowReport {
    /// Over all families, each with equal weight.
    pub all: LowScore,
    /// Of each static family that the low level is trained on.
    pub families: Vec<(Family, LowScore)>,
}

impl std::fmt::Display for LowReport {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let LowScore { attempts, reach, collision } = self.all;
        let (reach, collision) = (100.0 * reach, 100.0 * collision);
        write!(f, "reaches {reach:.1} % of {attempts} random subgoals, collides in {collision:.1} %")?;
        for (place, (family, score)) in self.families.iter().enumerate() {
            let (reach, collision) = (100.0 * score.reach, 100.0 * score.collision);
            let before = if place == 0 { " (" } else { ", " };
            write!(f, "{before}{family} {reach:.1} and {collision:.1}")?;
        }
        if self.families.is_empty() { Ok(()) } else { f.write_str(")") }
    }
}

/// Drives greedily at random subgoals in validation worlds of every static family that the low level trains on, or of
/// clutter where it trains on none.
///
/// # Errors
/// A network that the executor cannot hold.
pub fn score_low(config: &Config, low: &LowLearner) -> Result<LowReport> {
    let mut network = pack(low.learner().actor(), low.normaliser(), 1)?;
    let mut families: Vec<_> =
        config.low.families.iter().copied().filter(|family| !family.has_people()).collect();
    if families.is_empty() {
        families.push(Family::Clutter);
    }
    let scores = families.into_iter().map(|family| (family, score_family(config, family, &mut network)));
    let families: Vec<(Family, LowScore)> = scores.collect();
    let mean = |of: fn(&LowScore) -> f32| {
        families.iter().map(|(_, score)| of(score)).sum::<f32>() / families.len() as f32
    };
    let all = LowScore {
        attempts: families.iter().map(|(_, score)| score.attempts).sum(),
        reach: mean(|score| score.reach),
        collision: mean(|score| score.collision),
    };
    Ok(LowReport { all, families })
}

fn score_family(config: &Config, family: Family, network: &mut ActingNetwork) -> LowScore {
    let places =
        Arc::new(generate_places(&[family], Split::Validation, 0..WORLDS, config.task.robot.radius_m));
    let low = LowRobotConfig { goal_share: 0.0, ..config.low.robot() };
    let (mut attempts, mut reached, mut collided) = (0, 0, 0);
    for robot in 0..ROBOTS {
        let seed = derive(config.seed, 5_000 + robot);
        let mut robot = LowRobot::new(low, places.clone(), &config.task, &config.disturbance, seed);
        // Each robot makes equally many, so that long attempts count as much as short ones.
        let mut left = ATTEMPTS / ROBOTS as usize;
        // Far more steps than they take: where no subgoal can be found, the score says so by too few attempts.
        for _ in 0..10 * left * config.task.ticks(config.low.subgoal_s) as usize {
            if left == 0 {
                break;
            }
            let mut action = [0.0; LOW_ACTION];
            network.run(robot.observation(), &mut action);
            let is_random = !robot.target_is_goal();
            let attempt = robot.step(action, &mut Vec::new()).attempt;
            if is_random && !matches!(attempt, Attempt::Running | Attempt::Cut) {
                left -= 1;
                attempts += 1;
                reached += usize::from(attempt == Attempt::Reached);
                collided += usize::from(attempt == Attempt::Collided);
            }
        }
    }
    let share = |count: usize| count as f32 / attempts as f32;
    LowScore { attempts, reach: share(reached), collision: share(collided) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_name_the_whole_and_each_family() {
        let score = LowScore { attempts: 400, reach: 0.97, collision: 0.0125 };
        let report = LowReport {
            all: LowScore { attempts: 800, reach: 0.98, ..score },
            families: vec![(Family::Clutter, LowScore { reach: 0.99, ..score }), (Family::Maze, score)],
        };
        assert_eq!(
            report.to_string(),
            "reaches 98.0 % of 800 random subgoals, collides in 1.2 % (clutter 99.0 and 1.2, maze 97.0 and 1.2)"
        );
        assert_eq!(LowReport::default().to_string(), "reaches 0.0 % of 0 random subgoals, collides in 0.0 %");
    }
}
