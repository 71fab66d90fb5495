//! How the trainer ends: the one convention of exit codes (`nav_host::exit`), also when nobody reads what it says.

mod support;

use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;
use support::{FEW_WORLDS, signal, silent};

fn code(command: &mut Command) -> Option<i32> {
    command.status().expect("the trainer starts").code()
}

/// A training run that listens to signals, with these outputs.
fn training(folder: &Path, stderr: Stdio) -> Child {
    std::fs::write(folder.join("few.toml"), FEW_WORLDS).expect("written");
    let arguments = ["train", "--config", "few.toml", "--out", "run"];
    let mut child = silent(folder, &arguments).stderr(stderr).spawn().expect("the trainer starts");
    // The folder is made after the trainer has begun to listen.
    while !folder.join("run/config.toml").exists() {
        assert!(child.try_wait().expect("our own child").is_none(), "it ended by itself");
        std::thread::sleep(Duration::from_millis(5));
    }
    child
}

#[test]
fn each_signal_has_its_code() {
    for number in [libc::SIGHUP, libc::SIGINT, libc::SIGQUIT, libc::SIGTERM] {
        let folder = tempfile::tempdir().expect("a folder");
        let mut child = training(folder.path(), Stdio::null());
        signal(&child, number);
        assert_eq!(child.wait().expect("reaped").code(), Some(128 + number));
    }
}

#[test]
fn a_line_that_makes_no_sense_is_told_from_work_that_cannot_be_done() {
    let folder = tempfile::tempdir().expect("a folder");
    assert_eq!(code(&mut silent(folder.path(), &["fly"])), Some(2));
    assert_eq!(code(&mut silent(folder.path(), &["export"])), Some(1));
    assert_eq!(code(&mut silent(folder.path(), &["--help"])), Some(0));
}

#[test]
fn nobody_reads_what_is_printed() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut printing = silent(folder.path(), &["train", "--print-config"]);
    let mut child = printing.stdout(Stdio::piped()).spawn().expect("the trainer starts");
    drop(child.stdout.take());
    assert_eq!(child.wait().expect("reaped").code(), Some(0), "results to a closed pipe");

    let mut child = training(folder.path(), Stdio::piped());
    drop(child.stderr.take());
    signal(&child, libc::SIGTERM);
    assert_eq!(child.wait().expect("reaped").code(), Some(128 + libc::SIGTERM), "progress to a closed pipe");
}
