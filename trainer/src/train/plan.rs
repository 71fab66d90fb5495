//! The stages of a run, as data: what learns, on which robots and worlds, and for how long.

use nav_core::manifest::Algorithm;
use nav_env::worlds::{Place, generate_places};
use nav_sim::families::{Family, Split};
use std::sync::Arc;

use super::high_stage::HighStage;
use super::low_stage::LowStage;
use super::past::More;
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
    /// Whether it goes on where an earlier one ended, with the exploration and the learning rates of its end.
    pub goes_on: bool,
}

/// Random streams from one `--more` to the next.
const STREAMS_A_MORE: u64 = 10_000;

/// The stages of a run, in order, those of each `--more` at the end. A run above a borrowed low level does not train one.
pub fn stages(config: &Config, low_is_borrowed: bool, more: &[More]) -> Vec<StagePlan> {
    let low = StagePlan {
        name: "low level",
        learns: Learns::Low,
        families: config.low.families.clone(),
        robots: config.low.envs,
        budget: config.low.env_steps,
        streams: [1_000, 2_000],
        goes_on: false,
    };
    let high = StagePlan {
        name: "high level",
        learns: Learns::High,
        families: config.high.families.clone(),
        robots: config.high.envs,
        budget: config.high.decisions,
        streams: [3_000, 4_000],
        goes_on: false,
    };
    let mut stages = Vec::new();
    if !low_is_borrowed {
        stages.push(low);
    }
    if config.algorithm == Algorithm::Hybrid {
        stages.push(high);
    }
    let first = stages.clone();
    for (more, shift) in more.iter().zip((STREAMS_A_MORE..).step_by(STREAMS_A_MORE as usize)) {
        stages.extend(first.iter().map(|plan| {
            let (name, budget) = match plan.learns {
                Learns::Low => ("more low", more.low_steps),
                Learns::High => ("more high", more.high_decisions),
            };
            let streams = plan.streams.map(|stream| stream + shift);
            StagePlan { name, budget, streams, goes_on: true, ..plan.clone() }
        }));
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
        Arc::new(generate_places(&self.families, Split::Train, seeds, &config.task.robot.footprint))
    }
}
