//! `trainer export`: a trained policy as ONNX files, manifest, golden pairs and model card.
//!
//! | file | holds |
//! |---|---|
//! | `td3.onnx` | `observation` [1, 82] to `action` [1, 2], normalisation inside |
//! | `dqn.onnx` | `candidates` [18, 112] to `q` [18, 1]; absent in a flat policy |
//! | `golden.json` | observations and what the trainer's own networks answered |
//! | `README.md` | the model card |
//! | `manifest.json` | task, layout, hashes of the others |
//!
//! The folder is replaced as a whole.

mod golden;
mod manifest;
mod card;
mod story;
mod folder;

use anyhow::{Context, Result, ensure};
use nav_core::manifest::{MANIFEST_FILE, SIGNATURE_FILE};
use nav_host::files::write_atomically;
use nav_host::sha256::sha256_hex;
use nav_host::terminal::debug;
use nav_model::model::{Golden, GoldenPair, Model, actor_contract, scorer_contract};
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

use crate::onnx::{Case, Normalisation, Verified, verify, write_mlp};
use crate::train::policy::Policy;
use folder::replace_folder;
use golden::{golden_pairs, input_of};

/// File name of the low level.
const TD3: &str = "td3.onnx";
/// File name of the high level.
const DQN: &str = "dqn.onnx";
/// File name of the golden pairs.
const GOLDEN: &str = "golden.json";
/// File name of the model card.
const CARD: &str = "README.md";

/// Writes a policy into `folder`, verified in three engines and read back; what was done, for people.
///
/// # Errors
/// A policy that missed its gate, engines that disagree by more than 1e-5, numbers that are not finite, or
/// files that cannot be written.
pub fn export(policy: &Policy, folder: &Path) -> Result<String> {
    ensure!(policy.gate.is_passed(), "it did not pass its gate: {}", policy.gate.sentences());
    let golden = golden_pairs(policy)?;
    let properties = [("commit", policy.commit.as_str()), ("layout", nav_core::observation::LAYOUT)];
    let normalisation = Normalisation {
        mean: &policy.normaliser.mean,
        inverse_deviation: &policy.normaliser.inverse_deviation,
    };
    let td3 = write_mlp(&policy.actor.network()?, &actor_contract(), Some(normalisation), &properties)?;
    let mut text = String::new();
    report(&mut text, TD3, &td3, verify(&td3, &actor_contract(), &cases(&golden.td3, false))?);
    let dqn = match &policy.scorer {
        None => None,
        Some(scorer) => {
            let bytes = write_mlp(&scorer.network()?, &scorer_contract(), None, &properties)?;
            report(&mut text, DQN, &bytes, verify(&bytes, &scorer_contract(), &cases(&golden.dqn, true))?);
            Some(bytes)
        }
    };
    // A signature of the manifest that is replaced is worth nothing under the new one.
    let ours = [TD3, DQN, GOLDEN, CARD, MANIFEST_FILE, SIGNATURE_FILE];
    let mut golden_difference = 0.0;
    replace_folder(folder, &ours, |new| {
        write_folder(policy, new, &td3, dqn.as_deref(), &golden)?;
        let model = Model::read(new).context("what was just written cannot be read back")?;
        golden_difference = model.golden_difference();
        nav_model::check::details(&model).into_iter().for_each(debug);
        Ok(())
    })?;
    let _ = writeln!(
        text,
        "{}: manifest, hashes and {} golden pairs check out (largest difference {:.1e})\n\ndrive with it: runtime --model {0}",
        folder.display(),
        golden.td3.len() + golden.dqn.len(),
        golden_difference
    );
    Ok(text)
}

fn report(text: &mut String, file: &str, bytes: &[u8], verified: Verified) {
    let Verified { executor, tract, onnx_runtime } = verified;
    let _ = writeln!(
        text,
        "{file:<9} {:>7} bytes  largest difference to the trainer: executor {executor:.1e}, tract {tract:.1e}, \
         ONNX Runtime {onnx_runtime:.1e}",
        bytes.len()
    );
}

fn cases(pairs: &[GoldenPair], is_high: bool) -> Vec<Case> {
    let case =
        |pair: &GoldenPair| Case { input: input_of(&pair.observation, is_high), answer: pair.answer.clone() };
    pairs.iter().map(case).collect()
}

fn write_folder(
    policy: &Policy,
    folder: &Path,
    td3: &[u8],
    dqn: Option<&[u8]>,
    golden: &Golden,
) -> Result<()> {
    let golden = serde_json::to_vec(golden)?;
    let write = |name: &str, bytes: &[u8]| {
        let path = folder.join(name);
        write_atomically(&path, |file| file.write_all(bytes))
            .with_context(|| format!("cannot write {}", path.display()))
    };
    write(TD3, td3)?;
    if let Some(bytes) = dqn {
        write(DQN, bytes)?;
    }
    write(GOLDEN, &golden)?;
    write(CARD, card::card(policy)?.as_bytes())?;
    let manifest =
        manifest::manifest(policy, &sha256_hex(td3), dqn.map(sha256_hex).as_deref(), &sha256_hex(&golden))?;
    write(MANIFEST_FILE, &serde_json::to_vec_pretty(&manifest)?)
}
