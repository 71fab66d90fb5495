//! `trainer evaluate`: policies on shared held-out worlds, through the robot's own controller.
//!
//! | file in `--out` | holds |
//! |---|---|
//! | `plan.json` | what is driven: policies with their hashes, worlds, disturbance, limits |
//! | `episodes.csv` | a row an episode, appended as it ends: world after world, in each the policies in their order |
//! | `table.txt`, `summary.json` | the figures of each policy on each family; there once all is driven |
//! | `LABEL.svg`, `LABEL.png` | the first worlds of each family as pictures |
//! | `collisions/LABEL-FAMILY.svg`, `.png` | the last seconds before the first collisions, moment by moment |
//!
//! Reading order: [`policies`] (what drives), [`scenes`] (where), [`plan`] (both, checked and kept), [`drive`] (rows),
//! [`report`] (figures), [`collisions`] (their last seconds).

pub mod policies;
pub mod scenes;
pub mod plan;
pub mod drive;
pub mod report;
pub mod collisions;

use anyhow::{Context, Result};
use nav_env::summary::summarise;
use nav_host::exit::Exit;
use nav_host::stop::{Second, Stop};
use nav_host::terminal::tell;

use crate::cli::EvaluateArgs;
use plan::Plan;

/// Evaluates, prints the table and writes the reports.
///
/// # Errors
/// Arguments that make no sense, a policy that cannot be driven, or files that cannot be written.
pub fn evaluate(args: &EvaluateArgs) -> Result<Exit> {
    let plan = Plan::check(args)?;
    let stop = Stop::listen(Second::EndsAtOnce).context("cannot listen to signals")?;
    let mut episodes = plan.open(args.resume)?;
    drive::drive(&plan, &mut episodes, args.threads.into(), &stop)?;
    if let Some(signal) = stop.signal() {
        let (driven, all) = (episodes.rows.len(), plan.row_count());
        tell(format_args!(
            "stopped after {driven} of {all} episodes; go on with the same command and --resume"
        ));
        return Ok(Exit::Stopped(signal));
    }
    let summaries = summarise(&episodes.rows);
    report::write(&plan, &summaries)?;
    drive::draw(&plan, args.threads.into()).context("pictures")?;
    collisions::draw(&plan, &episodes.rows, args.threads.into()).context("pictures of collisions")?;
    report::tell(&plan, &summaries);
    Ok(Exit::Done)
}
