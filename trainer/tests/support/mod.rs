//! What the process tests of the trainer share: the program, and runs of seconds.
#![allow(dead_code, unreachable_pub, reason = "a module of each test binary, which uses a part")]

#[path = "../../../shared/nav-model/tests/support/soak.rs"]
pub mod soak;

use std::path::Path;
use std::process::{Child, Command, Stdio};

/// Worlds that are made in a moment.
pub const FEW_WORLDS: &str = "worlds_per_family = 4\n[low]\nenvs = 4\n";

/// A run of seconds whose gate anything passes.
pub const TINY: &str = "
worlds_per_family = 4
[low]
envs = 4
env_steps = 3000
warmup_steps = 500
batch = 32
families = ['clutter', 'u_trap']
td3.hidden = [16]
[high]
envs = 4
decisions = 1500
warmup_decisions = 100
batch = 32
families = ['clutter', 'u_trap']
dqn.hidden = [16]
deviation_margins = [0.0, 0.5]
[gate]
low_reach = 0.0
low_collision = 1.0
spin = 1.0
worlds = 2
clutter_success = 0.0
u_trap_success = 0.0
choosing_worlds = 2
static_collision = 1.0
people_collision_beyond_reactive = 1.0
";

/// The trainer in a folder.
pub fn trainer(folder: &Path, arguments: &[&str]) -> Command {
    placed(Command::new(env!("CARGO_BIN_EXE_trainer")), folder, arguments)
}

/// The same with nobody who writes to it or reads from it.
pub fn silent(folder: &Path, arguments: &[&str]) -> Command {
    silenced(trainer(folder, arguments))
}

/// The same in a shell that redirects its outputs.
pub fn redirected(folder: &Path, arguments: &[&str], outputs: &str) -> Command {
    let mut shell = Command::new("sh");
    // A pipe has no process of its own to become.
    let exec = if outputs.contains('|') { "" } else { "exec " };
    shell.args(["-c", &format!("{exec}\"$0\" \"$@\" {outputs}"), env!("CARGO_BIN_EXE_trainer")]);
    silenced(placed(shell, folder, arguments))
}

fn placed(mut command: Command, folder: &Path, arguments: &[&str]) -> Command {
    command.current_dir(folder).args(arguments);
    // The library lies in the checkout, the test runs elsewhere.
    let library = Path::new(env!("CARGO_MANIFEST_DIR")).join("../.tools/onnxruntime/libonnxruntime.so");
    if std::env::var_os("ORT_DYLIB_PATH").is_none_or(|path| !Path::new(&path).is_absolute()) {
        command.env("ORT_DYLIB_PATH", library);
    }
    command
}

fn silenced(mut command: Command) -> Command {
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    command
}

/// Signals a child that was not waited for.
pub fn signal(child: &Child, signal: i32) {
    let process = i32::try_from(child.id()).expect("a process id");
    // SAFETY: the process is our own child and was not waited for.
    assert_eq!(unsafe { libc::kill(process, signal) }, 0, "it runs");
}
