//! A run from its first step to its gate, interrupted and resumed as often as need be.

mod rounds;

use anyhow::{Context, Result, bail};
use nav_core::task::Task;
use nav_host::stop::{Signal, Stop};
use nav_host::terminal::{note, warn};
use serde::{Deserialize, Serialize};
use std::time::Instant;

use super::curve::Curve;
use super::gate::{self, Networks, Purpose};
use super::going_on;
use super::learners::Learners;
use super::low_score::{LowReport, score_low};
use super::past::{Past, Verdict};
use super::plan::{self, Learns};
use super::policy::{Policy, Weights};
use super::run_folder::RunFolder;
use super::stage::STAGE;
use crate::acting::pack;
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

/// What a checkpoint says besides the states of learners and stage.
#[derive(Clone, Serialize, Deserialize)]
struct Meta {
    /// The commit that the run began with.
    commit: String,
    config_sha256: String,
    /// Which stage it is in, from 0.
    stage: usize,
    /// Environment steps of the stages before.
    steps_before: u64,
    /// The low level, scored after the newest stage that trained it.
    low_score: Option<LowReport>,
    seconds: f64,
    rolled_back: bool,
}

/// A run under way.
pub struct Run {
    folder: RunFolder,
    config: Config,
    store: CheckpointStore,
    log: ScalarLog,
    curve: Option<Curve>,
    stop: Stop,
    meta: Meta,
    /// The policy whose low level is used, if none is trained.
    borrowed: Option<Policy>,
    /// The policy that it had before it was trained on.
    before: Option<Policy>,
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
            warn(format_args!("warning: {error:#}"));
        }
        let fresh = Meta {
            commit: crate::commit::commit(),
            config_sha256: config_sha256.clone(),
            stage: 0,
            steps_before: 0,
            low_score: None,
            seconds: 0.0,
            rolled_back: false,
        };
        let mut meta = match &newest.checkpoint {
            Some(checkpoint) => checkpoint.value::<Meta>("meta")?,
            None => fresh,
        };
        let borrowed = folder.borrowed_low()?;
        let before = folder.policy_before_more()?;
        if let Some(before) = &before {
            // The checkpoint of its end is from before it was judged.
            meta.seconds = meta.seconds.max(before.seconds);
        }
        if meta.config_sha256 != config_sha256 {
            bail!(
                "{} was changed after the run began: restore it, or start a new run with --config",
                folder.path().join("config.toml").display()
            );
        }
        if meta.commit != crate::commit::commit() {
            warn(format_args!(
                "warning: the run began at commit {}, this is {}: it may not go on exactly as it would have",
                meta.commit,
                crate::commit::commit()
            ));
        }
        let step = newest.checkpoint.as_ref().map_or(0, Checkpoint::step);
        let log = ScalarLog::open(folder.path(), step)
            .with_context(|| format!("cannot write logs into {}", folder.path().display()))?;
        let curve = Curve::open(&config, folder.path(), step)?;
        let now = Instant::now();
        Ok(Self {
            folder,
            config,
            store,
            log,
            curve,
            stop,
            meta,
            borrowed,
            before,
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
        let stages = plan::stages(&self.config, self.borrowed.is_some(), &self.folder.more()?);
        let mut learners = Learners::new(&self.config, self.borrowed.as_ref())?;
        if let Some(policy) = &self.borrowed {
            self.meta.low_score = Some(policy.gate.low.clone());
        }
        let mut checkpoint = self.checkpoint.take();
        if let Some(checkpoint) = &mut checkpoint {
            learners.restore_from(checkpoint)?;
        }
        let mut restored = checkpoint.filter(|checkpoint| checkpoint.has(STAGE));
        while let Some(plan) = stages.get(self.meta.stage) {
            let mut stage = plan.begin(&self.config);
            learners.rest(&stages[self.meta.stage..]);
            let restored = restored.take();
            if plan.goes_on && plan.learns == Learns::Low && restored.is_none() {
                learners.low.wake()?;
            }
            if let Some(end) = self.drive(plan, stage.as_mut(), &mut learners, restored)? {
                return Ok(end);
            }
            self.meta.stage += 1;
            self.meta.steps_before += stage.status(&learners).steps;
            if plan.learns == Learns::Low {
                let low = &learners.low;
                let score = score_low(&self.config, &mut pack(low.learner().actor(), low.normaliser(), 1)?);
                note(format_args!("   {}: {score}", plan.name));
                self.meta.low_score = Some(score);
            }
        }
        if let Err(error) = self.save_end(&learners) {
            warn(format_args!("warning: {error:#}; --more will have to drive the last minute again"));
        }
        self.finish(&learners)
    }

    fn seconds(&self) -> f64 {
        self.meta.seconds + self.begun.elapsed().as_secs_f64()
    }

    /// The task with the deviation margin that does best on the choosing worlds.
    fn chosen_task(&self, networks: &Networks<'_>) -> Result<Task> {
        let margins = &self.config.high.deviation_margins;
        let mut chosen = self.config.task;
        if networks.scorer.is_none() || margins.is_empty() {
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
            let merit = gate::merit(&gate::score_families(&self.config, &task, networks, &places)?);
            if merit > best {
                (best, chosen) = (merit, task);
            }
        }
        Ok(chosen)
    }

    /// What lies behind its policy.
    fn past(&self) -> Result<Past> {
        let mut verdicts = Vec::new();
        if let Some(Policy { past, gate, env_steps, .. }) = &self.before {
            verdicts.extend(past.verdicts.iter().cloned());
            verdicts.push(Verdict { env_steps: *env_steps, report: gate.clone() });
        }
        Ok(Past {
            borrowed: self.borrowed.as_ref().map(going_on::borrowed).transpose()?,
            attempts: self.folder.attempts()?,
            more: self.folder.more()?,
            verdicts,
        })
    }

    /// Chooses the deviation margin, judges the run and writes its policy.
    fn finish(mut self, learners: &Learners) -> Result<End> {
        let low = self.meta.low_score.clone().context("the low level was never scored: this is a defect")?;
        let normaliser = learners.low.normaliser().context("the low level never left its warm-up")?;
        let (actor, scorer) = (Weights::of(learners.low.learner().actor()), learners.scorer());
        let networks = Networks { actor: &actor, normaliser, scorer: scorer.as_ref() };
        let task = self.chosen_task(&networks)?;
        let gate = gate::judge(&self.config, &task, &networks, low)?;
        let past = self.past()?;
        let policy = Policy {
            config_toml: self.config.to_toml(),
            commit: self.meta.commit.clone(),
            task,
            normaliser: normaliser.clone(),
            actor,
            scorer,
            gate,
            past,
            env_steps: self.meta.steps_before,
            updates: learners.updates(),
            seconds: self.seconds(),
        };
        let scalars = policy.gate.scalars(&policy.task);
        let scalars: Vec<_> = scalars.iter().map(|(name, value)| (name.as_str(), *value)).collect();
        if let Err(error) = self.log.write(policy.env_steps, &scalars) {
            warn(format_args!("warning: the gate's figures were not written into the logs ({error})"));
        }
        self.folder.save_policy(&policy)?;
        Ok(End::Finished(Box::new(policy)))
    }
}
