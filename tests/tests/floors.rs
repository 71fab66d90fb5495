//! The floors of the workspace: arrows only go down, and what must be absent is absent.
//!
//! ```text
//! floor 5  tests, xtask
//! floor 4  trainer (tch)      runtime                   simulator (process)
//! floor 3  nav-rivals (classical policies)
//! floor 2  nav-env (episodes, no torch)
//! floor 1  nav-sim            nav-ipc (iceoryx2)        nav-model (tract-onnx)        study (rows to report)
//! floor 0  nav-core (no_std, no alloc, no clock)   nav-host (signals, files, terminal)   nav-picture (SVG, PNG)
//! ```
//! What a crate reaches is what `cargo tree` says of its normal dependencies; what its source names is
//! looked for outside comments and test modules.

#[path = "floors/source.rs"]
mod source;

use source::{assert_absent, code_of, first_system_math, sources};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The floor of each crate. A new crate is added here, and thereby thought about.
const FLOORS: &[(&str, u8)] = &[
    ("nav-core", 0),
    ("nav-host", 0),
    ("nav-picture", 0),
    ("nav-sim", 1),
    ("nav-ipc", 1),
    ("nav-model", 1),
    ("nav-env", 2),
    ("nav-rivals", 3),
    ("study", 1),
    ("trainer", 4),
    ("runtime", 4),
    ("simulator", 4),
    ("hybridnav-tests", 5),
    ("xtask", 5),
];

/// What a crate must never reach through normal dependencies, and which source words it must not use.
const NEVER_REACHED: &[(&str, &[&str])] = &[
    ("nav-core", &["iceoryx2", "tract-onnx", "tch", "rand"]),
    ("nav-sim", &["nav-ipc", "iceoryx2", "tch", "torch-sys", "tract-onnx", "ort"]),
    ("nav-ipc", &["nav-sim", "tch", "torch-sys", "tract-onnx", "ort"]),
    // It checks signatures; who makes them is elsewhere.
    ("nav-model", &["nav-sim", "nav-ipc", "iceoryx2", "tch", "torch-sys", "ort", "minisign"]),
    ("nav-env", &["nav-ipc", "iceoryx2", "tch", "torch-sys", "tract-onnx", "tract-core", "ort", "ort-sys"]),
    ("nav-rivals", &["nav-ipc", "iceoryx2", "nav-model", "tch", "torch-sys", "tract-onnx", "ort", "ort-sys"]),
    // It judges rows and drives nothing.
    (
        "study",
        &["nav-core", "nav-sim", "nav-env", "nav-ipc", "nav-model", "tch", "torch-sys", "tract-onnx", "ort"],
    ),
    ("trainer", &["runtime", "nav-ipc", "iceoryx2"]),
    ("runtime", &["trainer", "tch", "torch-sys", "nav-sim", "nav-env", "nav-rivals", "ort", "ort-sys"]),
    ("simulator", &["trainer", "runtime", "tch", "torch-sys", "tract-onnx", "tract-core", "ort", "ort-sys"]),
];

fn workspace() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("tests/ lies in the workspace").to_path_buf()
}

/// What cargo prints for these arguments.
fn cargo(args: &[&str]) -> String {
    let output = Command::new(env!("CARGO"))
        .current_dir(workspace())
        .args(args)
        .output()
        .expect("cargo built this test, so it can be started");
    assert!(output.status.success(), "cargo {args:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("cargo prints UTF-8")
}

/// Names of the packages a package reaches through the given kinds of dependency, itself left out.
fn reached(package: &str, kinds: &str) -> BTreeSet<String> {
    let lines = cargo(&["tree", "--locked", "-p", package, "-e", kinds, "--prefix", "none", "-f", "{p}"]);
    let names: BTreeSet<String> = lines
        .lines()
        .filter_map(|line| line.split_whitespace().next())
        .filter(|name| *name != package)
        .map(str::to_owned)
        .collect();
    assert!(package == "nav-core" || !names.is_empty(), "cargo tree lists nothing for {package}");
    names
}

/// Each crate of the workspace with the crates of the workspace it names as normal or build dependency.
fn arrows() -> BTreeMap<String, Vec<String>> {
    let metadata: serde_json::Value =
        serde_json::from_str(&cargo(&["metadata", "--locked", "--no-deps", "--format-version", "1"]))
            .expect("cargo metadata prints JSON");
    let packages = metadata["packages"].as_array().expect("metadata lists packages");
    let name = |value: &serde_json::Value| value["name"].as_str().expect("a name is a string").to_owned();
    let ours: BTreeSet<String> = packages.iter().map(name).collect();
    packages
        .iter()
        .map(|package| {
            let wanted = package["dependencies"].as_array().expect("metadata lists dependencies");
            let wanted = wanted.iter().filter(|wanted| wanted["kind"] != "dev").map(name);
            (name(package), wanted.filter(|name| ours.contains(name)).collect())
        })
        .collect()
}

#[test]
fn arrows_only_go_down() {
    let floors: BTreeMap<&str, u8> = FLOORS.iter().copied().collect();
    let arrows = arrows();
    let known: BTreeSet<&str> = floors.keys().copied().collect();
    let found: BTreeSet<&str> = arrows.keys().map(String::as_str).collect();
    assert_eq!(known, found, "every crate of the workspace has a floor in this test");
    for (from, targets) in &arrows {
        for to in targets {
            let is_down = floors[to.as_str()] < floors[from.as_str()];
            assert!(is_down, "{from} depends on {to}, which is not below it");
        }
    }
}

#[test]
fn what_must_not_be_reached_is_not() {
    for &(package, never) in NEVER_REACHED {
        let reached = reached(package, "normal");
        for name in never {
            assert!(
                !reached.contains(*name),
                "{package} reaches {name}: see `cargo tree -p {package} -i {name}`"
            );
        }
    }
}

/// `cargo build` and `cargo test` without `-p` or `--workspace` work on a machine without libtorch.
#[test]
fn default_members_need_no_libtorch() {
    let tree = cargo(&["tree", "--locked", "-e", "normal,build,dev", "--prefix", "none", "-f", "{p}"]);
    assert!(tree.contains("iceoryx2"), "the default members were expected to hold the runtime");
    assert!(!tree.contains("torch-sys"), "a default member reaches torch-sys");
}

#[test]
fn nav_core_turns_on_no_std_feature() {
    let tree =
        cargo(&["tree", "--locked", "-p", "nav-core", "-e", "normal", "--prefix", "none", "-f", "{p}|{f}"]);
    for line in tree.lines() {
        let (package, features) = line.split_once('|').expect("the format has a bar");
        // A package that was listed before ends in ` (*)`.
        let features = features.trim_end_matches(" (*)");
        // Procedural macros and build scripts run on the building machine.
        if package.contains("(proc-macro)") || HOST_ONLY.iter().any(|host| package.starts_with(host)) {
            continue;
        }
        for feature in features.split(',') {
            let wants_std = matches!(feature, "std" | "alloc" | "use-std");
            assert!(!wants_std, "nav-core turns on `{feature}` of {package}");
        }
    }
}

/// Packages that serve procedural macros only: they never reach the target.
const HOST_ONLY: [&str; 4] = ["proc-macro2 ", "quote ", "syn ", "unicode-ident "];

#[test]
fn nav_core_is_no_std_and_names_nothing_of_std() {
    let sources = sources("shared/nav-core/src");
    let root =
        fs::read_to_string(workspace().join("shared/nav-core/src/lib.rs")).expect("nav-core has a lib.rs");
    assert!(root.lines().any(|line| line.trim() == "#![no_std]"), "nav-core/src/lib.rs lacks #![no_std]");
    assert_absent(&sources, &["std", "alloc"]);
}

#[test]
fn nav_core_and_nav_sim_never_read_a_clock() {
    for folder in ["shared/nav-core/src", "shared/nav-sim/src"] {
        assert_absent(&sources(folder), &["Instant", "SystemTime", "std::time", "clock_gettime"]);
    }
}

/// Where the same seed must give the same bits on every machine.
const SAME_BITS: [&str; 4] =
    ["shared/nav-core/src", "shared/nav-sim/src", "shared/nav-env/src", "shared/nav-rivals/src"];

/// The same of other crates: rotations of nalgebra and distributions call the system's.
const SYSTEM_MATH_IN_CRATES: [&str; 3] = ["Rotation2", "UnitComplex", "rand_distr"];

#[test]
fn what_must_give_the_same_bits_asks_no_c_library() {
    for folder in SAME_BITS {
        let sources = sources(folder);
        assert_absent(&sources, &SYSTEM_MATH_IN_CRATES);
        for (path, text) in &sources {
            let found = first_system_math(&code_of(text));
            assert_eq!(found, None, "{} asks the system's C library in that line: use libm", path.display());
        }
    }
}

/// Builds nav-core for every installed target that has no operating system.
#[test]
fn nav_core_builds_without_an_operating_system() {
    let sysroot = Command::new("rustc").args(["--print", "sysroot"]).output().expect("rustc is installed");
    let sysroot = String::from_utf8(sysroot.stdout).expect("a path in UTF-8");
    let installed =
        fs::read_dir(Path::new(sysroot.trim()).join("lib/rustlib")).expect("a sysroot has rustlib");
    let bare: Vec<String> = installed
        .flatten()
        .map(|entry| entry.file_name().to_string_lossy().into_owned())
        .filter(|name| name.contains("-none"))
        .collect();
    if bare.is_empty() {
        eprintln!(
            "no bare-metal target is installed (rustup target add thumbv7em-none-eabihf): not built for one"
        );
    }
    for target in bare {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("bare");
        let folder = folder.to_str().expect("a path in UTF-8");
        cargo(&[
            "build",
            "--locked",
            "--release",
            "-p",
            "nav-core",
            "--target",
            &target,
            "--target-dir",
            folder,
        ]);
    }
}

/// A file of one idea is read at a sitting.
#[test]
fn no_source_is_longer_than_320_lines() {
    for (package, _) in FLOORS.iter().filter(|(package, _)| *package != "hybridnav-tests") {
        let shared = format!("shared/{package}/src");
        let folder = if workspace().join(&shared).is_dir() { shared } else { format!("{package}/src") };
        for (path, text) in sources(&folder) {
            let lines = text.lines().count();
            assert!(lines <= 320, "{} has {lines} lines: it holds more than one idea", path.display());
        }
    }
}
