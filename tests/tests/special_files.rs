//! Reports go where a path leads: through links, into pipes and devices; or they are refused before anything drives.
//! No file of the user is touched.

mod support;

use std::ffi::CString;
use std::fs;
use std::os::unix::ffi::OsStrExt as _;
use std::os::unix::fs::{FileTypeExt as _, symlink};
use std::path::Path;
use std::process::Stdio;
use std::sync::mpsc;
use std::time::Duration;
use support::programs::{Ended, Running, program, run};
use support::{Stage, read_json};

fn text(path: &Path) -> &str {
    path.to_str().expect("a plain path")
}

/// Drives an episode in lock-step, with both reports.
fn drive(stage: &Stage, simulated: &Path, driven: &Path) {
    let arguments = ["--episodes", "1", "--pace", "lockstep", "--report", text(simulated)];
    let simulator = Running::start("simulator", stage, &arguments);
    run("runtime", stage, &["run", "--pace", "scan", "--quiet", "--report", text(driven)]).succeeded();
    simulator.end().succeeded();
}

/// A program that reports at once that nobody came.
fn alone(name: &str, stage: &Stage, report: &Path) -> Ended {
    let patience = if name == "runtime" { "--idle-exit" } else { "--wait" };
    run(name, stage, &[patience, "0.2", "--report", text(report)])
}

const BOTH: [&str; 2] = ["runtime", "simulator"];

fn is_report(value: &serde_json::Value) -> bool {
    value["ended"].is_string()
}

#[test]
fn a_device_is_written_through() {
    let stage = Stage::new();
    for name in BOTH {
        let null = stage.path(&format!("null-{name}"));
        symlink("/dev/null", &null).expect("a link");
        alone(name, &stage, &null).refused(&["no "]);
        assert!(null.is_symlink(), "{name}");
        assert!(fs::metadata("/dev/null").expect("there").file_type().is_char_device(), "{name}");
        // A device of its own, where the test may make one.
        let device = stage.path(&format!("device-{name}"));
        let path = CString::new(device.as_os_str().as_bytes()).expect("no zero in it");
        // SAFETY: a path that ends with a zero.
        if unsafe { libc::mknod(path.as_ptr(), libc::S_IFCHR | 0o666, libc::makedev(1, 3)) } == 0 {
            alone(name, &stage, &device).refused(&["no "]);
            assert!(fs::metadata(&device).expect("there").file_type().is_char_device(), "{name}");
        }
    }
}

#[test]
fn a_pipes_reader_gets_the_report() {
    let stage = Stage::new();
    let pipes = BOTH.map(|name| stage.path(&format!("pipe-{name}")));
    let readers = pipes.each_ref().map(|pipe| {
        let path = CString::new(pipe.as_os_str().as_bytes()).expect("no zero in it");
        // SAFETY: a path that ends with a zero.
        assert_eq!(unsafe { libc::mkfifo(path.as_ptr(), 0o600) }, 0);
        let (pipe, (answer, answered)) = (pipe.clone(), mpsc::channel());
        // Not joined: a pipe that nobody writes to holds its reader for ever.
        std::thread::spawn(move || answer.send(fs::read_to_string(pipe)));
        answered
    });
    let [driven, simulated] = &pipes;
    drive(&stage, simulated, driven);
    for reader in readers {
        let text = reader.recv_timeout(Duration::from_secs(5)).expect("it comes").expect("text");
        assert!(is_report(&serde_json::from_str(&text).expect("JSON")));
    }
    assert!(pipes.iter().all(|pipe| fs::metadata(pipe).expect("there").file_type().is_fifo()));
}

#[test]
fn a_report_may_go_to_stdout() {
    for name in BOTH {
        let stage = Stage::new();
        let link = stage.path("stdout");
        symlink("/proc/self/fd/1", &link).expect("what /dev/stdout is");
        let ended = alone(name, &stage, &link);
        ended.refused(&["no "]);
        assert!(ended.stdout.contains("\"ended\": "), "{name}: {}", ended.stdout);
        assert!(link.is_symlink());
        // And where stdout is a file: nothing in it is lost.
        let file = stage.path("stdout.txt");
        let patience = if name == "runtime" { "--idle-exit" } else { "--wait" };
        let mut command = program(name, &stage, &[patience, "0.2", "--report", text(&link)]);
        let out = fs::File::create(&file).expect("a file");
        // As a shell's `>>`, so that two writers do not write over each other.
        let appended = fs::File::options().append(true).open(&file).expect("the same");
        drop(out);
        let status = command.stdout(appended).stderr(Stdio::null()).status().expect("it starts");
        assert_eq!(status.code(), Some(1));
        let said = fs::read_to_string(&file).expect("text");
        assert!(said.contains("\"ended\": ") && said.contains("waiting for"), "{name}: {said}");
    }
}

#[test]
fn a_link_to_a_file_stays_a_link() {
    let stage = Stage::new();
    fs::create_dir(stage.path("other")).expect("a folder");
    let links = BOTH.map(|name| {
        let link = stage.path(&format!("link-{name}.json"));
        symlink(format!("other/{name}.json"), &link).expect("a link");
        link
    });
    let [driven, simulated] = &links;
    drive(&stage, simulated, driven);
    for (name, link) in BOTH.iter().zip(&links) {
        assert!(link.is_symlink(), "{name}");
        let target = stage.path("other").join(format!("{name}.json"));
        assert!(!target.is_symlink() && is_report(&read_json(&target)), "{name}");
    }
}

#[test]
fn files_of_the_user_stay() {
    let stage = Stage::new();
    let theirs = ["out.partial", ".out.json.tmp", "out.json.tmp", "out.json.partial", "out.tmp"];
    theirs.iter().for_each(|name| fs::write(stage.path(name), "precious").expect("written"));
    let report = stage.path("out.json");
    for name in BOTH {
        alone(name, &stage, &report).refused(&["no "]);
        assert!(is_report(&read_json(&report)), "{name}");
        fs::remove_file(&report).expect("ours");
        for file in theirs {
            assert_eq!(
                fs::read_to_string(stage.path(file)).expect("it is there"),
                "precious",
                "{name}: {file}"
            );
        }
    }
}

#[test]
fn a_folder_or_a_socket_is_refused_before_driving() {
    let stage = Stage::new();
    let socket = stage.path("socket");
    let _listener = std::os::unix::net::UnixListener::bind(&socket).expect("a socket");
    let folder = stage.path("folder");
    fs::create_dir(&folder).expect("a folder");
    let link = stage.path("link");
    symlink("folder", &link).expect("a link");
    for name in BOTH {
        for path in [&folder, &link, &socket] {
            // Without a patience of its own: it would wait for half a minute.
            let ended = run(name, &stage, &["--report", text(path)]);
            ended.refused(&["--report", text(path), "cannot be written"]);
            assert_eq!(ended.stdout, "", "{name} began");
        }
        assert!(folder.is_dir() && link.is_symlink());
    }
}
