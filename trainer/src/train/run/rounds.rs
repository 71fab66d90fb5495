//! The rounds of a stage, with what goes on beside them: logs, checkpoints, the user's wish to stop, and the way back
//! from a divergence.

use anyhow::{Context, Result};
use nav_host::terminal::note;
use std::time::{Duration, Instant};

use super::{End, Meta, Run};
use crate::checkpoint::Contents;
use crate::logs::{Progress, ScalarLog};
use crate::train::stage::Stage;

/// Time between two checkpoints.
const CHECKPOINT_PERIOD: Duration = Duration::from_secs(60);
/// Environment steps between two rows of scalars.
const LOG_STEPS: u64 = 5_000;
/// Factor on the learning rates after a divergence.
const ROLL_BACK_FACTOR: f32 = 0.3;

impl Run {
    /// Rounds until the stage has finished (`None`), has failed, or somebody asks to stop. Steps of the log count from
    /// `first`.
    pub(super) fn drive(
        &mut self,
        name: &str,
        stage: &mut impl Stage,
        first: u64,
        total: u64,
    ) -> Result<Option<End>> {
        match self.checkpoint.take() {
            Some(mut checkpoint) => stage.restore_from(&mut checkpoint)?,
            // What the stage before has learned is kept from now on.
            None if stage.can_save() => {
                if let Err(error) = self.save(stage, first) {
                    note(format_args!("warning: {error:#}; training goes on"));
                }
            }
            None => {}
        }
        let mut progress = Progress::new(name, total);
        while !stage.is_finished() {
            if let Err(error) = stage.round()
                && let Some(failed) = self.roll_back(stage, &error)?
            {
                progress.finish();
                return Ok(Some(failed));
            }
            let status = stage.status();
            progress.update(status);
            let step = first + status.steps;
            if step >= self.logged_step + LOG_STEPS {
                self.logged_step = step;
                if let Err(error) = self.log.write(step, &stage.scalars()) {
                    progress.note(&format!("warning: scalars were not written ({error}); training goes on"));
                }
            }
            let stopping = self.stop.signal();
            let due = stopping.is_some() || self.saved.elapsed() > CHECKPOINT_PERIOD;
            let mut is_saved = false;
            if stage.can_save() && due {
                match self.save(stage, step) {
                    Ok(()) => is_saved = true,
                    Err(error) => progress.note(&format!("warning: {error:#}")),
                }
            }
            if let Some(reason) = stage.collapse() {
                progress.finish();
                return Ok(Some(End::Failed(reason)));
            }
            if let Some(signal) = stopping {
                progress.finish();
                return Ok(Some(End::Stopped { signal, is_saved }));
            }
        }
        progress.finish();
        Ok(None)
    }

    fn save(&mut self, stage: &impl Stage, step: u64) -> Result<()> {
        self.saved = Instant::now();
        let meta = Meta { seconds: self.seconds(), ..self.meta.clone() };
        let mut contents = Contents::new();
        contents.value("meta", &meta)?;
        stage.add_to(&mut contents)?;
        self.store.save(step, &contents)?;
        Ok(())
    }

    /// Goes back to the newest checkpoint with lower learning rates; once. The second time the run has failed.
    fn roll_back(&mut self, stage: &mut impl Stage, error: &anyhow::Error) -> Result<Option<End>> {
        let checkpoint = self.store.load_newest_valid().checkpoint;
        let usable = checkpoint.filter(|checkpoint| {
            let meta = checkpoint.value::<Meta>("meta");
            !self.meta.rolled_back && meta.is_ok_and(|meta| meta.low.is_some() == self.meta.low.is_some())
        });
        let Some(mut checkpoint) = usable else { return Ok(Some(End::Failed(format!("{error:#}")))) };
        note(format_args!(
            "warning: {error:#}; going back to {} with learning rates times {ROLL_BACK_FACTOR}",
            checkpoint.path().display()
        ));
        stage.restore_from(&mut checkpoint)?;
        stage.slow_down(ROLL_BACK_FACTOR);
        self.meta.rolled_back = true;
        self.logged_step = checkpoint.step();
        self.log =
            ScalarLog::open(self.folder.path(), checkpoint.step()).context("cannot reopen the logs")?;
        Ok(None)
    }
}
