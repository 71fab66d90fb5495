//! What the programs say of a machine that is not theirs alone: full shared memory, another user's folder.

mod support;

use std::os::unix::fs::{MetadataExt, chown};
use std::process::Command;
use support::Stage;
use support::programs::{Running, program, run};
use support::soak::count;

/// The program with `/dev/shm` of so many KiB; nothing where the machine does not let us mount one.
fn in_shared_memory_of(kib: u32, program: &Command) -> Option<Command> {
    let script = format!("mount -t tmpfs -o size={kib}k tmpfs /dev/shm && exec \"$0\" \"$@\"");
    let unshare = ["--mount", "--propagation", "private", "sh", "-c"];
    let is_allowed = Command::new("unshare")
        .args(unshare)
        .arg("mount -t tmpfs tmpfs /dev/shm")
        .output()
        .is_ok_and(|output| output.status.success());
    if !is_allowed {
        eprintln!("not checked: this machine does not let us mount a small /dev/shm");
        return None;
    }
    let mut command = Command::new("unshare");
    command.args(unshare).arg(script).arg(program.get_program()).args(program.get_args());
    Some(command)
}

#[test]
fn full_shared_memory_is_a_sentence() {
    for (name, arguments) in [("runtime", &["run"][..]), ("simulator", &["--family", "clutter"][..])] {
        for kib in [8, 32, 64, 100] {
            let stage = Stage::new();
            let Some(command) = in_shared_memory_of(kib, &program(name, &stage, arguments)) else { return };
            let ended = Running::of(name, command).end();
            count(&[("programs in a full /dev/shm", 1)]);
            ended.refused(&["shared memory is full: ", "KiB are needed under /dev/shm"]);
        }
    }
}

#[test]
fn a_folder_of_another_user_is_a_sentence() {
    let stage = Stage::new();
    std::fs::create_dir(stage.ipc_root()).expect("a folder");
    if std::fs::metadata("/proc/self").expect("this process").uid() != 0 {
        eprintln!("not checked: another user can only be tried as root");
        return;
    }
    chown(stage.ipc_root(), Some(65534), Some(65534)).expect("given away");
    for (name, arguments) in [("runtime", &["run"][..]), ("simulator", &["--family", "clutter"][..])] {
        run(name, &stage, arguments)
            .refused(&["belongs to user 65534", "run all programs of a robot as the same user"]);
    }
}
