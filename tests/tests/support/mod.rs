//! What the process tests share: the programs, a small model, a stage of their own.
#![allow(
    dead_code,
    unused_imports,
    unreachable_pub,
    reason = "a module of each test binary, which uses a part"
)]

pub mod fixture;
#[path = "../../../shared/nav-model/tests/support/onnx.rs"]
pub mod onnx;
pub mod programs;
#[path = "../../../shared/nav-model/tests/support/soak.rs"]
pub mod soak;
pub mod stub;

use nav_ipc::{IpcConfig, RobotName, RobotNode};
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// Folders of one test: shared files, a model, and room for reports.
pub struct Stage {
    folder: TempDir,
}

impl Stage {
    /// Apart from every other test, with the fixture's model.
    pub fn new() -> Self {
        // Sockets need a short path, whatever TMPDIR says.
        let folder = tempfile::Builder::new().prefix("nav").tempdir_in("/tmp").expect("a scratch folder");
        let stage = Self { folder };
        fixture::write_model(&stage.model());
        stage
    }

    /// Apart from every other test, with the model that this repository ships.
    pub fn with_shipped_model() -> Self {
        Self::with_copy_of(&shipped())
    }

    /// The same with the model that it ships for a robot.
    pub fn with_shipped_robot(name: &str) -> Self {
        Self::with_copy_of(&shipped().join(name))
    }

    fn with_copy_of(model: &Path) -> Self {
        let stage = Self::new();
        std::fs::remove_dir_all(stage.model()).expect("the fixture is ours");
        std::fs::create_dir(stage.model()).expect("a folder");
        for entry in std::fs::read_dir(model).expect("a shipped model").flatten() {
            if entry.path().is_file() {
                std::fs::copy(entry.path(), stage.model().join(entry.file_name())).expect("copied");
            }
        }
        stage
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn model(&self) -> PathBuf {
        self.path("model")
    }

    pub fn ipc_root(&self) -> PathBuf {
        self.path("ipc")
    }

    /// A node of the test itself among the robot's programs.
    pub fn node(&self) -> RobotNode {
        let config = IpcConfig::in_folder(&self.ipc_root()).expect("a short path");
        RobotNode::open(&RobotName::new("robot").expect("a plain name"), &config).expect("a node")
    }
}

impl Drop for Stage {
    fn drop(&mut self) {
        // Killed programs leave their shared memory behind, and nobody else will come to this stage.
        IpcConfig::in_folder(&self.ipc_root()).expect("a short path").remove_all();
    }
}

/// Where the shipped models are.
fn shipped() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../models")
}

/// Robots, besides the default one, that this repository ships a model for.
pub fn shipped_robots() -> Vec<String> {
    let entries = std::fs::read_dir(shipped()).expect("models/ is there").flatten();
    let mut names: Vec<_> = entries
        .filter(|entry| entry.path().is_dir())
        .map(|entry| entry.file_name().into_string().expect("a plain name"))
        .collect();
    names.sort();
    names
}

/// A JSON file.
pub fn read_json(path: &Path) -> serde_json::Value {
    let text = std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    serde_json::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}
