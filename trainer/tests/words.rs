//! How much the trainer says (`--log`), and that it works on a machine that gives it no other thread.

use std::os::unix::fs::{MetadataExt, chown};
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Command, Output, Stdio};

const MODEL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../models");

fn trainer(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_trainer"));
    command.current_dir(folder).args(arguments);
    command
}

fn run(mut command: Command) -> (Output, String) {
    let output = command.output().expect("the trainer starts");
    let text =
        String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    (output, text)
}

const EVALUATE: [&str; 8] =
    ["evaluate", "--model", MODEL, "--worlds", "1", "--families", "clutter", "--pictures=0"];

#[test]
fn an_evaluation_says_more_with_debug() {
    for (level, is_debug) in [("error", false), ("info", false), ("debug", true)] {
        let folder = tempfile::tempdir().expect("a folder");
        let (output, text) = run(trainer(folder.path(), &[&EVALUATE[..], &["--log", level]].concat()));
        assert!(output.status.success(), "{text}");
        assert!(text.contains("table, rows, figures and pictures are in"), "the result: {text}");
        assert_eq!(text.contains("hybrid: clutter, seed 0: "), is_debug, "{text}");
    }
}

#[test]
fn a_training_run_says_more_with_each_level() {
    for (rank, level) in ["error", "warn", "info", "debug"].into_iter().enumerate() {
        let folder = tempfile::tempdir().expect("a folder");
        let config = "worlds_per_family = 4\n[low]\nenvs = 4\n";
        std::fs::write(folder.path().join("few.toml"), config).expect("written");
        let mut command = trainer(folder.path(), &["train", "--config", "few.toml", "--out", "run"]);
        command.args(["--log", level]).stderr(Stdio::piped());
        let mut child = command.spawn().expect("the trainer starts");
        // Made after the trainer has begun to listen to signals.
        while !folder.path().join("run/config.toml").exists() {
            assert!(child.try_wait().expect("our own child").is_none(), "it ended by itself");
            std::thread::sleep(std::time::Duration::from_millis(5));
        }
        std::thread::sleep(std::time::Duration::from_secs(3));
        let process = i32::try_from(child.id()).expect("a process id");
        // SAFETY: the process is our own child and was not waited for.
        assert_eq!(unsafe { libc::kill(process, libc::SIGTERM) }, 0, "it runs");
        let output = child.wait_with_output().expect("it ends");
        let text = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(128 + libc::SIGTERM), "{text}");
        assert!(text.contains("continue with: trainer train --resume"), "the result: {text}");
        assert_eq!(text.contains("training hybrid (profile quick"), rank >= 2, "{level}: {text}");
        assert_eq!(text.contains("steps/s"), rank >= 2, "{level}: {text}");
        assert_eq!(text.contains("worlds_per_family = 4"), rank >= 3, "{level}: {text}");
    }
}

#[test]
fn an_error_is_said_at_every_level_and_by_every_subcommand() {
    let folder = tempfile::tempdir().expect("a folder");
    for subcommand in [&["train", "--resume"][..], &["export"], &["evaluate", "--model", "nowhere"]] {
        for level in ["error", "warn", "info", "debug"] {
            let (output, text) = run(trainer(folder.path(), &[&["--log", level][..], subcommand].concat()));
            assert_eq!(output.status.code(), Some(1), "{text}");
            assert!(text.contains("trainer: "), "{subcommand:?} with {level}: {text}");
        }
    }
}

/// The same rows as with threads. As root the system knows no such limit, so that another user is taken.
#[test]
fn an_evaluation_without_threads_drives_the_same() {
    const USER: u32 = 64_004;
    if std::fs::metadata("/proc/self").expect("this process").uid() != 0 {
        eprintln!("not checked: another user can only be tried as root");
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    chown(folder.path(), Some(USER), Some(USER)).expect("root may give");
    if trainer(folder.path(), &["--version"]).uid(USER).output().is_err() {
        eprintln!("not checked: the trainer lies where another user cannot run it");
        return;
    }
    let evaluate = |out: &str| trainer(folder.path(), &[&EVALUATE[..], &["--out", out]].concat());
    let mut limited = evaluate("without");
    limited.uid(USER).gid(USER);
    let limit = libc::rlimit { rlim_cur: 1, rlim_max: 1 };
    // SAFETY: takes a limit, between fork and exec.
    unsafe {
        limited.pre_exec(move || {
            if libc::setrlimit(libc::RLIMIT_NPROC, &raw const limit) == 0 {
                Ok(())
            } else {
                Err(std::io::Error::last_os_error())
            }
        });
    }
    let (output, text) = run(limited);
    assert!(output.status.success(), "{text}");
    assert!(text.contains("table, rows"), "it says so itself: {text}");
    let (output, text) = run(evaluate("with"));
    assert!(output.status.success(), "{text}");
    let rows = |out: &str| {
        let rows = std::fs::read_to_string(folder.path().join(out).join("episodes.csv")).expect("rows");
        // The last columns say how long it took.
        rows.lines().map(|row| row.split(',').take(18).collect::<Vec<_>>().join(",")).collect::<Vec<_>>()
    };
    assert_eq!(rows("without"), rows("with"));
}
