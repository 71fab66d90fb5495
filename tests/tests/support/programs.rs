//! The programs under test, as processes that do not outlive the test.

use super::{Stage, soak};
use std::io::Read;
use std::path::PathBuf;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

/// Far more than anything here takes; only against hanging for ever.
const PATIENCE: Duration = Duration::from_secs(120);

/// The folder of `runtime` and `simulator`: beside the test, built there if nobody has.
fn folder() -> &'static PathBuf {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| {
        let test = std::env::current_exe().expect("the test's own path");
        let folder = test.parent().and_then(|deps| deps.parent()).expect("target/<profile>/deps").to_owned();
        if !(folder.join("runtime").exists() && folder.join("simulator").exists()) {
            let mut build = Command::new(env!("CARGO"));
            build.args(["build", "--workspace", "--bin", "runtime", "--bin", "simulator"]);
            if folder.ends_with("release") {
                build.arg("--release");
            }
            build.arg("--target-dir").arg(folder.parent().expect("the target folder"));
            build.current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
            assert!(build.status().expect("cargo starts").success(), "the programs could not be built");
        }
        folder
    })
}

/// A program with the stage's shared files; its model too, if it is the runtime.
pub fn program(name: &str, stage: &Stage, arguments: &[&str]) -> Command {
    let mut command = Command::new(folder().join(name));
    command.args(arguments);
    if arguments.first() != Some(&"check") && arguments.first() != Some(&"bench") {
        command.arg("--ipc-root").arg(stage.ipc_root());
    }
    if name == "runtime" && !arguments.contains(&"--model") {
        command.arg("--model").arg(stage.model());
    }
    command
}

/// A running program.
pub struct Running {
    child: Child,
    name: String,
}

/// How a program ended.
pub struct Ended {
    pub status: ExitStatus,
    pub stdout: String,
    pub stderr: String,
}

impl Running {
    pub fn start(name: &str, stage: &Stage, arguments: &[&str]) -> Self {
        Self::of(name, program(name, stage, arguments))
    }

    /// A program that is already put together.
    pub fn of(name: &str, mut command: Command) -> Self {
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let child = command.spawn().unwrap_or_else(|error| panic!("{name} does not start: {error}"));
        Self { child, name: name.to_owned() }
    }

    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// Nobody reads any more what it prints.
    pub fn close_stdout(&mut self) {
        self.child.stdout = None;
    }

    pub fn signal(&self, signal: i32) {
        let process = i32::try_from(self.child.id()).expect("a process id");
        // SAFETY: the process is our own child and was not waited for.
        assert_eq!(unsafe { libc::kill(process, signal) }, 0, "{} cannot be signalled", self.name);
        match signal {
            libc::SIGKILL => soak::count(&[("programs killed", 1)]),
            libc::SIGSTOP => soak::count(&[("programs frozen", 1)]),
            libc::SIGCONT => {}
            _ => soak::count(&[("programs asked to end", 1)]),
        }
    }

    pub fn is_running(&mut self) -> bool {
        matches!(self.child.try_wait(), Ok(None))
    }

    /// Waits for the end and collects what was printed.
    pub fn end(mut self) -> Ended {
        let started = Instant::now();
        let status = loop {
            if let Some(status) = self.child.try_wait().expect("a child can be waited for") {
                break status;
            }
            assert!(started.elapsed() < PATIENCE, "{} does not end", self.name);
            std::thread::sleep(Duration::from_millis(5));
        };
        let mut ended = Ended { status, stdout: String::new(), stderr: String::new() };
        let read = |pipe: Option<&mut dyn Read>, text: &mut String| {
            if let Some(pipe) = pipe {
                pipe.read_to_string(text).expect("text");
            }
        };
        read(self.child.stdout.as_mut().map(|pipe| pipe as _), &mut ended.stdout);
        read(self.child.stderr.as_mut().map(|pipe| pipe as _), &mut ended.stderr);
        ended
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        if self.is_running() {
            // It may end at this very moment.
            let _ = self.child.kill();
            let _ = self.child.wait();
        }
    }
}

impl Ended {
    /// The program did what it was asked to.
    pub fn succeeded(self) -> Self {
        assert!(self.status.success(), "{}: {}\n{}", self.status, self.stderr, self.stdout);
        self
    }

    /// The program ended because of a signal, in good order: nav_host::exit says with which code.
    pub fn stopped_by(self, signal: i32) -> Self {
        assert_eq!(
            self.status.code(),
            Some(128 + signal),
            "{}: {}\n{}",
            self.status,
            self.stderr,
            self.stdout
        );
        self
    }

    /// The program refused with exit code 1 and one clear sentence that contains each of these parts.
    pub fn refused(&self, parts: &[&str]) {
        assert_eq!(self.status.code(), Some(1), "{}: {}\n{}", self.status, self.stderr, self.stdout);
        let lines: Vec<&str> = self.stderr.lines().filter(|line| !line.is_empty()).collect();
        assert_eq!(lines.len(), 1, "one sentence, not {:?}", self.stderr);
        for part in parts {
            assert!(self.stderr.contains(part), "`{part}` is missing in: {}", self.stderr);
        }
        assert!(!self.stderr.contains("panicked"), "{}", self.stderr);
    }
}

/// Runs a program to its end.
pub fn run(name: &str, stage: &Stage, arguments: &[&str]) -> Ended {
    Running::start(name, stage, arguments).end()
}

/// Waits until something is true; fails the test with `what` if it never is.
pub fn wait_until(what: &str, mut condition: impl FnMut() -> bool) {
    let started = Instant::now();
    while !condition() {
        assert!(started.elapsed() < PATIENCE, "never happened: {what}");
        std::thread::sleep(Duration::from_millis(2));
    }
}
