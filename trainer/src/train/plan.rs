//! The stages of a run, as data: what learns, on which robots and worlds, and for how long.

use nav_core::manifest::Algorithm;
use nav_env::worlds::{Place, generate_places};
use nav_sim::families::{Family, Split};
use std::sync::Arc;

use super::high_stage::HighStage;
use super::low_stage::LowStage;
use super::stage::Stage;
use crate::config::Config;

/// What a stage trains.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Learns {
    /// The low level, on robots that drive at random subgoals and goals.
    Low,
    /// The high level, on robots whose low level does not change.
    High,
}

/// A stage.
#[derive(Clone, Debug)]
pub struct StagePlan {
    /// For the progress bar.
    pub name: &'static str,
    /// What it trains.
    pub learns: Learns,
    /// Families of the worlds that it drives in.
    pub families: Vec<Family>,
    /// Robots that drive side by side.
    pub robots: usize,
    /// How long it lasts: environment steps of a low level, decisions of a high level.
    pub budget: u64,
    /// Random streams of its robots and of their exploration, one a robot from these on: no two stages share any.
    pub streams: [u64; 2],
}

/// The stages of a run, in order. A run above a borrowed low level does not train one.
pub fn stages(config: &Config, low_is_borrowed: bool) -> Vec<StagePlan> {
    let low = StagePlan {
        name: "low level",
        learns: Learns::Low,
        families: config.low.families.clone(),
        robots: config.low.envs,
        budget: config.low.env_steps,
        streams: [1_000, 2_000],
    };
    let high = StagePlan {
        name: "high level",
        learns: Learns::High,
        families: config.high.families.clone(),
        robots: config.high.envs,
        budget: config.high.decisions,
        streams: [3_000, 4_000],
    };
    let mut stages = Vec::new();
    if !low_is_borrowed {
        stages.push(low);
    }
    if config.algorithm == Algorithm::Hybrid {
        stages.push(high);
    }
    stages
}

impl StagePlan {
    /// The stage at its first step.
    pub fn begin(&self, config: &Config) -> Box<dyn Stage> {
        let places = self.places(config);
        match self.learns {
            Learns::Low => Box::new(LowStage::new(config, self, places)),
            Learns::High => Box::new(HighStage::new(config, self, places)),
        }
    }

    fn places(&self, config: &Config) -> Arc<Vec<Place>> {
        let count = u64::from(config.worlds_per_family);
        // Runs of different seeds train in different worlds.
        let first = config.seed % 1_000_000 * count;
        let seeds = first..first + count;
        Arc::new(generate_places(&self.families, Split::Train, seeds, config.task.robot.radius_m))
    }
}
