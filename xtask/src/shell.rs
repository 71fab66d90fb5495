//! Finding the workspace and running programs: quiet when they succeed, telling when they fail.

use std::ffi::OsStr;
use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};

/// The folder of the workspace's `Cargo.toml`.
///
/// Cargo says at run time where this package lies, so that a moved checkout still works.
pub(crate) fn root() -> PathBuf {
    let package = std::env::var_os("CARGO_MANIFEST_DIR")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")), PathBuf::from);
    package.parent().map_or(package.clone(), Path::to_path_buf)
}

/// The cargo that started this task.
pub(crate) fn cargo() -> Command {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.current_dir(root());
    // What cargo told this process about itself must not reach the builds it starts.
    for (name, _) in std::env::vars_os() {
        let told_by_cargo = name.to_str().is_some_and(|name| {
            name.starts_with("CARGO_PKG_") || name.starts_with("CARGO_MANIFEST_") || name == "CARGO"
        });
        if told_by_cargo {
            command.env_remove(name);
        }
    }
    command
}

/// Prints a line of results. Whoever has closed the pipe misses it, and the task goes on: `println!` would panic.
pub(crate) fn print_line(line: &str) {
    let _ = writeln!(io::stdout(), "{line}");
}

/// Says what happens next, on one line.
pub(crate) fn say(text: &str) {
    print_line(&format!("xtask: {text}"));
}

/// Whether `program` can be started.
pub(crate) fn have(program: impl AsRef<OsStr>, probe: &[&str]) -> bool {
    Command::new(program)
        .args(probe)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .is_ok_and(|status| status.success())
}

/// Runs a program whose output the user follows, and fails with its exit status.
pub(crate) fn run_shown(command: &mut Command, what: &str) -> Result<()> {
    let status = command.status().with_context(|| format!("could not start {what}"))?;
    if !status.success() {
        bail!("{what} failed ({status}); its own output above says why");
    }
    Ok(())
}

/// Runs a program silently and returns what it printed; on failure, its last lines are the error.
///
/// `alive` is called about every three seconds with the time since the start, to show progress.
pub(crate) fn run_quiet(
    command: &mut Command,
    what: &str,
    mut alive: impl FnMut(Duration),
) -> Result<String> {
    let (mut out, mut err) = (nameless_file("out")?, nameless_file("err")?);
    let started = Instant::now();
    let mut child = command
        .stdin(Stdio::null())
        .stdout(out.try_clone()?)
        .stderr(err.try_clone()?)
        .spawn()
        .with_context(|| format!("could not start {what}"))?;
    let mut told = started;
    let status = loop {
        if let Some(status) = child.try_wait()? {
            break status;
        }
        if told.elapsed() >= Duration::from_secs(3) {
            told = Instant::now();
            alive(started.elapsed());
        }
        thread::sleep(Duration::from_millis(30));
    };
    let (out, err) = (read_all(&mut out)?, read_all(&mut err)?);
    if !status.success() {
        bail!("{what} failed ({status}): {}", last_words(&err, &out));
    }
    Ok(out)
}

/// A file that is gone when the last process closes it, for what a program prints.
fn nameless_file(kind: &str) -> Result<File> {
    let folder = tools();
    fs::create_dir_all(&folder).with_context(|| format!("could not create {}", folder.display()))?;
    let path = folder.join(format!("log-{}-{kind}", std::process::id()));
    let file = File::options().read(true).write(true).create(true).truncate(true).open(&path)?;
    fs::remove_file(&path)?;
    Ok(file)
}

fn read_all(file: &mut File) -> Result<String> {
    let mut bytes = Vec::new();
    file.seek(SeekFrom::Start(0))?;
    file.read_to_end(&mut bytes)?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

/// What a program said about its failure: its last lines that begin with `error`, else its last lines.
fn last_words(err: &str, out: &str) -> String {
    let source = if err.trim().is_empty() { out } else { err };
    let lines: Vec<&str> = source.lines().map(str::trim).filter(|line| !line.is_empty()).collect();
    let errors: Vec<&str> =
        lines.iter().copied().filter(|line| line.to_lowercase().starts_with("error")).collect();
    let told = if errors.is_empty() { &lines } else { &errors };
    let told = &told[told.len().saturating_sub(2)..];
    if told.is_empty() { "it printed nothing".to_owned() } else { told.join("; ") }
}

/// Where everything that is fetched or built beside the crates lies (git ignores it).
pub(crate) fn tools() -> PathBuf {
    root().join(".tools")
}

/// Holds the set-up lock: two set-ups in one workspace take turns. Released when dropped.
pub(crate) fn set_up_lock() -> Result<File> {
    let folder = tools();
    fs::create_dir_all(&folder).with_context(|| format!("could not create {}", folder.display()))?;
    let file = File::create(folder.join("lock"))?;
    if file.try_lock().is_err() {
        say("another set-up is running in this workspace; waiting for it");
        file.lock().context("could not lock .tools/lock")?;
    }
    Ok(file)
}

/// A folder under `.tools/` to make something in before it is renamed into place.
///
/// It is this process's own: what a killed set-up left behind, or still writes, is not in it. The
/// remains of earlier ones are removed.
pub(crate) fn partial_folder(name: &str) -> Result<PathBuf> {
    let prefix = format!("{name}.partial-");
    for entry in fs::read_dir(tools())?.flatten() {
        if entry.file_name().to_string_lossy().starts_with(&prefix) {
            // An unpacking that outlived its killed set-up may still write there: the next set-up removes it.
            let _ = fs::remove_dir_all(entry.path());
        }
    }
    Ok(tools().join(format!("{prefix}{}", std::process::id())))
}

/// Removes a folder and all it holds; it may be absent.
pub(crate) fn remove_folder(path: &Path) -> Result<()> {
    match fs::remove_dir_all(path) {
        Ok(()) => Ok(()),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(()),
        Err(error) => Err(error).with_context(|| format!("could not remove {}", path.display())),
    }
}

/// Megabytes of all files below a folder, as far as they can be read.
pub(crate) fn size_mb(folder: &Path) -> u64 {
    fn bytes(folder: &Path) -> u64 {
        let Ok(entries) = fs::read_dir(folder) else { return 0 };
        entries
            .flatten()
            .map(|entry| match entry.metadata() {
                Ok(meta) if meta.is_dir() => bytes(&entry.path()),
                Ok(meta) => meta.len(),
                Err(_) => 0,
            })
            .sum()
    }
    bytes(folder) / 1_000_000
}
