//! A model without training: a low level that steers towards its target and away from near things, and a high
//! level whose weights are random and fixed. It drives, it decides, and it is the same on every run.

use super::onnx::{Attribute, Dim, Graph, Message, numbers, tensor};
use nav_core::manifest::{Algorithm, FileEntry, GOLDEN_PAIRS_MIN, MANIFEST_FILE, MANIFEST_FORMAT, Manifest};
use nav_core::observation::{
    CANDIDATE_FEATURES, HIGH_OBSERVATION, LAYOUT, LOW_ACTION, LOW_OBSERVATION, expand_candidates,
};
use nav_core::scan::SECTOR_COUNT;
use nav_core::task::{ACTION_COUNT, Task};
use nav_model::load::{NetworkContract, load_network, read_file};
use nav_model::model::{Golden, GoldenPair, actor_contract, scorer_contract};
use std::fs;
use std::path::Path;

const HIDDEN: usize = 16;

/// Writes manifest, networks and golden pairs into a folder.
pub fn write_model(folder: &Path) {
    fs::create_dir_all(folder).expect("a folder");
    let dims = [LOW_ACTION as i64, LOW_OBSERVATION as i64];
    let (actor, scorer) = (actor(|graph| graph.floats("w", &dims, &actor_weights())), scorer());
    fs::write(folder.join("td3.onnx"), &actor).expect("written");
    fs::write(folder.join("dqn.onnx"), &scorer).expect("written");
    let golden = Golden {
        td3: pairs(&actor, &actor_contract(), LOW_OBSERVATION, <[f32]>::to_vec),
        dqn: pairs(&scorer, &scorer_contract(), HIGH_OBSERVATION, |observation| {
            let mut rows = vec![0.0; ACTION_COUNT * CANDIDATE_FEATURES];
            expand_candidates(observation, &mut rows);
            rows
        }),
    };
    fs::write(folder.join("golden.json"), serde_json::to_string(&golden).expect("JSON")).expect("written");
    write_manifest(folder, &manifest(folder));
}

/// A manifest for the files that lie in a folder now.
pub fn manifest(folder: &Path) -> Manifest {
    let text = |text: &str| text.try_into().expect("a short text");
    let entry = |file: &str| entry(folder, file);
    Manifest {
        format: MANIFEST_FORMAT,
        algorithm: Algorithm::Hybrid,
        trainer_version: text("0.0.0"),
        trainer_commit: text("unknown"),
        seed: 0,
        profile: text("fixture"),
        robot: None,
        config_sha256: "0".repeat(64).as_str().try_into().expect("64 digits"),
        observation_layout: LAYOUT.try_into().expect("it fits"),
        observation_lengths: Manifest::LENGTHS,
        action_count: ACTION_COUNT,
        units: text("SI"),
        frames: text("odom, robot: x forward, counter-clockwise positive"),
        decision_rule: text("masked argmax"),
        normalisation: text("none"),
        task: Task::default(),
        training_families: std::iter::empty().collect(),
        td3: entry("td3.onnx"),
        dqn: Some(entry("dqn.onnx")),
        golden: entry("golden.json"),
        data: std::iter::empty().collect(),
        evaluation: std::iter::empty().collect(),
    }
}

/// A file of a folder with its hash.
pub fn entry(folder: &Path, file: &str) -> FileEntry {
    let sha256 = read_file(&folder.join(file), 1 << 24).expect("readable").sha256;
    FileEntry {
        file: file.try_into().expect("a short text"),
        sha256: sha256.as_str().try_into().expect("64 digits"),
    }
}

/// Moves the weights of the low level into a file of their own, which the manifest does not yet list.
pub fn keep_weights_apart(folder: &Path) {
    let weights = actor_weights();
    let raw: Vec<u8> = weights.iter().flat_map(|weight| weight.to_le_bytes()).collect();
    fs::write(folder.join("td3.onnx.data"), raw).expect("written");
    let location = Message::default().text(1, "location").text(2, "td3.onnx.data");
    let dims = [LOW_ACTION as i64, LOW_OBSERVATION as i64];
    let apart = tensor("w", &dims, 1).message(13, &location).int(14, 1);
    fs::write(folder.join("td3.onnx"), actor(|graph| graph.tensor(apart))).expect("written");
    write_manifest(folder, &manifest(folder));
}

/// Puts a manifest into a folder.
pub fn write_manifest(folder: &Path, manifest: &Manifest) {
    let text = serde_json::to_string_pretty(manifest).expect("JSON");
    fs::write(folder.join(MANIFEST_FILE), text).expect("written");
}

/// Of the actor. Sector 18 of 36 lies straight ahead, larger ones to the left.
fn actor_weights() -> Vec<f32> {
    let mut weights = vec![0.0; LOW_ACTION * LOW_OBSERVATION];
    let ahead = SECTOR_COUNT / 2;
    let (sine, cosine) = (2 * SECTOR_COUNT + 2, 2 * SECTOR_COUNT + 3);
    for weight in &mut weights[ahead - 3..=ahead + 3] {
        *weight = 0.6;
    }
    weights[cosine] = 1.2;
    for offset in 1..=8 {
        weights[LOW_OBSERVATION + ahead + offset] = 0.35;
        weights[LOW_OBSERVATION + ahead - offset] = -0.35;
    }
    weights[LOW_OBSERVATION + sine] = 1.8;
    weights
}

/// tanh of a linear map, whose weights `add` adds.
fn actor(add: impl FnOnce(Graph) -> Graph) -> Vec<u8> {
    let (inputs, outputs) = (LOW_OBSERVATION as i64, LOW_ACTION as i64);
    add(Graph::default().input("observation", &[Dim::Fixed(1), Dim::Fixed(inputs)]))
        .floats("b", &[outputs], &[-2.6, 0.0])
        .node("Gemm", &["observation", "w", "b"], "linear", &[Attribute::Int("transB", 1)])
        .node("Tanh", &["linear"], "action", &[])
        .output("action", &[Dim::Fixed(1), Dim::Fixed(outputs)])
        .finish()
}

fn scorer() -> Vec<u8> {
    let (rows, columns, hidden) = (ACTION_COUNT as i64, CANDIDATE_FEATURES as i64, HIDDEN as i64);
    Graph::default()
        .input("candidates", &[Dim::Fixed(rows), Dim::Fixed(columns)])
        .floats("w1", &[hidden, columns], &numbers(11, HIDDEN * CANDIDATE_FEATURES))
        .floats("b1", &[hidden], &numbers(12, HIDDEN))
        .floats("w2", &[1, hidden], &numbers(13, HIDDEN))
        .floats("b2", &[1], &[0.0])
        .node("Gemm", &["candidates", "w1", "b1"], "h", &[Attribute::Int("transB", 1)])
        .node("Relu", &["h"], "r", &[])
        .node("Gemm", &["r", "w2", "b2"], "q", &[Attribute::Int("transB", 1)])
        .output("q", &[Dim::Fixed(rows), Dim::Fixed(1)])
        .finish()
}

fn pairs(
    onnx: &[u8],
    contract: &NetworkContract,
    observation_len: usize,
    input_of: impl Fn(&[f32]) -> Vec<f32>,
) -> Vec<GoldenPair> {
    let mut network = load_network(onnx, contract).expect("the fixture loads").into_network();
    (0..GOLDEN_PAIRS_MIN as u64)
        .map(|seed| {
            let observation = numbers(100 + seed, observation_len);
            let mut answer = vec![0.0; network.output_len()];
            network.run(&input_of(&observation), &mut answer);
            GoldenPair { observation, answer }
        })
        .collect()
}
