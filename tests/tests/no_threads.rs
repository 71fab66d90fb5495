//! A machine that gives no more threads (`ulimit -u`, `TasksMax`): each program works without, or says why not. As root, the
//! system knows no such limit: the programs run as users of their own, one for each test.

mod support;

use std::os::unix::fs::{MetadataExt, PermissionsExt, chown};
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::Command;
use support::Stage;
use support::programs::{Running, program, wait_until};

fn give(path: &Path, user: u32) {
    chown(path, Some(user), Some(user)).expect("root may give");
    if path.is_dir() {
        for entry in std::fs::read_dir(path).expect("a folder").flatten() {
            give(&entry.path(), user);
        }
    }
}

/// A program as a user whose processes and threads are so many at most.
fn limited(name: &str, stage: &Stage, arguments: &[&str], user: u32, threads: u64) -> Command {
    let mut command = program(name, stage, arguments);
    command.uid(user).gid(user);
    let limit = libc::rlimit { rlim_cur: threads, rlim_max: threads };
    // SAFETY: takes a limit, between fork and exec.
    unsafe {
        command.pre_exec(move || {
            if libc::setrlimit(libc::RLIMIT_NPROC, &raw const limit) == 0 {
                Ok(())
            } else {
                Err(std::io::Error::last_os_error())
            }
        });
    }
    command
}

/// A stage of a user's; nothing where the programs cannot be run as one.
fn stage_of(user: u32) -> Option<Stage> {
    let stage = Stage::new();
    if std::fs::metadata("/proc/self").expect("this process").uid() != 0 {
        eprintln!("not checked: another user can only be tried as root");
        return None;
    }
    let folder = stage.path("");
    give(&folder, user);
    std::fs::set_permissions(&folder, std::fs::Permissions::from_mode(0o755)).expect("ours");
    let is_reached = program("runtime", &stage, &["check", "--help"]).uid(user).output().is_ok();
    if !is_reached {
        eprintln!("not checked: the programs lie where another user cannot run them");
    }
    is_reached.then_some(stage)
}

#[test]
fn a_runtime_that_cannot_check_its_model_says_so() {
    let Some(stage) = stage_of(64_001) else { return };
    let ended = Running::of("runtime", limited("runtime", &stage, &["run"], 64_001, 1)).end();
    ended.refused(&["no process could be started to read the model in", "ulimit -u"]);
}

#[test]
fn a_simulator_without_a_thread_still_says_what_it_does() {
    let Some(stage) = stage_of(64_002) else { return };
    let ended = Running::of("simulator", limited("simulator", &stage, &["--wait", "0.5"], 64_002, 1)).end();
    ended.refused(&["no runtime answered on robot `robot`"]);
    assert!(ended.stdout.contains("waiting for the runtime"), "{}", ended.stdout);
}

#[test]
fn a_runtime_without_a_thread_for_the_live_line_says_so_and_drives() {
    let Some(stage) = stage_of(64_003) else { return };
    // One more than itself: the child that checks the model, and then the thread that writes to stdout.
    let mut runtime =
        Running::of("runtime", limited("runtime", &stage, &["run", "--pace", "scan"], 64_003, 2));
    wait_until("its topics are open", || stage.ipc_root().join("services").exists() || !runtime.is_running());
    std::thread::sleep(std::time::Duration::from_millis(500));
    let drive = ["--episodes", "1", "--pace", "lockstep"];
    Running::of("simulator", limited("simulator", &stage, &drive, 64_003, 100)).end().succeeded();
    let ended = runtime.end().succeeded();
    assert!(ended.stderr.contains("no thread for the live line"), "{}", ended.stderr);
    assert!(ended.stdout.contains("1 goals"), "{}", ended.stdout);
}
