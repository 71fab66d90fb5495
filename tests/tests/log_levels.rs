//! `--log LEVEL` means something in every program and subcommand: results and errors always, the rest as asked for. The
//! trainer's test is its own.

mod support;

use std::time::Duration;
use support::Stage;
use support::programs::{Ended, Running, run};

const LEVELS: [&str; 4] = ["error", "warn", "info", "debug"];

/// Two short episodes in lock-step, both programs at a level.
fn drive(level: &str) -> [Ended; 2] {
    let stage = Stage::new();
    let runtime =
        Running::start("runtime", &stage, &["run", "--pace", "scan", "--core", "9999", "--log", level]);
    let simulator =
        run("simulator", &stage, &["--episodes", "2", "--pace", "lockstep", "--log", level]).succeeded();
    [runtime.end().succeeded(), simulator]
}

/// Whether each of these parts is there or missing, as told.
fn assert_says(level: &str, ended: &Ended, parts: &[(&str, bool)]) {
    for (part, is_said) in parts {
        let text = format!("{}{}", ended.stdout, ended.stderr);
        assert_eq!(text.contains(part), *is_said, "`{part}` with --log {level}:\n{text}");
    }
}

#[test]
fn a_drive_says_more_with_each_level() {
    for (rank, level) in LEVELS.into_iter().enumerate() {
        let [runtime, simulator] = drive(level);
        let from = |least: usize| rank >= least;
        assert_says(
            level,
            &runtime,
            &[
                ("ended: whoever published the scans has left", true),
                ("the loop is not bound to core 9999", from(1)),
                ("topics of robot `robot` are open", from(2)),
                ("model ", from(2)),
                ("td3: ", from(3)),
                ("1 EinSum", from(3)),
                ("first scan: 72 beams from", from(3)),
                ("first odometry: ", from(3)),
                ("goal 2: at ", from(3)),
                ("tick 1: decided (Start): action", from(3)),
                ("the loop may run on cores [", from(3)),
            ],
        );
        assert_says(
            level,
            &simulator,
            &[
                ("2 episodes", true),
                ("waiting for the runtime", from(2)),
                ("clutter/test/1  ", from(2)),
                ("the runtime is there", from(3)),
                ("a scan of 72 beams over 360 degrees", from(3)),
                ("clutter/test/1, seed 1: from", from(3)),
            ],
        );
    }
}

#[test]
fn faults_are_told_from_warn_on() {
    for (level, is_said) in [("error", false), ("warn", true), ("info", true)] {
        let stage = Stage::new();
        let runtime = Running::start("runtime", &stage, &["run", "--log", level, "--goal-heartbeat", "0.3"]);
        let simulator = Running::start("simulator", &stage, &["--family", "clutter", "--episodes", "50"]);
        std::thread::sleep(Duration::from_secs(2));
        simulator.signal(libc::SIGSTOP);
        std::thread::sleep(Duration::from_secs(3));
        runtime.signal(libc::SIGTERM);
        let ended = runtime.end().stopped_by(libc::SIGTERM);
        drop(simulator);
        assert!(ended.stdout.contains("ended: "), "the report is said at every level");
        assert_eq!(ended.stderr.contains("runtime: "), is_said, "{level}: {}", ended.stderr);
        assert_eq!(ended.stdout.contains(" Hz "), level == "info", "the live line: {}", ended.stdout);
    }
}

#[test]
fn errors_are_said_at_every_level_and_by_every_subcommand() {
    for level in LEVELS {
        let stage = Stage::new();
        for arguments in [&["check"][..], &["bench"], &["run"]] {
            let arguments = [arguments, &["--model", "/nowhere", "--log", level]].concat();
            run("runtime", &stage, &arguments).refused(&["/nowhere"]);
        }
        run("simulator", &stage, &["--world-file", "/nowhere", "--log", level]).refused(&["/nowhere"]);
        run("runtime", &stage, &["run", "--robot", "a/b", "--log", level]).refused(&["a/b"]);
    }
}

#[test]
fn check_bench_and_import_say_more_with_debug() {
    for (level, is_debug) in [("error", false), ("info", false), ("debug", true)] {
        let stage = Stage::new();
        let checked = run("runtime", &stage, &["check", "--log", level]).succeeded();
        assert_says(level, &checked, &[("ok  manifest", true), ("1 EinSum, 1 ", is_debug)]);
        let json = run("runtime", &stage, &["check", "--json", "--log", level]).succeeded();
        assert!(serde_json::from_str::<serde_json::Value>(&json.stdout).is_ok(), "{}", json.stdout);
        let measured = run("runtime", &stage, &["bench", "--log", level]).succeeded();
        assert_says(level, &measured, &[("td3", true), ("1 EinSum, 1 ", is_debug)]);
        let list = stage.path("list.csv");
        std::fs::write(&list, "world,x_m,y_m,radius_m\na,3,3,0.3\nb,0,0,0.5\n").expect("written");
        let (list, out) = (list.to_string_lossy().into_owned(), stage.path("worlds"));
        let arguments = ["import", &list, "--start", "0,0,0", "--goal", "5,5", "--log", level, "--out"];
        let mut command = support::programs::program("simulator", &stage, &[]);
        // Import has no shared files.
        command = std::process::Command::new(command.get_program());
        let imported = Running::of("simulator", {
            command.args(arguments).arg(&out);
            command
        })
        .end();
        assert_eq!(imported.status.code(), Some(1), "one world has no way: {}", imported.stderr);
        assert_says(
            level,
            &imported,
            &[("1 worlds in ", true), ("b is left out", level != "error"), ("a.toml: 1 cylinders", is_debug)],
        );
    }
}

#[test]
fn other_words_are_refused() {
    let stage = Stage::new();
    for name in ["runtime", "simulator"] {
        let ended = run(name, &stage, &["--log", "verbose"]);
        assert_eq!(ended.status.code(), Some(2));
        assert!(ended.stderr.contains("[possible values: error, warn, info, debug]"), "{}", ended.stderr);
    }
}
