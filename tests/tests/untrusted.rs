//! Model folders from elsewhere: what they leave out, ask for too much of, or are in another shape.

mod support;

use minisign::KeyPair;
use nav_core::manifest::Manifest;
use nav_model::model::Model;
use serde_json::Value;
use std::fs;
use std::io::Cursor;
use std::os::unix::fs::symlink;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use support::programs::run;
use support::{Stage, fixture, read_json};

/// Paths to every field of an object and of those within it.
fn fields(value: &Value, path: &str, into: &mut Vec<String>) {
    let Value::Object(object) = value else { return };
    for (name, value) in object {
        let path = format!("{path}/{name}");
        fields(value, &path, into);
        into.push(path);
    }
}

#[test]
fn a_manifest_that_leaves_out_any_field_is_refused() {
    let stage = Stage::new();
    let path = stage.model().join("manifest.json");
    let whole = read_json(&path);
    let mut all = Vec::new();
    fields(&whole, "", &mut all);
    assert!(all.len() > 40 && all.iter().any(|field| field == "/task/lidar/beam_count"), "{all:?}");
    for field in all {
        let (parent, name) = field.rsplit_once('/').expect("a path");
        let mut manifest = whole.clone();
        let object = manifest.pointer_mut(parent).and_then(Value::as_object_mut).expect("an object");
        object.remove(name);
        fs::write(&path, manifest.to_string()).expect("written");
        let error = Model::read(&stage.model()).err().map(|error| error.to_string());
        // A shape is no field: without it nothing can be read.
        let told = if field.ends_with("/footprint/circle") { "damaged or of another version" } else { name };
        assert!(error.as_ref().is_some_and(|error| error.contains(told)), "without {field}: {error:?}");
    }
    let mut empty = whole.clone();
    empty["task"] = serde_json::json!({});
    fs::write(&path, empty.to_string()).expect("written");
    run("runtime", &stage, &["check"]).refused(&["does not say `task.", "export the model again"]);
}

#[test]
fn the_owner_of_the_robot_has_the_last_word() {
    let stage = Stage::new();
    let limits = stage.path("robot.toml");
    let file = limits.to_str().expect("a plain path");
    fs::write(&limits, "[robot]\nlinear_max_mps = 0.5\n").expect("written");
    let words = ["linear_max_mps = 1,", "allows 0.5 at most"];
    run("runtime", &stage, &["check", "--limits", file]).refused(&words);
    run("runtime", &stage, &["run", "--limits", file, "--idle-exit", "1"]).refused(&words);
    run("runtime", &stage, &["bench", "--loop", "--limits", file]).refused(&words);
    fs::write(&limits, "[robot]\nlinear_max_mps = 1.0\nfootprint = { circle = { radius_m = 0.2 } }\n")
        .expect("written");
    run("runtime", &stage, &["check", "--limits", file]).succeeded();
}

/// Signs the stage's manifest as it is now.
fn sign(stage: &Stage, pair: &KeyPair) {
    let manifest = stage.model().join("manifest.json");
    let bytes = fs::read(&manifest).expect("a manifest");
    let signature = minisign::sign(Some(&pair.pk), &pair.sk, Cursor::new(bytes), None, None).expect("signed");
    fs::write(stage.model().join("manifest.json.minisig"), signature.to_string()).expect("written");
}

/// In every subcommand that takes a model, and before anything of it is believed.
#[test]
fn only_models_that_the_owner_signed_are_accepted_where_a_key_is_required() {
    let stage = Stage::new();
    let pair = || KeyPair::generate_unencrypted_keypair().expect("a key pair");
    let (owner, other) = (pair(), pair());
    let (key, public) = (owner.pk.to_base64(), stage.path("owner.pub"));
    fs::write(&public, owner.pk.to_box().expect("a box").to_string()).expect("written");
    let file = public.to_str().expect("a plain path");
    let runtime = |arguments: &[&str], key: &str| {
        run("runtime", &stage, &[arguments, &["--require-signature", key]].concat())
    };
    let check = |key: &str| runtime(&["check"], key);
    let drive = |key: &str| runtime(&["run", "--idle-exit", "0.2"], key);
    let bench = ["bench", "--loop", "--seconds", "0.2"];
    for ended in [check(&key), drive(file), runtime(&["bench"], &key), runtime(&bench, file)] {
        ended.refused(&["not signed", "manifest.json.minisig", "minisign -S -m manifest.json"]);
    }
    sign(&stage, &owner);
    assert!(check(&key).succeeded().stdout.contains("ok  signature"));
    drive(&key).refused(&["no scan"]);
    runtime(&bench, file).succeeded();
    check(&other.pk.to_base64()).refused(&["another key"]);
    for wrong in ["owner.pub", "/dev/zero", "RWQf"] {
        check(wrong).refused(&["no minisign public key", wrong]);
    }
    // A changed file is one that the signed manifest does not speak of.
    let td3 = fs::read(stage.model().join("td3.onnx")).expect("a network");
    fs::write(stage.model().join("td3.onnx"), "nothing").expect("written");
    check(&key).refused(&["SHA-256"]);
    fs::write(stage.model().join("td3.onnx"), td3).expect("written");
    // Not yet parsed: what a stranger wrote into it is not even looked at.
    let manifest = stage.model().join("manifest.json");
    let text = fs::read_to_string(&manifest).expect("a manifest");
    for changed in [text.replace("\"radius_m\": 0.2", "\"radius_m\": 0.1"), "[".repeat(100_000)] {
        assert_ne!(changed, text);
        fs::write(&manifest, changed).expect("written");
        check(&key).refused(&["is not a signature of the manifest beside it"]);
        drive(file).refused(&["is not a signature of the manifest beside it"]);
    }
    sign(&stage, &other);
    check(&key).refused(&["another key"]);
}

#[test]
fn a_check_can_be_read_by_programs() {
    let stage = Stage::new();
    let json = |stage: &Stage| -> Value {
        let ended = run("runtime", stage, &["check", "--json"]);
        serde_json::from_str(&ended.stdout).unwrap_or_else(|error| panic!("{error}: {}", ended.stdout))
    };
    let fine = json(&stage);
    assert_eq!(
        (&fine["accepted"], &fine["manifest"]["task"]["lidar"]["beam_count"]),
        (&true.into(), &72.into())
    );
    fs::write(stage.model().join("td3.onnx"), "nothing").expect("written");
    let refused = json(&stage);
    assert_eq!(refused["accepted"], false);
    assert!(refused["reason"].as_str().is_some_and(|reason| reason.contains("SHA-256")), "{refused}");
}

#[test]
fn a_bare_network_is_told_from_a_model() {
    let stage = Stage::new();
    fs::copy(stage.model().join("td3.onnx"), stage.path("td3.onnx")).expect("copied");
    let bare = stage.path("td3.onnx");
    fs::remove_dir_all(stage.model()).expect("removed");
    fs::rename(bare, stage.model()).expect("renamed");
    run("runtime", &stage, &["check"]).refused(&["it is a file", "`trainer export` writes one"]);
}

/// As container orchestrators mount a folder: each file a link to one in a folder that a link leads to.
#[test]
fn a_folder_of_links_is_a_model() {
    let stage = Stage::new();
    let (model, data) = (stage.model(), stage.model().join("..2026_11"));
    fs::create_dir(&data).expect("made");
    symlink("..2026_11", model.join("..data")).expect("linked");
    for name in ["manifest.json", "td3.onnx", "dqn.onnx", "golden.json"] {
        fs::rename(model.join(name), data.join(name)).expect("moved");
        symlink(format!("..data/{name}"), model.join(name)).expect("linked");
    }
    run("runtime", &stage, &["check"]).succeeded();
    // A link to elsewhere is still none of the model's.
    fs::copy(data.join("td3.onnx"), stage.path("td3.onnx")).expect("copied");
    fs::remove_file(model.join("td3.onnx")).expect("removed");
    symlink(stage.path("td3.onnx"), model.join("td3.onnx")).expect("linked");
    run("runtime", &stage, &["check"]).refused(&["symbolic link to elsewhere"]);
}

/// As exporters write large models: the weights in a file of their own, which the manifest vouches for.
#[test]
fn weights_in_a_file_of_their_own_are_read_where_the_manifest_vouches_for_it() {
    let stage = Stage::new();
    let (model, weights) = (stage.model(), stage.model().join("td3.onnx.data"));
    fixture::keep_weights_apart(&model);
    run("runtime", &stage, &["check"]).refused(&["td3.onnx.data", "the manifest does not list"]);
    let mut manifest = fixture::manifest(&model);
    manifest.data = std::iter::once(fixture::entry(&model, "td3.onnx.data")).collect();
    fixture::write_manifest(&model, &manifest);
    assert!(run("runtime", &stage, &["check"]).succeeded().stdout.contains("ok  td3.onnx.data: SHA-256"));
    let bytes = fs::read(&weights).expect("weights");
    fs::write(&weights, [bytes.as_slice(), &[0]].concat()).expect("written");
    run("runtime", &stage, &["check"]).refused(&["td3.onnx.data", "its SHA-256 is"]);
    fs::remove_file(&weights).expect("removed");
    run("runtime", &stage, &["check"]).refused(&["td3.onnx.data"]);
    fs::write(stage.path("elsewhere"), &bytes).expect("written");
    symlink(stage.path("elsewhere"), &weights).expect("linked");
    run("runtime", &stage, &["check"]).refused(&["td3.onnx.data", "symbolic link to elsewhere"]);
    let mut entry = fixture::entry(&stage.path(""), "elsewhere");
    entry.file = "../elsewhere".try_into().expect("a short text");
    manifest.data = std::iter::once(entry).collect();
    fixture::write_manifest(&model, &manifest);
    run("runtime", &stage, &["check"]).refused(&["not a plain name"]);
}

fn copy_folder(from: &Path, to: &Path) {
    fs::create_dir(to).expect("made");
    for entry in fs::read_dir(from).expect("a folder").flatten() {
        fs::copy(entry.path(), to.join(entry.file_name())).expect("copied");
    }
}

/// A model that is replaced while it is read, as an export does it, is one of the two and never half of each.
#[test]
fn a_model_that_is_replaced_while_it_is_read_is_one_or_the_other() {
    let stage = Stage::new();
    let (current, first, other) = (stage.path("current"), stage.model(), stage.path("other"));
    fixture::write_model(&other);
    let golden = fs::read(other.join("golden.json")).expect("golden pairs");
    fs::write(other.join("golden.json"), [golden.as_slice(), b" "].concat()).expect("written");
    let manifest = Manifest { seed: 1, ..fixture::manifest(&other) };
    fixture::write_manifest(&other, &manifest);
    symlink(&first, &current).expect("linked");
    let is_over = AtomicBool::new(false);
    let seeds: Vec<u64> = std::thread::scope(|scope| {
        scope.spawn(|| {
            // Each time a new folder, as exports make them; the one before is removed.
            let mut old = None;
            for turn in 0.. {
                let (new, next) = (stage.path(&format!("model-{turn}")), stage.path("next"));
                copy_folder(if turn % 2 == 0 { &other } else { &first }, &new);
                symlink(&new, &next).expect("linked");
                fs::rename(&next, &current).expect("replaced");
                if let Some(old) = old.replace(new) {
                    fs::remove_dir_all(old).expect("removed");
                }
                // Rarely enough for whole readings in between.
                std::thread::sleep(Duration::from_millis(30));
                if is_over.load(Ordering::Relaxed) {
                    return;
                }
            }
        });
        let read = |_| Model::read(&current).map(|model| model.manifest().seed);
        let seeds: Result<_, _> = (0..400).map(read).collect();
        is_over.store(true, Ordering::Relaxed);
        seeds.unwrap_or_else(|error| panic!("{error}"))
    });
    assert!(seeds.contains(&0) && seeds.contains(&1), "it was replaced: {seeds:?}");
}
