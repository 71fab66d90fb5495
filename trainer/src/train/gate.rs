//! What a run must reach before it may be exported, measured greedily on validation worlds.

use anyhow::Result;
use nav_core::controller::Controller;
use nav_core::metrics::EpisodeEnd;
use nav_core::task::{ACTION_COUNT, Task};
use nav_env::batch::{BatchOptions, drive_all};
use nav_env::robot::Driven;
use nav_env::worlds::{Place, generate_places};
use nav_host::terminal::note;
use nav_rivals::reactive::Reactive;
use nav_sim::families::{Family, Split};
use serde::{Deserialize, Serialize};

use crate::acting::{Normaliser, pack};
use crate::config::Config;
use crate::train::low_score::LowReport;
use crate::train::policy::Weights;
use crate::train::verdict::{GateReport, missed};

/// How a policy does on a family's validation worlds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FamilyScore {
    /// The family.
    pub family: Family,
    /// Worlds driven.
    pub worlds: usize,
    /// Worlds in which it reached the goal.
    pub reached: usize,
    /// Worlds in which it collided.
    pub collided: usize,
    /// Share of steps that were spin.
    pub spin: f32,
}

impl FamilyScore {
    fn share(&self, count: usize) -> f32 {
        count as f32 / self.worlds.max(1) as f32
    }

    /// Share of worlds in which it reached the goal.
    pub fn success(&self) -> f32 {
        self.share(self.reached)
    }

    /// Share of worlds in which it collided.
    pub fn collision(&self) -> f32 {
        self.share(self.collided)
    }

    /// Share of worlds in which it did neither in time.
    pub fn timeout(&self) -> f32 {
        self.share(self.worlds.saturating_sub(self.reached + self.collided))
    }
}

/// What is judged.
#[derive(Clone, Copy, Debug)]
pub struct Networks<'a> {
    /// The low level.
    pub actor: &'a Weights,
    /// How its observations are normalised.
    pub normaliser: &'a Normaliser,
    /// The high level; none in a flat policy.
    pub scorer: Option<&'a Weights>,
}

/// What validation worlds are for: no world is for two of these.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// To choose the deviation margin.
    Choose,
    /// To judge the policy.
    Judge,
    /// To draw the learning curve.
    Follow,
}

/// Validation worlds of every family that a run trains its top level on.
pub fn validation_places(config: &Config, purpose: Purpose) -> Vec<Place> {
    let mut families = config.high.families.clone();
    for wanted in [Family::Clutter, Family::UTrap] {
        if !families.contains(&wanted) {
            families.push(wanted);
        }
    }
    let (choosing, judging) = (u64::from(config.gate.choosing_worlds), u64::from(config.gate.worlds));
    let seeds = match purpose {
        Purpose::Choose => 0..choosing,
        Purpose::Judge => choosing..choosing + judging,
        Purpose::Follow => choosing + judging..choosing + judging + u64::from(config.curve.worlds),
    };
    generate_places(&families, Split::Validation, seeds, &config.task.robot.footprint)
}

/// Drives every place once with the given networks, and scores each family.
///
/// # Errors
/// A network that the executor cannot hold.
pub fn score_families(
    config: &Config,
    task: &Task,
    networks: &Networks<'_>,
    places: &[Place],
) -> Result<Vec<FamilyScore>> {
    let controller = || -> Result<_> {
        let low = pack(&networks.actor.network()?, Some(networks.normaliser), 1)?;
        let high = networks.scorer.map(|scorer| anyhow::Ok(pack(&scorer.network()?, None, ACTION_COUNT)?));
        let high = high.transpose()?;
        Ok(Controller::new(task, high, low)?)
    };
    // Built once here so that an error shows before threads start.
    controller()?;
    let make = || controller().expect("it was built a moment ago");
    let options = BatchOptions { task, disturbance: &config.disturbance, threads: 2 };
    Ok(scores(places, &drive_all(make, places, &options)))
}

/// The reactive rival behind the same safety gate, in the places with people: what a robot of this size and speed meets there
/// that needs no training.
fn score_reactive(config: &Config, task: &Task, places: &[Place]) -> Vec<FamilyScore> {
    let has_people = |place: &&Place| place.scene.family().is_some_and(Family::has_people);
    let places: Vec<Place> = places.iter().filter(has_people).cloned().collect();
    let options = BatchOptions { task, disturbance: &config.disturbance, threads: 2 };
    scores(&places, &drive_all(|| Reactive::new(task), &places, &options))
}

/// By family, in the order in which they come.
fn scores(places: &[Place], driven: &[Driven]) -> Vec<FamilyScore> {
    let mut scores: Vec<FamilyScore> = Vec::new();
    let mut steps: Vec<f32> = Vec::new();
    for (place, driven) in places.iter().zip(driven) {
        let Some(family) = place.scene.family() else { continue };
        let at = scores.iter().position(|score| score.family == family).unwrap_or_else(|| {
            scores.push(FamilyScore { family, worlds: 0, reached: 0, collided: 0, spin: 0.0 });
            steps.push(0.0);
            scores.len() - 1
        });
        let (score, metrics) = (&mut scores[at], &driven.metrics);
        score.worlds += 1;
        score.reached += usize::from(metrics.end == EpisodeEnd::Success);
        score.collided += usize::from(metrics.end == EpisodeEnd::Collision);
        score.spin += metrics.spin * metrics.steps as f32;
        steps[at] += metrics.steps as f32;
    }
    for (score, steps) in scores.iter_mut().zip(steps) {
        score.spin /= steps.max(1.0);
    }
    scores
}

/// Judges networks, whose low level alone was scored already, by the thresholds of a configuration.
///
/// # Errors
/// A network that the executor cannot hold.
pub fn judge(config: &Config, task: &Task, networks: &Networks<'_>, low: LowReport) -> Result<GateReport> {
    note(format_args!("  validation  driving {} other unseen worlds a family", config.gate.worlds));
    let places = validation_places(config, Purpose::Judge);
    let flat = score_families(config, task, &Networks { scorer: None, ..*networks }, &places)?;
    let families = match networks.scorer {
        Some(_) => score_families(config, task, networks, &places)?,
        None => flat.clone(),
    };
    let reactive = score_reactive(config, task, &places);
    let missed = missed(config, &low.all, (&families, &reactive), networks.scorer.is_some());
    Ok(GateReport { low, families, flat, reactive, thresholds: config.gate.clone(), missed })
}

/// One number to choose by: mean success, less a quarter of mean collision.
pub fn merit(scores: &[FamilyScore]) -> f32 {
    let sum: f32 = scores.iter().map(|score| score.success() - 0.25 * score.collision()).sum();
    sum / scores.len().max(1) as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{CurveConfig, GateConfig};

    #[test]
    fn shares_add_up_and_none_is_negative() {
        for (reached, collided) in [(13, 2), (15, 0), (0, 15), (7, 7), (0, 0)] {
            let score = FamilyScore { family: Family::Maze, worlds: 15, reached, collided, spin: 0.0 };
            let timeouts = (15 - reached - collided) as f32 / 15.0;
            assert_eq!(score.timeout().to_bits(), timeouts.to_bits(), "{score:?}");
            assert!((score.success() + score.collision() + score.timeout() - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn no_world_is_for_two_purposes() {
        let config = Config {
            gate: GateConfig { worlds: 3, choosing_worlds: 2, ..GateConfig::default() },
            curve: CurveConfig { worlds: 4, ..CurveConfig::default() },
            ..Config::default()
        };
        let names = |purpose| {
            let places = validation_places(&config, purpose);
            places.iter().map(|place| place.world.name.clone()).collect::<Vec<_>>()
        };
        let all = [Purpose::Choose, Purpose::Judge, Purpose::Follow].map(names);
        assert_eq!((all[0].len() % 2, all[1].len() % 3, all[2].len() % 4), (0, 0, 0));
        let mut names = all.concat();
        let count = names.len();
        names.sort();
        names.dedup();
        assert!(all.iter().all(|names| !names.is_empty()) && names.len() == count);
    }
}
