//! A run from its first step to its gate, interrupted and resumed as often as need be.

mod rounds;

use anyhow::{Context, Result, bail};
use nav_core::manifest::Algorithm;
use nav_core::task::Task;
use nav_env::worlds::{Place, generate_places};
use nav_host::stop::{Signal, Stop};
use nav_host::terminal::note;
use nav_sim::families::Split;
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use std::time::Instant;

use super::gate::{self, GateReport, Purpose};
use super::high_stage::HighStage;
use super::low_score::{LowReport, score_low};
use super::low_stage::LowStage;
use super::policy::{Policy, Weights};
use super::run_folder::RunFolder;
use crate::acting::{Normaliser, pack};
use crate::checkpoint::{Checkpoint, CheckpointStore};
use crate::config::Config;
use crate::logs::ScalarLog;

/// How a call to [`Run::train`] ended.
pub enum End {
    /// The run has finished, and this is its policy.
    Finished(Box<Policy>),
    /// Somebody asked to stop.
    Stopped {
        /// How.
        signal: Signal,
        /// Whether the state was saved; not within the warm-up, nor on a full disk.
        is_saved: bool,
    },
    /// The learner cannot get better any more; why, and what to do.
    Failed(String),
}

/// A trained low level.
#[derive(Clone, Serialize, Deserialize)]
struct LowResult {
    actor: Weights,
    normaliser: Normaliser,
    score: LowReport,
    env_steps: u64,
    updates: u64,
}

impl LowResult {
    /// The low level of another run. What it cost is on that run's card.
    fn borrowed(policy: Policy) -> Self {
        Self {
            actor: policy.actor,
            normaliser: policy.normaliser,
            score: policy.gate.low,
            env_steps: 0,
            updates: 0,
        }
    }
}

/// What a checkpoint says besides the stage's own state.
#[derive(Clone, Serialize, Deserialize)]
struct Meta {
    /// The commit that the run began with.
    commit: String,
    config_sha256: String,
    low: Option<LowResult>,
    seconds: f64,
    rolled_back: bool,
}

/// A run under way.
pub struct Run {
    folder: RunFolder,
    config: Config,
    store: CheckpointStore,
    log: ScalarLog,
    stop: Stop,
    meta: Meta,
    checkpoint: Option<Checkpoint>,
    begun: Instant,
    saved: Instant,
    logged_step: u64,
}

impl Run {
    /// A run in a folder, from its newest checkpoint if there is one.
    ///
    /// # Errors
    /// Checkpoints of another configuration, or files that cannot be made.
    pub fn open(folder: RunFolder, stop: Stop) -> Result<Self> {
        let (config, config_sha256) = folder.config()?;
        let store =
            CheckpointStore::open(&folder.checkpoints()).context("cannot make the checkpoint folder")?;
        let newest = store.load_newest_valid();
        for error in newest.skipped {
            let error = anyhow::Error::from(error);
            if newest.checkpoint.is_none() {
                return Err(error.context(format!(
                    "no checkpoint in {} can be read, and starting again would remove them: mend it, or start \
                     a new run",
                    folder.checkpoints().display()
                )));
            }
            note(format_args!("warning: {error:#}"));
        }
        let fresh = Meta {
            commit: crate::commit::commit(),
            config_sha256: config_sha256.clone(),
            low: None,
            seconds: 0.0,
            rolled_back: false,
        };
        let mut meta = match &newest.checkpoint {
            Some(checkpoint) => checkpoint.value::<Meta>("meta")?,
            None => fresh,
        };
        if meta.low.is_none() {
            meta.low = folder.borrowed_low()?.map(LowResult::borrowed);
        }
        if meta.config_sha256 != config_sha256 {
            bail!(
                "{} was changed after the run began: restore it, or start a new run with --config",
                folder.path().join("config.toml").display()
            );
        }
        if meta.commit != crate::commit::commit() {
            note(format_args!(
                "warning: the run began at commit {}, this is {}: it may not go on exactly as it would have",
                meta.commit,
                crate::commit::commit()
            ));
        }
        let step = newest.checkpoint.as_ref().map_or(0, Checkpoint::step);
        let log = ScalarLog::open(folder.path(), step)
            .with_context(|| format!("cannot write logs into {}", folder.path().display()))?;
        let now = Instant::now();
        Ok(Self {
            folder,
            config,
            store,
            log,
            stop,
            meta,
            checkpoint: newest.checkpoint,
            begun: now,
            saved: now,
            logged_step: step,
        })
    }

    /// Its configuration.
    pub fn config(&self) -> &Config {
        &self.config
    }

    /// The step it continues from; 0 for a new run.
    pub fn resumed_step(&self) -> u64 {
        self.checkpoint.as_ref().map_or(0, Checkpoint::step)
    }

    /// Trains to the end, or until somebody asks to stop.
    ///
    /// # Errors
    /// Files that cannot be written at the end.
    pub fn train(mut self) -> Result<End> {
        let low = match self.meta.low.clone() {
            Some(low) => low,
            None => match self.train_low()? {
                Ok(low) => low,
                Err(end) => return Ok(end),
            },
        };
        self.meta.low = Some(low.clone());
        if self.config.algorithm == Algorithm::Td3 {
            return self.finish(low, None, 0, 0);
        }
        let places = self.places(&self.config.high.families.clone());
        let acting = pack(&low.actor.network()?, Some(&low.normaliser), 1)?;
        let mut stage = HighStage::new(&self.config, places, acting)?;
        let first = low.env_steps;
        match self.drive("high level", &mut stage, first, self.config.high.decisions)? {
            Some(end) => Ok(end),
            None => {
                let (env_steps, updates) = (stage.env_steps(), stage.learner().updates());
                self.finish(low, Some(Weights::of(stage.learner().scorer())), env_steps, updates)
            }
        }
    }

    fn places(&self, families: &[nav_sim::families::Family]) -> Arc<Vec<Place>> {
        let count = u64::from(self.config.worlds_per_family);
        // Runs of different seeds train in different worlds.
        let first = self.config.seed % 1_000_000 * count;
        Arc::new(generate_places(
            families,
            Split::Train,
            first..first + count,
            self.config.task.robot.radius_m,
        ))
    }

    fn train_low(&mut self) -> Result<Result<LowResult, End>> {
        let places = self.places(&self.config.low.families.clone());
        let mut stage = LowStage::new(&self.config, places)?;
        if let Some(end) = self.drive("low level", &mut stage, 0, self.config.low.env_steps)? {
            return Ok(Err(end));
        }
        let normaliser = stage.normaliser().cloned().context("the low level never left its warm-up")?;
        let score = score_low(&self.config, stage.learner().actor(), &normaliser)?;
        note(format_args!("   low level: {score}"));
        Ok(Ok(LowResult {
            actor: Weights::of(stage.learner().actor()),
            normaliser,
            score,
            env_steps: stage.env_steps(),
            updates: stage.learner().updates(),
        }))
    }

    fn seconds(&self) -> f64 {
        self.meta.seconds + self.begun.elapsed().as_secs_f64()
    }

    /// The task with the deviation margin that does best on the choosing worlds.
    fn chosen_task(&self, low: &LowResult, scorer: &Weights) -> Result<Task> {
        let margins = &self.config.high.deviation_margins;
        let mut chosen = self.config.task;
        if margins.is_empty() {
            return Ok(chosen);
        }
        note(format_args!(
            "  validation  choosing among {} deviation margins in {} unseen worlds a family",
            margins.len(),
            self.config.gate.choosing_worlds
        ));
        let places = gate::validation_places(&self.config, Purpose::Choose);
        let mut best = f32::NEG_INFINITY;
        for &deviation_margin in margins {
            let mut task = self.config.task;
            task.decision.deviation_margin = deviation_margin;
            let networks = (&low.actor, &low.normaliser);
            let merit =
                gate::merit(&gate::score_families(&self.config, &task, networks, Some(scorer), &places)?);
            if merit > best {
                (best, chosen) = (merit, task);
            }
        }
        Ok(chosen)
    }

    /// Chooses the deviation margin, judges the run and writes its policy.
    fn finish(self, low: LowResult, scorer: Option<Weights>, env_steps: u64, updates: u64) -> Result<End> {
        let task = match &scorer {
            Some(scorer) => self.chosen_task(&low, scorer)?,
            None => self.config.task,
        };
        note(format_args!("  validation  driving {} other unseen worlds a family", self.config.gate.worlds));
        let places = gate::validation_places(&self.config, Purpose::Judge);
        let networks = (&low.actor, &low.normaliser);
        let flat = gate::score_families(&self.config, &task, networks, None, &places)?;
        let families = match &scorer {
            Some(scorer) => gate::score_families(&self.config, &task, networks, Some(scorer), &places)?,
            None => flat.clone(),
        };
        let missed = gate::missed(&self.config, &low.score.all, &families, scorer.is_some());
        let policy = Policy {
            config_toml: self.config.to_toml(),
            commit: self.meta.commit.clone(),
            task,
            normaliser: low.normaliser.clone(),
            actor: low.actor.clone(),
            scorer,
            gate: GateReport { low: low.score, families, flat, missed },
            env_steps: low.env_steps + env_steps,
            updates: low.updates + updates,
            seconds: self.seconds(),
        };
        self.folder.save_policy(&policy)?;
        Ok(End::Finished(Box::new(policy)))
    }
}
