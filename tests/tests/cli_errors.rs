//! What is wrong is said in one clear sentence, with a non-zero exit.

mod support;

use nav_core::messages::CmdVel;
use std::fs;
use support::programs::{Running, run, wait_until};
use support::{Stage, fixture, read_json};

fn edit_manifest(stage: &Stage, edit: impl FnOnce(&mut serde_json::Map<String, serde_json::Value>)) {
    let path = stage.model().join("manifest.json");
    let mut manifest = read_json(&path);
    edit(manifest.as_object_mut().expect("an object"));
    fs::write(&path, manifest.to_string()).expect("written");
}

/// Both ways to look at a model refuse it alike.
fn assert_model_refused(stage: &Stage, parts: &[&str]) {
    run("runtime", stage, &["run"]).refused(parts);
    run("runtime", stage, &["check"]).refused(parts);
}

#[test]
fn a_good_model_passes_the_check_and_says_what_was_checked() {
    let stage = Stage::new();
    let ended = run("runtime", &stage, &["check"]).succeeded();
    for part in ["manifest", "observation layout", "task", "td3.onnx: SHA-256", "dqn: ", "golden pairs: 32"] {
        assert!(ended.stdout.contains(part), "{part} in {}", ended.stdout);
    }
}

#[test]
fn a_missing_model() {
    let stage = Stage::new();
    fs::remove_dir_all(stage.model()).expect("removed");
    assert_model_refused(&stage, &["there is no model in", "trainer export"]);
    fs::create_dir(stage.model()).expect("made");
    assert_model_refused(&stage, &["holds no manifest.json"]);
}

#[test]
fn a_damaged_model() {
    let stage = Stage::new();
    let path = stage.model().join("td3.onnx");
    let mut bytes = fs::read(&path).expect("readable");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 0x10;
    fs::write(&path, &bytes).expect("written");
    assert_model_refused(&stage, &["td3.onnx", "damaged or was replaced"]);
    // Even with a manifest that was made to fit.
    fs::write(&path, &bytes[..middle]).expect("written");
    fixture::write_manifest(&stage.model(), &fixture::manifest(&stage.model()));
    assert_model_refused(&stage, &["td3.onnx"]);
    fs::remove_file(&path).expect("removed");
    assert_model_refused(&stage, &["cannot read", "td3.onnx"]);
}

#[test]
fn a_manifest_of_another_layout_or_version() {
    let stage = Stage::new();
    edit_manifest(&stage, |manifest| {
        manifest["observation_layout"] = "another".into();
    });
    assert_model_refused(&stage, &["another observation layout", "train and export one with this version"]);
    let stage = Stage::new();
    edit_manifest(&stage, |manifest| {
        manifest["format"] = 99.into();
    });
    assert_model_refused(&stage, &["format 99"]);
    // An old one has fields that this build does not know, and that is not the point.
    let stage = Stage::new();
    edit_manifest(&stage, |manifest| {
        manifest["format"] = 1.into();
        manifest["task"]["episode_steps"] = 500.into();
    });
    assert_model_refused(&stage, &["format 1", "export the run again"]);
    let stage = Stage::new();
    edit_manifest(&stage, |manifest| {
        manifest.insert("surprise".to_owned(), 1.into());
    });
    assert_model_refused(&stage, &["surprise", "export the model again"]);
    let stage = Stage::new();
    fs::write(stage.model().join("manifest.json"), "{").expect("written");
    assert_model_refused(&stage, &["manifest.json", "damaged or of another version"]);
}

#[test]
fn networks_that_were_swapped() {
    let stage = Stage::new();
    let (td3, dqn) = (stage.model().join("td3.onnx"), stage.model().join("dqn.onnx"));
    let (a, b) = (fs::read(&td3).expect("readable"), fs::read(&dqn).expect("readable"));
    fs::write(&td3, b).expect("written");
    fs::write(&dqn, a).expect("written");
    fixture::write_manifest(&stage.model(), &fixture::manifest(&stage.model()));
    assert_model_refused(&stage, &["td3.onnx", "candidates"]);
}

#[test]
fn a_network_that_no_longer_does_what_it_did() {
    let stage = Stage::new();
    let path = stage.model().join("golden.json");
    let mut golden = read_json(&path);
    golden["td3"][5]["answer"][1] = 0.123.into();
    fs::write(&path, golden.to_string()).expect("written");
    fixture::write_manifest(&stage.model(), &fixture::manifest(&stage.model()));
    assert_model_refused(&stage, &["does not reproduce its golden pair 5"]);
}

#[test]
fn golden_pairs_that_prove_too_little() {
    // Edits the pairs, makes the manifest fit, and asks.
    let with = |edit: fn(&mut serde_json::Value), is_flat: bool, parts: &[&str]| {
        let stage = Stage::new();
        let path = stage.model().join("golden.json");
        let mut golden = read_json(&path);
        edit(&mut golden);
        fs::write(&path, golden.to_string()).expect("written");
        let mut manifest = fixture::manifest(&stage.model());
        if is_flat {
            (manifest.algorithm, manifest.dqn) = (nav_core::manifest::Algorithm::Td3, None);
        }
        fixture::write_manifest(&stage.model(), &manifest);
        if parts.is_empty() {
            run("runtime", &stage, &["check"]).succeeded();
        } else {
            assert_model_refused(&stage, parts);
        }
    };
    let repeat_the_first = |golden: &mut serde_json::Value| golden["dqn"][1] = golden["dqn"][0].clone();
    with(repeat_the_first, false, &["dqn network comes with 31 different golden pairs", "32 are needed"]);
    let cut_one = |golden: &mut serde_json::Value| {
        golden["td3"][7]["answer"].as_array_mut().expect("numbers").pop();
    };
    with(cut_one, false, &["golden pair 7 of the td3 network", "export the model again"]);
    with(|_| (), true, &["no dqn network, but 32 golden pairs"]);
    with(|golden| golden["dqn"] = serde_json::json!([]), true, &[]);
}

#[test]
fn a_report_that_cannot_be_written_is_known_before_driving() {
    let stage = Stage::new();
    for path in [stage.path(""), stage.model().join("td3.onnx").join("report.json")] {
        let path = path.to_str().expect("a plain path");
        run("runtime", &stage, &["run", "--idle-exit", "60", "--report", path]).refused(&["--report", path]);
    }
}

#[test]
fn nobody_reads_what_is_printed() {
    let stage = Stage::new();
    let (driven, simulated) = (stage.path("runtime.json"), stage.path("simulator.json"));
    let path = |path: &std::path::Path| path.to_str().expect("a plain path").to_owned();
    let mut simulator = Running::start(
        "simulator",
        &stage,
        &["--episodes", "2", "--pace", "lockstep", "--report", &path(&simulated)],
    );
    simulator.close_stdout();
    let mut runtime =
        Running::start("runtime", &stage, &["run", "--pace", "scan", "--report", &path(&driven)]);
    runtime.close_stdout();
    runtime.end().succeeded();
    simulator.end().succeeded();
    assert!(read_json(&driven)["ticks"].as_u64() > Some(0));
    assert_eq!(read_json(&simulated)["ended"], "complete");
}

#[test]
fn a_pace_that_would_never_stop_the_robot() {
    let stage = Stage::new();
    run("runtime", &stage, &["run", "--pace", "scan", "--idle-exit", "0"])
        .refused(&["--idle-exit 0 cannot go with --pace scan"]);
}

#[test]
fn no_simulator() {
    let stage = Stage::new();
    run("runtime", &stage, &["run", "--idle-exit", "0.5"])
        .refused(&["no scan arrived within 0.5", "--robot"]);
}

#[test]
fn no_runtime() {
    let stage = Stage::new();
    for pace in ["lockstep", "realtime"] {
        run("simulator", &stage, &["--wait", "0.5", "--pace", pace])
            .refused(&["no runtime answered", "runtime --model"]);
    }
}

#[test]
fn a_runtime_with_another_pace() {
    let stage = Stage::new();
    let _runtime = Running::start("runtime", &stage, &["run", "--pace", "clock"]);
    run("simulator", &stage, &["--pace", "lockstep"]).refused(&["--pace scan"]);
}

#[test]
fn a_second_runtime_and_a_second_simulator_on_the_same_robot() {
    let stage = Stage::new();
    let node = stage.node();
    let command = node.reader::<CmdVel>().expect("a command reader");
    let simulator = Running::start("simulator", &stage, &["--episodes", "50"]);
    let runtime = Running::start("runtime", &stage, &["run"]);
    let mut newest = CmdVel::default();
    wait_until("commands", || command.read_latest(&mut newest).expect("received"));
    run("runtime", &stage, &["run"]).refused(&["already has a writer of `cmd_vel`", "process", "--robot"]);
    run("simulator", &stage, &[]).refused(&["already has a writer of `scan`", "--robot"]);
    // Neither attempt disturbed the first pair.
    let seen = newest.header.seq;
    wait_until("more commands", || {
        command.read_latest(&mut newest).expect("received") && newest.header.seq > seen + 5
    });
    drop((simulator, runtime));
}

#[test]
fn a_bad_robot_name_or_folder() {
    let stage = Stage::new();
    for (name, first) in [("runtime", "run"), ("simulator", "--episodes=1")] {
        run(name, &stage, &[first, "--robot", "a/b"]).refused(&["robot name `a/b`", "letters, digits"]);
    }
    let file = stage.path("file");
    fs::write(&file, "").expect("written");
    let below = file.join("x");
    let path = below.to_str().expect("a plain path");
    let runtime = support::programs::program("runtime", &stage, &["check"]);
    let ended = std::process::Command::new(runtime.get_program())
        .args(["run", "--ipc-root", path, "--model"])
        .arg(stage.model())
        .output()
        .expect("it runs");
    let stderr = String::from_utf8_lossy(&ended.stderr);
    assert_eq!(ended.status.code(), Some(1), "{stderr}");
    assert!(stderr.contains("writable") && stderr.lines().count() == 1, "{stderr}");
}

#[test]
fn a_wrong_map_or_world_file() {
    let stage = Stage::new();
    let map = stage.path("map.yaml");
    let path = map.to_str().expect("a plain path").to_owned();
    let arguments = ["--map", path.as_str(), "--start", "1,1,0", "--goal", "2,2"];
    run("simulator", &stage, &arguments).refused(&["map.yaml"]);
    fs::write(&map, "image: [").expect("written");
    run("simulator", &stage, &arguments).refused(&["map.yaml"]);
    fs::write(&map, "image: gone.pgm\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n")
        .expect("written");
    run("simulator", &stage, &arguments).refused(&["gone.pgm"]);
    let world = stage.path("world.toml");
    fs::write(&world, "name = 3").expect("written");
    let ended = run("simulator", &stage, &["--world-file", world.to_str().expect("a plain path")]);
    assert_eq!(ended.status.code(), Some(1), "{}", ended.stderr);
    // The sentence, then the place in the file as the parser shows it.
    assert!(ended.stderr.contains("world.toml is not a world"), "{}", ended.stderr);
    assert!(ended.stderr.contains("line 1"), "{}", ended.stderr);
}

#[test]
fn a_wrong_command_line_names_the_choices() {
    let stage = Stage::new();
    for arguments in
        [&["--family", "jungle"][..], &["--map", "x.yaml"], &["--episodes", "0"], &["--pace", "fast"]]
    {
        let ended = run("simulator", &stage, arguments);
        assert_eq!(ended.status.code(), Some(2), "{}", ended.stderr);
    }
    let ended = run("simulator", &stage, &["--family", "jungle"]);
    assert!(ended.stderr.contains("clutter") && ended.stderr.contains("maze"), "{}", ended.stderr);
}
