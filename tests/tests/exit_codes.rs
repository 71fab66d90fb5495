//! Runtime and simulator keep the one convention of exit codes (`nav_host::exit`); the trainer's test is its own.

mod support;

use std::process::Command;
use support::Stage;
use support::programs::{Running, program, run, wait_until};

/// Whether a process has a handler of its own for a signal.
fn catches(id: u32, signal: i32) -> bool {
    let status = std::fs::read_to_string(format!("/proc/{id}/status")).unwrap_or_default();
    let caught = status.lines().find_map(|line| line.strip_prefix("SigCgt:"));
    let mask = caught.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0);
    mask >> (signal - 1) & 1 == 1
}

#[test]
fn each_signal_has_its_code_also_before_anything_was_driven() {
    for name in ["runtime", "simulator"] {
        for signal in [libc::SIGHUP, libc::SIGINT, libc::SIGQUIT, libc::SIGTERM] {
            let stage = Stage::new();
            let waiting = Running::start(name, &stage, &[]);
            wait_until("it listens", || catches(waiting.id(), libc::SIGTERM));
            waiting.signal(signal);
            waiting.end().stopped_by(signal);
        }
    }
}

#[test]
fn a_program_under_nohup_outlives_its_terminal() {
    for name in ["runtime", "simulator"] {
        let stage = Stage::new();
        let direct = program(name, &stage, &[]);
        let mut under_nohup = Command::new("sh");
        under_nohup.args(["-c", "trap '' HUP; exec \"$0\" \"$@\""]);
        under_nohup.arg(direct.get_program()).args(direct.get_args());
        let mut waiting = Running::of(name, under_nohup);
        wait_until("it listens", || catches(waiting.id(), libc::SIGTERM));
        waiting.signal(libc::SIGHUP);
        std::thread::sleep(std::time::Duration::from_millis(300));
        assert!(waiting.is_running(), "{name}");
        waiting.signal(libc::SIGTERM);
        waiting.end().stopped_by(libc::SIGTERM);
    }
}

#[test]
fn a_line_that_makes_no_sense_is_told_from_work_that_cannot_be_done() {
    let stage = Stage::new();
    for name in ["runtime", "simulator"] {
        assert_eq!(run(name, &stage, &["--no-such-option"]).status.code(), Some(2), "{name}");
        assert_eq!(run(name, &stage, &["--robot", "a/b"]).status.code(), Some(1), "{name}");
        assert_eq!(run(name, &stage, &["--help"]).status.code(), Some(0), "{name}");
    }
}
