//! Whatever becomes of the terminal, no training and no evaluation is lost.

mod support;

use std::fs::File;
use std::io::{PipeReader, PipeWriter, Write as _};
use std::os::fd::AsRawFd as _;
use std::path::Path;
use std::process::{Child, Command};
use std::time::{Duration, Instant};
use support::{FEW_WORLDS, TINY, redirected, signal, silent};

/// A pipe that takes nothing more.
fn full_pipe() -> (PipeReader, PipeWriter) {
    let (reader, writer) = std::io::pipe().expect("a pipe");
    let set = |flags: i32| {
        // SAFETY: a descriptor of our own.
        assert_eq!(unsafe { libc::fcntl(writer.as_raw_fd(), libc::F_SETFL, flags) }, 0);
    };
    set(libc::O_NONBLOCK);
    for size in [4096, 1] {
        while (&writer).write(&vec![b'x'; size]).is_ok() {}
    }
    set(0);
    (reader, writer)
}

/// The exit code, which comes soon; else the child is killed.
fn code_soon(mut child: Child) -> Option<i32> {
    let asked = Instant::now();
    while asked.elapsed() < Duration::from_secs(60) {
        if let Some(status) = child.try_wait().expect("our own child") {
            return status.code();
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    child.kill().expect("it runs");
    child.wait().expect("reaped");
    None
}

/// Whether a row of a run's scalars has a loss.
fn has_learned(scalars: &str) -> bool {
    let mut lines = scalars.lines();
    let Some(loss) = lines.next().and_then(|head| head.split(',').position(|name| name == "td3/critic_loss"))
    else {
        return false;
    };
    let is_loss = |value: &str| value.parse().is_ok_and(|loss: f64| loss > 0.0);
    lines.any(|row| row.split(',').nth(loss).is_some_and(is_loss))
}

/// Trains a little with these outputs, hangs up, and expects everything to be saved.
fn trained_and_hung_up(what: &str, start: impl FnOnce(&Path) -> Command) {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("few.toml"), FEW_WORLDS).expect("written");
    let mut child = start(folder.path()).spawn().expect("the trainer starts");
    let scalars = folder.path().join("run/scalars.csv");
    let started = Instant::now();
    // Before the first update, in the warm-up, nothing is saved.
    while !std::fs::read_to_string(&scalars).is_ok_and(|text| has_learned(&text)) {
        assert!(child.try_wait().expect("our own child").is_none(), "{what}: it ended by itself");
        assert!(started.elapsed() < Duration::from_secs(120), "{what}: it trains");
        std::thread::sleep(Duration::from_millis(20));
    }
    signal(&child, libc::SIGHUP);
    assert_eq!(code_soon(child), Some(128 + libc::SIGHUP), "{what}");
    let saved = std::fs::read_dir(folder.path().join("run/checkpoints")).expect("the folder").count();
    assert!(saved > 0, "{what}: nothing was saved");
}

const TRAIN: [&str; 5] = ["train", "--config", "few.toml", "--out", "run"];

#[test]
fn a_training_is_saved_whatever_its_words_are_worth() {
    for outputs in ["2>/dev/full", "2>&-", ">&- 2>&-"] {
        trained_and_hung_up(outputs, |folder| redirected(folder, &TRAIN, outputs));
    }
}

#[test]
fn a_training_is_saved_when_nobody_takes_its_words() {
    let (_reader, writer) = full_pipe();
    trained_and_hung_up("a full pipe", |folder| {
        let mut command = silent(folder, &TRAIN);
        command.stderr(writer);
        command
    });
    let (reader, writer) = std::io::pipe().expect("a pipe");
    drop(reader);
    trained_and_hung_up("a closed pipe", |folder| {
        let mut command = silent(folder, &TRAIN);
        command.stdout(writer.try_clone().expect("a copy")).stderr(writer);
        command
    });
}

#[test]
fn an_evaluation_is_written_whatever_its_words_are_worth() {
    let evaluate = [
        "evaluate",
        "--policy",
        "reactive",
        "--families",
        "clutter",
        "--worlds",
        "2",
        "--pictures",
        "0",
        "--out",
        "ev",
    ];
    let kept = |folder: &Path, what: &str| {
        for file in ["table.txt", "summary.json", "episodes.csv"] {
            let length = std::fs::metadata(folder.join("ev").join(file)).map_or(0, |metadata| metadata.len());
            assert!(length > 0, "{what}: {file} is missing");
        }
    };
    for outputs in ["2>/dev/full >/dev/full", "2>&- >&-", ">/dev/full", "2>/dev/full | true"] {
        let folder = tempfile::tempdir().expect("a folder");
        let mut command = redirected(folder.path(), &evaluate, outputs);
        assert_eq!(command.status().expect("it starts").code(), Some(0), "{outputs}");
        kept(folder.path(), outputs);
    }
    let folder = tempfile::tempdir().expect("a folder");
    let (_reader, writer) = full_pipe();
    let mut command = silent(folder.path(), &evaluate);
    command.stdout(writer.try_clone().expect("a copy")).stderr(writer);
    let child = command.spawn().expect("it starts");
    let started = Instant::now();
    while !folder.path().join("ev/summary.json").exists() {
        assert!(started.elapsed() < Duration::from_secs(120), "it evaluates");
        std::thread::sleep(Duration::from_millis(20));
    }
    signal(&child, libc::SIGTERM);
    // Done or stopped just before the end: it does not hang.
    assert!(matches!(code_soon(child), Some(0 | 143)));
    kept(folder.path(), "a full pipe");
}

#[test]
fn a_model_is_exported_whatever_the_words_are_worth() {
    let folder = tempfile::tempdir().expect("a folder");
    let here = folder.path();
    std::fs::write(here.join("tiny.toml"), TINY).expect("written");
    let train = ["train", "--config", "tiny.toml", "--algorithm", "td3", "--out", "run"];
    assert_eq!(silent(here, &train).status().expect("it starts").code(), Some(0));
    let exported = |out: &str, mut command: Command| {
        assert_eq!(command.status().expect("it starts").code(), Some(0), "{out}");
        let read = nav_model::model::Model::read(&here.join(out));
        read.unwrap_or_else(|error| panic!("{out}: {error}"));
    };
    for (index, outputs) in [">/dev/full 2>/dev/full", "2>/dev/full", ">&- 2>&-", ">&-", "2>/dev/full | true"]
        .into_iter()
        .enumerate()
    {
        let out = format!("model-{index}");
        // What a pipe comes to is what its last program says.
        let outputs = outputs.replace("| true", "| true; test -e \"$5/manifest.json\"");
        exported(&out, redirected(here, &["export", "--run", "run", "--out", &out], &outputs));
    }
    let (reader, writer) = std::io::pipe().expect("a pipe");
    drop(reader);
    let mut closed = silent(here, &["export", "--run", "run", "--out", "closed"]);
    closed.stdout(writer.try_clone().expect("a copy")).stderr(writer);
    exported("closed", closed);
    // A refusal that nobody hears is still one.
    let refused = |outputs| {
        redirected(here, &["export", "--run", "absent"], outputs).status().expect("it starts").code()
    };
    assert_eq!(["2>/dev/full", "2>&-"].map(refused), [Some(1); 2]);
}

#[test]
fn the_manual_page_and_the_completions_know_every_subcommand() {
    let folder = tempfile::tempdir().expect("a folder");
    for (what, parts) in [
        (
            "man",
            [
                "TRAINER TRAIN",
                "TRAINER EXPORT",
                "TRAINER EVALUATE",
                "\\-\\-config",
                "\\-\\-resume",
                "\\-\\-worlds",
            ],
        ),
        ("bash", ["complete -F", "--resume", "--worlds", "--run", "--out", "evaluate"]),
        ("zsh", ["#compdef trainer", "--resume", "--worlds", "--run", "--out", "evaluate"]),
        ("fish", ["complete -c trainer", "resume", "worlds", "run", "out", "evaluate"]),
    ] {
        let file = folder.path().join(what);
        let mut command = silent(folder.path(), &["--print-manual", what]);
        command.stdout(File::create(&file).expect("a file"));
        assert_eq!(command.status().expect("it starts").code(), Some(0), "{what}");
        let text = std::fs::read_to_string(&file).expect("text");
        for part in parts {
            assert!(text.contains(part), "{part} is missing in {what}");
        }
    }
}
