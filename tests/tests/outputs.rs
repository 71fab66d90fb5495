//! Whatever becomes of the terminal, the work is done and kept: outputs that are full, closed or lost, readers that take
//! nothing. And nothing that a file says commands the terminal.

mod support;

use nav_core::messages::CmdVel;
use std::fs::{self, File};
use std::io::{PipeReader, PipeWriter, Write as _};
use std::os::fd::{AsRawFd as _, FromRawFd as _};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use support::programs::{Running, program, run, wait_until};
use support::{Stage, read_json};

const BOTH: [&str; 2] = ["runtime", "simulator"];

fn text(path: &Path) -> &str {
    path.to_str().expect("a plain path")
}

/// A pipe that takes nothing more.
fn full_pipe() -> (PipeReader, PipeWriter) {
    let (reader, mut writer) = std::io::pipe().expect("a pipe");
    let set = |flags: i32| {
        // SAFETY: a descriptor of our own.
        assert_eq!(unsafe { libc::fcntl(writer.as_raw_fd(), libc::F_SETFL, flags) }, 0);
    };
    set(libc::O_NONBLOCK);
    for size in [4096, 1] {
        while (&writer).write(&vec![b'x'; size]).is_ok() {}
    }
    set(0);
    writer.flush().expect("nothing waits");
    (reader, writer)
}

/// Whether a process has a handler of its own for SIGTERM.
fn listens(id: u32) -> bool {
    let status = fs::read_to_string(format!("/proc/{id}/status")).unwrap_or_default();
    let caught = status.lines().find_map(|line| line.strip_prefix("SigCgt:"));
    let mask = caught.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0);
    mask >> (libc::SIGTERM - 1) & 1 == 1
}

/// A process that does not outlive the test.
struct Kept(Child);

impl Drop for Kept {
    fn drop(&mut self) {
        // It may have ended long ago.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn spawn(mut command: Command) -> Kept {
    Kept(command.spawn().expect("it starts"))
}

fn signal(child: &Kept, signal: i32) {
    let process = i32::try_from(child.0.id()).expect("a process id");
    // SAFETY: the process is our own child and was not waited for.
    assert_eq!(unsafe { libc::kill(process, signal) }, 0, "it runs");
}

/// The exit code, if it comes soon.
fn code_soon(mut child: Kept) -> Option<i32> {
    let asked = Instant::now();
    while asked.elapsed() < Duration::from_secs(20) {
        if let Some(status) = child.0.try_wait().expect("our own child") {
            return status.code();
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    None
}

#[test]
fn a_signal_ends_a_program_whose_words_nobody_takes() {
    for name in BOTH {
        let stage = Stage::new();
        let (_reader, writer) = full_pipe();
        let mut command = program(name, &stage, &[]);
        command.stdin(Stdio::null()).stdout(writer.try_clone().expect("a copy")).stderr(writer);
        let child = spawn(command);
        let started = Instant::now();
        while !listens(child.0.id()) {
            assert!(started.elapsed() < Duration::from_secs(20), "{name} does not come as far as listening");
            std::thread::sleep(Duration::from_millis(5));
        }
        std::thread::sleep(Duration::from_millis(1200));
        signal(&child, libc::SIGTERM);
        assert_eq!(code_soon(child), Some(128 + libc::SIGTERM), "{name}");
    }
}

#[test]
fn a_drive_goes_on_while_nobody_takes_its_words() {
    let stage = Stage::new();
    let (_reader, writer) = full_pipe();
    let reports = BOTH.map(|name| stage.path(&format!("{name}.json")));
    let start = |mut command: Command| {
        let (out, err) = (writer.try_clone().expect("a copy"), writer.try_clone().expect("a copy"));
        command.stdin(Stdio::null()).stdout(out).stderr(err);
        spawn(command)
    };
    let drive = ["--episodes", "2", "--pace", "lockstep", "--report", text(&reports[1])];
    let simulator = start(program("simulator", &stage, &drive));
    let runtime =
        start(program("runtime", &stage, &["run", "--pace", "scan", "--report", text(&reports[0])]));
    let started = Instant::now();
    while !reports.iter().all(|report| report.exists()) {
        assert!(started.elapsed() < Duration::from_secs(20), "nothing is driven, or nothing reported");
        std::thread::sleep(Duration::from_millis(5));
    }
    for child in [simulator, runtime] {
        signal(&child, libc::SIGTERM);
        assert_eq!(code_soon(child), Some(0), "all was done before the signal");
    }
    assert!(read_json(&reports[0])["ticks"].as_u64() > Some(0));
    assert_eq!(read_json(&reports[1])["ended"], "complete");
}

#[test]
fn a_drive_needs_no_output_at_all() {
    for outputs in ["2>/dev/full", "2>&-", ">&-", ">/dev/full 2>/dev/full", "</dev/null >&- 2>&-"] {
        let stage = Stage::new();
        let reports = BOTH.map(|name| stage.path(&format!("{name}.json")));
        let start = |name: &str, arguments: &[&str]| {
            let direct = program(name, &stage, arguments);
            let mut command = Command::new("sh");
            command.args(["-c", &format!("exec \"$0\" \"$@\" {outputs}")]);
            command.arg(direct.get_program()).args(direct.get_args());
            Running::of(name, command)
        };
        let drive = ["--episodes", "1", "--pace", "lockstep", "--report", text(&reports[1])];
        let simulator = start("simulator", &drive);
        start("runtime", &["run", "--pace", "scan", "--report", text(&reports[0])]).end().succeeded();
        simulator.end().succeeded();
        assert!(reports.iter().all(|report| read_json(report)["ended"].is_string()), "{outputs}");
        // A refusal has its code, too.
        for name in BOTH {
            assert_eq!(start(name, &["--robot", "a/b"]).end().status.code(), Some(1), "{name} {outputs}");
        }
    }
}

/// A terminal that is gone: its other end was closed.
fn lost_terminal() -> File {
    let (mut master, mut slave) = (0, 0);
    let none = std::ptr::null_mut();
    // SAFETY: room for both ends; no name, settings or size are asked for.
    let status = unsafe {
        libc::openpty(
            &raw mut master,
            &raw mut slave,
            none,
            none.cast::<libc::termios>(),
            none.cast::<libc::winsize>(),
        )
    };
    assert_eq!(status, 0, "{}", std::io::Error::last_os_error());
    // SAFETY: both are new and nobody else's.
    let [_master, slave] = [master, slave].map(|end| unsafe { File::from_raw_fd(end) });
    slave
}

#[test]
fn a_drive_outlives_its_terminal_as_far_as_its_report() {
    let stage = Stage::new();
    let reports = BOTH.map(|name| stage.path(&format!("{name}.json")));
    let node = stage.node();
    let command_in = node.reader::<CmdVel>().expect("a command reader");
    let start = |mut command: Command| {
        let terminal = lost_terminal();
        let copy = || terminal.try_clone().expect("a copy");
        command.stdin(copy()).stdout(copy()).stderr(copy());
        spawn(command)
    };
    let drive =
        ["--episodes", "100000", "--pace", "lockstep", "--view", "terminal", "--report", text(&reports[1])];
    let simulator = start(program("simulator", &stage, &drive));
    let runtime =
        start(program("runtime", &stage, &["run", "--pace", "scan", "--report", text(&reports[0])]));
    let mut newest = CmdVel::default();
    wait_until("commands", || command_in.read_latest(&mut newest).expect("received"));
    // As the system does it: everybody at once.
    signal(&simulator, libc::SIGHUP);
    signal(&runtime, libc::SIGHUP);
    let hangup = Some(128 + libc::SIGHUP);
    assert_eq!((code_soon(simulator), code_soon(runtime)), (hangup, hangup));
    for report in &reports {
        let ended = read_json(report)["ended"].as_str().expect("a sentence").to_owned();
        assert!(ended.starts_with("the terminal is gone"), "{ended}");
    }
}

/// Retitles the terminal, clears it, and forges a line.
const HOSTILE: &str = "\u{1b}]0;owned\u{7}\u{1b}[2J\u{9b}31m\u{202e}";
const HOSTILE_SEEN: &str = "\\u{1b}]0;owned\\u{7}\\u{1b}[2J\\u{9b}31m\\u{202e}";

fn assert_harmless(said: &str) {
    let harmful = said.chars().find(|letter| letter.is_control() && !"\n\t".contains(*letter));
    assert_eq!(harmful, None, "{said:?}");
}

#[test]
fn a_worlds_name_cannot_command_the_terminal() {
    let stage = Stage::new();
    let office = concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/nav-sim/worlds/office.toml");
    let office = fs::read_to_string(office).expect("the example");
    let name = office.lines().find(|line| line.starts_with("name = ")).expect("it has one");
    // The file's name comes out with its episode, the world's with the view.
    let world = stage.path("w\u{1b}]0;owned\u{7}\nforged.toml");
    let hostile = "name = \"\\u001b]0;owned\\u0007\\u001b[2J\\nforged\"";
    fs::write(&world, office.replace(name, hostile)).expect("written");
    let drive = |view: &str| {
        let arguments =
            ["--world-file", text(&world), "--pace", "lockstep", "--time-limit", "2", "--view", view];
        let simulator = Running::start("simulator", &stage, &arguments);
        run("runtime", &stage, &["run", "--pace", "scan", "--quiet"]).succeeded();
        simulator.end().succeeded().stdout
    };
    let said = drive("none");
    assert_harmless(&said);
    assert!(said.contains("w\\u{1b}]0;owned\\u{7}\\u{a}forged.toml"), "{said}");
    let shown = drive("terminal");
    assert!(shown.contains("\\u{1b}]0;owned\\u{7}\\u{1b}[2J\\u{a}forged"), "{shown}");
    assert!(!shown.contains("\u{1b}]") && !shown.contains("\u{1b}[2J"), "{shown:?}");
}

#[test]
fn an_error_about_a_file_cannot_command_the_terminal() {
    let stage = Stage::new();
    let world = stage.path("world.toml");
    let map = stage.path("map.yaml");
    let on_map = ["--map", text(&map), "--start", "0,0,0", "--goal", "1,1"];
    fs::write(&world, format!("name = \"{HOSTILE}\"\n")).expect("written");
    fs::write(&map, format!("image: \"\\e]0;owned\\a{HOSTILE}\"\nresolution: \"{HOSTILE}\"\n"))
        .expect("written");
    for arguments in [&["--world-file", text(&world)][..], &on_map] {
        let ended = run("simulator", &stage, arguments);
        assert_eq!(ended.status.code(), Some(1), "{}", ended.stderr);
        assert_harmless(&ended.stderr);
        assert!(ended.stderr.contains("owned"), "{}", ended.stderr);
    }
    // A model's manifest, to both programs that read one.
    let path = stage.model().join("manifest.json");
    let manifest = fs::read_to_string(&path).expect("the fixture's");
    let mut changed: serde_json::Value = serde_json::from_str(&manifest).expect("JSON");
    changed["td3"]["file"] = HOSTILE.into();
    changed.as_object_mut().expect("an object").insert(HOSTILE.to_owned(), 1.into());
    fs::write(&path, changed.to_string()).expect("written");
    let model = stage.model();
    for (name, arguments) in [("runtime", &["check"][..]), ("simulator", &["--model", text(&model)])] {
        let ended = run(name, &stage, arguments);
        assert_eq!(ended.status.code(), Some(1), "{}", ended.stderr);
        assert_harmless(&ended.stderr);
        assert!(ended.stderr.contains(HOSTILE_SEEN), "{name}: {}", ended.stderr);
    }
}
