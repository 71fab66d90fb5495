//! The learning curve of a run: how its policy does, greedily, on validation worlds while it trains. Nothing of the training
//! depends on whether it is drawn: the worlds are others than those that choose and judge, and no random number is taken
//! from the run's.

use anyhow::{Context, Result};
use nav_env::worlds::Place;
use std::path::Path;

use super::gate::{self, FamilyScore, Networks, Purpose};
use super::learners::Learners;
use super::policy::Weights;
use crate::config::Config;
use crate::logs::CsvLog;

/// The file in a run's folder.
pub const CURVE: &str = "curve.csv";

/// The curve of a run, one row a point.
#[derive(Debug)]
pub struct Curve {
    log: CsvLog,
    places: Vec<Place>,
    /// Points a stage.
    points: u64,
}

impl Curve {
    /// Opens the curve of a run that starts or goes on after `step`; none if the configuration wants none.
    ///
    /// # Errors
    /// A file that cannot be read or written.
    pub fn open(config: &Config, folder: &Path, step: u64) -> Result<Option<Self>> {
        let points = u64::from(config.curve.points);
        if points == 0 {
            return Ok(None);
        }
        let path = folder.join(CURVE);
        let log = CsvLog::open(&path, step).with_context(|| format!("cannot write {}", path.display()))?;
        Ok(Some(Self { log, places: gate::validation_places(config, Purpose::Follow), points }))
    }

    /// The last point that lies at or before a position of a stage that ends at `budget`.
    pub fn point(&self, position: u64, budget: u64) -> u64 {
        position.min(budget) * self.points / budget.max(1)
    }

    /// Drives all its worlds with what was learned until a step, and writes a row: for each family the shares of worlds that
    /// end in success, collision and time-out, and of steps that are spin; `hybrid` is 1 where a high level decides, and 0
    /// where the low level drives straight at the goal. Before the warm-up is over there is nothing to draw.
    ///
    /// # Errors
    /// Networks that the executor cannot hold, or a file that cannot be written.
    pub fn draw(&mut self, config: &Config, step: u64, is_hybrid: bool, learners: &Learners) -> Result<()> {
        let Some(normaliser) = learners.low.normaliser() else { return Ok(()) };
        let actor = Weights::of(learners.low.learner().actor());
        let scorer = learners.scorer().filter(|_| is_hybrid);
        let networks = Networks { actor: &actor, normaliser, scorer: scorer.as_ref() };
        let scores = gate::score_families(config, &config.task, &networks, &self.places)?;
        let row = row(is_hybrid, &scores);
        let row: Vec<_> = row.iter().map(|(name, value)| (name.as_str(), *value)).collect();
        self.log.write(step, &row).context("a point of the learning curve was not written")
    }
}

fn row(is_hybrid: bool, scores: &[FamilyScore]) -> Vec<(String, f64)> {
    let figures = scores.iter().flat_map(|score| {
        let named = |name: &str, value: f32| (format!("{}/{name}", score.family), f64::from(value));
        [
            named("success", score.success()),
            named("collision", score.collision()),
            named("timeout", score.timeout()),
            named("spin", score.spin),
        ]
    });
    std::iter::once(("hybrid".to_owned(), f64::from(u8::from(is_hybrid)))).chain(figures).collect()
}
