//! The manifest of an export.

use anyhow::{Context, Result};
use heapless::{String, Vec};
use nav_core::manifest::{Algorithm, EvaluationRow, FileEntry, MANIFEST_FORMAT, Manifest};
use nav_core::observation::LAYOUT;
use nav_core::task::ACTION_COUNT;
use nav_host::sha256::sha256_hex;

use super::{DQN, GOLDEN, TD3};
use crate::train::policy::Policy;

/// The manifest of a policy whose files have these SHA-256.
///
/// # Errors
/// A text that is too long for its place.
pub(super) fn manifest(policy: &Policy, td3: &str, dqn: Option<&str>, golden: &str) -> Result<Manifest> {
    let config = policy.config()?;
    let families = if policy.scorer.is_some() { &config.high.families } else { &config.low.families };
    let mut training_families = Vec::new();
    for family in families {
        training_families.push(text(family.id())?).ok().context("too many training families")?;
    }
    let mut evaluation = Vec::new();
    for score in &policy.gate.families {
        let row = EvaluationRow {
            family: text(score.family.id())?,
            worlds: score.worlds as u32,
            success: score.success(),
            collision: score.collision(),
            timeout: score.timeout(),
        };
        evaluation.push(row).ok().context("too many families")?;
    }
    Ok(Manifest {
        format: MANIFEST_FORMAT,
        algorithm: if dqn.is_some() { Algorithm::Hybrid } else { Algorithm::Td3 },
        trainer_version: text(env!("CARGO_PKG_VERSION"))?,
        trainer_commit: text(&policy.commit)?,
        seed: config.seed,
        profile: text(&config.profile.to_string())?,
        robot: config.robot.as_deref().map(text).transpose()?,
        config_sha256: text(&sha256_hex(policy.config_toml.as_bytes()))?,
        observation_layout: text(LAYOUT)?,
        observation_lengths: Manifest::LENGTHS,
        action_count: ACTION_COUNT,
        units: text("m, s, rad, m/s, rad/s; counter-clockwise positive, x forward")?,
        frames: text(
            "goal and subgoals in odom; observation in the robot frame, scan in that of task.lidar.mount",
        )?,
        decision_rule: text("highest legal value; GOAL unless beaten by more than deviation_margin")?,
        normalisation: text("td3: inside the graph; dqn: features are scaled by the encoder")?,
        task: policy.task,
        training_families,
        td3: entry(TD3, td3)?,
        dqn: dqn.map(|hash| entry(DQN, hash)).transpose()?,
        golden: entry(GOLDEN, golden)?,
        data: Vec::new(),
        evaluation,
    })
}

fn entry(file: &str, sha256: &str) -> Result<FileEntry> {
    Ok(FileEntry { file: text(file)?, sha256: text(sha256)? })
}

fn text<const N: usize>(value: &str) -> Result<String<N>> {
    String::try_from(value).ok().with_context(|| format!("`{value}` is too long for the manifest"))
}
