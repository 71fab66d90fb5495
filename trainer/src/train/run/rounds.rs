//! The rounds of a stage, with what goes on beside them: logs, checkpoints, the user's wish to stop, and the way back
//! from a divergence.

use anyhow::{Context, Result};
use nav_host::terminal::warn;
use std::time::{Duration, Instant};

use super::{End, Meta, Run};
use crate::checkpoint::{Checkpoint, Contents};
use crate::logs::{Progress, ScalarLog};
use crate::train::curve::Curve;
use crate::train::learners::Learners;
use crate::train::plan::{Learns, StagePlan};
use crate::train::stage::{STAGE, Stage};

/// Time between two checkpoints.
const CHECKPOINT_PERIOD: Duration = Duration::from_secs(60);
/// Environment steps between two rows of scalars.
const LOG_STEPS: u64 = 5_000;
/// Factor on the learning rates after a divergence.
const ROLL_BACK_FACTOR: f32 = 0.3;

/// A row of scalars, for people.
fn row(step: u64, scalars: &[(&str, f64)]) -> String {
    let scalars: Vec<_> = scalars.iter().map(|(name, value)| format!("{name} {value:.4}")).collect();
    format!("step {step}: {}", scalars.join(", "))
}

impl Run {
    /// Rounds until the stage has finished (`None`), has failed, or somebody asks to stop.
    ///
    /// From a checkpoint of this stage, from which the learners were restored, or from its first step.
    pub(super) fn drive(
        &mut self,
        plan: &StagePlan,
        stage: &mut dyn Stage,
        learners: &mut Learners,
        checkpoint: Option<Checkpoint>,
    ) -> Result<Option<End>> {
        match checkpoint {
            Some(checkpoint) => stage.restore_from(&checkpoint, learners)?,
            // What the stages before have learned is kept from now on.
            None if stage.can_save(learners) => {
                if let Err(error) = self.save(stage, learners) {
                    warn(format_args!("warning: {error:#}; training goes on"));
                }
            }
            None => {}
        }
        let mut progress = Progress::new(plan.name, plan.budget);
        let mut point = self.point(plan, stage, learners);
        while !stage.is_finished() {
            if let Err(error) = stage.round(learners)
                && let Some(failed) = self.roll_back(plan, stage, learners, &error)?
            {
                progress.finish();
                return Ok(Some(failed));
            }
            let reached = self.point(plan, stage, learners);
            if reached > point
                && let Err(error) = self.draw(plan, stage, learners)
            {
                progress.warn(&format!("warning: {error:#}; training goes on"));
            }
            point = reached;
            progress.update(stage.status(learners));
            let collapse = stage.collapse(learners);
            let step = self.step(stage, learners);
            // At the same steps whether or not the run was interrupted.
            if step / LOG_STEPS > self.logged_step / LOG_STEPS || collapse.is_some() {
                self.logged_step = step;
                let scalars = stage.scalars(learners);
                progress.debug(&row(step, &scalars));
                if let Err(error) = self.log.write(step, &scalars) {
                    progress.warn(&format!("warning: scalars were not written ({error}); training goes on"));
                }
            }
            if let Some(reason) = collapse {
                progress.finish();
                return Ok(Some(End::Failed(reason)));
            }
            let stopping = self.stop.signal();
            let due = stopping.is_some() || self.saved.elapsed() > CHECKPOINT_PERIOD;
            let mut is_saved = false;
            if stage.can_save(learners) && due {
                match self.save(stage, learners) {
                    Ok(()) => {
                        is_saved = true;
                        progress.debug(&format!("checkpoint of step {step} is saved"));
                    }
                    Err(error) => progress.warn(&format!("warning: {error:#}")),
                }
            }
            if let Some(signal) = stopping {
                progress.finish();
                return Ok(Some(End::Stopped { signal, is_saved }));
            }
        }
        progress.finish();
        Ok(None)
    }

    /// The last point of the learning curve in this stage.
    fn point(&self, plan: &StagePlan, stage: &dyn Stage, learners: &Learners) -> Option<u64> {
        let curve = self.curve.as_ref()?;
        Some(curve.point(stage.status(learners).position, plan.budget))
    }

    /// Draws a point of the learning curve, which costs no training time.
    fn draw(&mut self, plan: &StagePlan, stage: &dyn Stage, learners: &Learners) -> Result<()> {
        let step = self.step(stage, learners);
        let Some(curve) = &mut self.curve else { return Ok(()) };
        let begun = Instant::now();
        let drawn = curve.draw(&self.config, step, plan.learns == Learns::High, learners);
        self.begun += begun.elapsed();
        drawn
    }

    /// Environment steps of the run so far.
    fn step(&self, stage: &dyn Stage, learners: &Learners) -> u64 {
        self.meta.steps_before + stage.status(learners).steps
    }

    fn save(&mut self, stage: &dyn Stage, learners: &Learners) -> Result<()> {
        self.save_at(self.step(stage, learners), Some(stage), learners)
    }

    /// Saves what was learned after the last stage: `--more` goes on from there.
    pub(super) fn save_end(&mut self, learners: &Learners) -> Result<()> {
        self.save_at(self.meta.steps_before, None, learners)
    }

    fn save_at(&mut self, step: u64, stage: Option<&dyn Stage>, learners: &Learners) -> Result<()> {
        self.saved = Instant::now();
        let meta = Meta { seconds: self.seconds(), ..self.meta.clone() };
        let mut contents = Contents::new();
        contents.value("meta", &meta)?;
        learners.add_to(&mut contents)?;
        if let Some(stage) = stage {
            stage.add_to(&mut contents)?;
        }
        self.store.save(step, &contents)?;
        Ok(())
    }

    /// Goes back to the newest checkpoint of this stage with lower learning rates; once. The second time the run has
    /// failed.
    fn roll_back(
        &mut self,
        plan: &StagePlan,
        stage: &mut dyn Stage,
        learners: &mut Learners,
        error: &anyhow::Error,
    ) -> Result<Option<End>> {
        let checkpoint = self.store.load_newest_valid().checkpoint;
        let usable = checkpoint.filter(|checkpoint| {
            let meta = checkpoint.value::<Meta>("meta");
            let is_of_stage = meta.is_ok_and(|meta| meta.stage == self.meta.stage);
            !self.meta.rolled_back && is_of_stage && checkpoint.has(STAGE)
        });
        let Some(mut checkpoint) = usable else { return Ok(Some(End::Failed(format!("{error:#}")))) };
        warn(format_args!(
            "warning: {error:#}; going back to {} with learning rates times {ROLL_BACK_FACTOR}",
            checkpoint.path().display()
        ));
        learners.restore_from(&mut checkpoint)?;
        stage.restore_from(&checkpoint, learners)?;
        learners.slow_down(plan.learns, ROLL_BACK_FACTOR);
        self.meta.rolled_back = true;
        self.logged_step = checkpoint.step();
        self.log =
            ScalarLog::open(self.folder.path(), checkpoint.step()).context("cannot reopen the logs")?;
        self.curve = Curve::open(&self.config, self.folder.path(), checkpoint.step())?;
        Ok(None)
    }
}
