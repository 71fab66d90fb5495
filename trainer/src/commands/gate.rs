//! `trainer gate`: another verdict on a finished run.

use anyhow::{Result, ensure};
use nav_host::exit::Exit;
use nav_host::terminal::say;
use std::fmt::Write as _;

use super::words;
use crate::cli::GateArgs;
use crate::config::Config;
use crate::train::gate::{Networks, judge};
use crate::train::low_score::score_low;
use crate::train::past::Verdict;
use crate::train::policy::Policy;
use crate::train::run_folder::RunFolder;

/// Judges a finished run anew.
///
/// # Errors
/// No finished run, a configuration that would change more than thresholds, or a gate that was missed.
pub fn gate(args: &GateArgs) -> Result<Exit> {
    let folder = RunFolder::open(&args.run)?;
    let _lock = folder.lock()?;
    let mut policy = folder.policy()?;
    let own = policy.config()?;
    let config = match &args.config {
        Some(path) => own.judged_by(path)?,
        None => own.clone(),
    };
    crate::nn::init_torch();
    // A borrowed low level was scored where it was trained.
    let low = match policy.past.borrowed {
        Some(_) => policy.gate.low.clone(),
        None => score_low(&config, &mut policy.low()?),
    };
    let networks =
        Networks { actor: &policy.actor, normaliser: &policy.normaliser, scorer: policy.scorer.as_ref() };
    let report = judge(&config, &policy.task, &networks, low)?;
    if report != policy.gate {
        let report = std::mem::replace(&mut policy.gate, report);
        policy.past.verdicts.push(Verdict { env_steps: policy.env_steps, report });
        folder.save_policy(&policy)?;
    }
    say(words::reached(&policy, folder.path()));
    say(history(&policy, &own));
    ensure!(policy.gate.is_passed(), words::missed(&policy, folder.path()));
    Ok(Exit::Done)
}

/// Every verdict so far, oldest first.
fn history(policy: &Policy, own: &Config) -> String {
    let present = Verdict { env_steps: policy.env_steps, report: policy.gate.clone() };
    let mut text = "\nverdicts, the newest last:".to_owned();
    for Verdict { env_steps, report } in policy.past.verdicts.iter().chain([&present]) {
        let changes = report.thresholds.changes_from(&own.gate);
        let by = if changes.is_empty() { "the run's own thresholds".to_owned() } else { changes.join(", ") };
        let _ = match report.is_passed() {
            true => write!(text, "\n  {env_steps} steps, {by}: passed"),
            false => write!(text, "\n  {env_steps} steps, {by}: {}", report.sentences()),
        };
    }
    text
}
