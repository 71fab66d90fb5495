//! A model on its way to the robot: read first by a child process with limits on time and memory, then by this one.
//!
//! The bytes are untrusted. Whatever tract makes of them, the worst that happens is a child that is killed.

use nav_host::terminal::debug;
use nav_model::model::{Model, ModelError, OwnerKey, OwnerLimits};
use std::ffi::{OsStr, OsString};
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// The hidden subcommand of the child.
pub const SUBCOMMAND: &str = "probe-model";
/// Processor time that a child may take, s.
const CPU_SECONDS: u64 = 10;
/// Address space that a child may have, bytes.
const MEMORY_BYTES: u64 = 1 << 30;
/// Time that a child may take by the clock, on a machine that is busy with other things.
const PATIENCE: Duration = Duration::from_secs(60);
/// The most that is read of what a child says, bytes.
const WORDS_MAX: u64 = 8 << 10;

/// What the robot's owner demands of a model.
#[derive(Clone, Debug, Default)]
pub struct Demands {
    /// A file of limits that it must not go beyond.
    pub limits: Option<PathBuf>,
    /// The minisign public key that its manifest must be signed with, or the file of one.
    pub key: Option<String>,
}

impl Demands {
    /// Reads a model and holds it to the demands, in this process.
    ///
    /// # Errors
    /// Demands that cannot be read, or a model that is refused.
    pub fn read(&self, folder: &Path) -> Result<Model, ModelError> {
        let limits = self.limits.as_deref().map(OwnerLimits::read).transpose()?;
        let key = self.key.as_deref().map(OwnerKey::read).transpose()?;
        let model = Model::read_signed(folder, key.as_ref())?;
        limits.map_or(Ok(()), |limits| model.respects(&limits))?;
        Ok(model)
    }

    /// Hands a model and the demands on to a child of this program.
    pub(crate) fn pass_on(&self, folder: &Path, child: &mut Command) {
        let mut pass = |option: &str, value: &OsStr| {
            let mut argument = OsString::from(option);
            argument.push(value);
            child.arg(argument);
        };
        pass("--model=", folder.as_os_str());
        self.limits.iter().for_each(|limits| pass("--limits=", limits.as_os_str()));
        self.key.iter().for_each(|key| pass("--require-signature=", key.as_ref()));
    }
}

/// Why a model was not read.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The child refused it, as this process would.
    #[error("{0}")]
    Refused(String),
    /// The child was killed by its limits, or by a fault.
    #[error(
        "reading the model in {folder} was given up after {seconds:.0} s ({how}): {CPU_SECONDS} s of processor time and {} MiB \
         are allowed; no policy needs that, do not trust this file",
        MEMORY_BYTES >> 20
    )]
    GivenUp {
        /// The model's folder.
        folder: String,
        /// How long it took, s.
        seconds: f64,
        /// How the child ended.
        how: String,
    },
    /// No child could be started.
    #[error(
        "no process could be started to read the model in ({0}): allow one more (ulimit -u, or the service's TasksMax)"
    )]
    NoChild(io::Error),
    /// This process refused it.
    #[error(transparent)]
    Model(#[from] ModelError),
}

/// Reads and checks a model, in a child first; refuses one that does not meet the demands.
///
/// # Errors
/// [`ReadError`], as a sentence.
pub fn read(folder: &Path, demands: &Demands) -> Result<Model, ReadError> {
    let program = std::env::current_exe().map_err(ReadError::NoChild)?;
    let mut child = Command::new(program);
    demands.pass_on(folder, child.arg(SUBCOMMAND));
    probe(&mut child, folder, PATIENCE)?;
    let model = demands.read(folder)?;
    nav_model::check::details(&model).into_iter().for_each(debug);
    Ok(model)
}

/// What the child does: the same, with limits on itself.
///
/// # Errors
/// A model that is refused, or limits that the system does not set.
pub fn read_within_limits(folder: &Path, demands: &Demands) -> anyhow::Result<()> {
    limit(libc::RLIMIT_CPU, CPU_SECONDS)?;
    limit(libc::RLIMIT_AS, MEMORY_BYTES)?;
    limit(libc::RLIMIT_CORE, 0)?;
    demands.read(folder)?;
    Ok(())
}

fn limit(resource: libc::__rlimit_resource_t, most: u64) -> io::Result<()> {
    let limit = libc::rlimit { rlim_cur: most, rlim_max: most };
    // SAFETY: a valid structure of plain numbers.
    if unsafe { libc::setrlimit(resource, &raw const limit) } == 0 {
        Ok(())
    } else {
        Err(io::Error::last_os_error())
    }
}

fn probe(command: &mut Command, folder: &Path, patience: Duration) -> Result<(), ReadError> {
    let started = Instant::now();
    let child = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped()).spawn();
    let mut child = child.map_err(ReadError::NoChild)?;
    let status = wait(&mut child, patience).map_err(ReadError::NoChild)?;
    let given_up = |how: String| ReadError::GivenUp {
        folder: folder.display().to_string(),
        seconds: started.elapsed().as_secs_f64(),
        how,
    };
    match status {
        None => Err(given_up("it took too long".to_owned())),
        Some(status) if status.success() => Ok(()),
        Some(status) => match (status.code(), words(&mut child)) {
            (Some(1), words) if !words.is_empty() => Err(ReadError::Refused(words)),
            _ => Err(given_up(status.to_string())),
        },
    }
}

/// How a child ended; `None` when it was killed because it took too long.
fn wait(child: &mut Child, patience: Duration) -> io::Result<Option<ExitStatus>> {
    let ends = Instant::now() + patience;
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok(Some(status));
        }
        if Instant::now() > ends {
            child.kill()?;
            child.wait()?;
            return Ok(None);
        }
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// What it said last, without the program's name.
fn words(child: &mut Child) -> String {
    let mut bytes = Vec::new();
    if let Some(stderr) = &mut child.stderr {
        // What cannot be read is not said.
        let _ = stderr.take(WORDS_MAX).read_to_end(&mut bytes);
    }
    String::from_utf8_lossy(&bytes).trim().trim_start_matches("runtime: ").to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn probe_shell(script: &str, patience: Duration) -> Result<(), ReadError> {
        probe(Command::new("sh").args(["-c", script]), Path::new("models"), patience)
    }

    #[test]
    fn a_child_that_is_killed_or_never_ends_is_a_sentence() {
        let long = Duration::from_secs(30);
        assert!(probe_shell("exit 0", long).is_ok());
        let refused = probe_shell("echo 'runtime: the network is damaged' >&2; exit 1", long);
        assert_eq!(refused.expect_err("refused").to_string(), "the network is damaged");
        let spent = probe_shell("ulimit -t 1; while :; do :; done", long).expect_err("killed").to_string();
        assert!(spent.contains("given up") && spent.contains("do not trust"), "{spent}");
        let started = Instant::now();
        let slow = probe_shell("sleep 20", Duration::from_millis(200)).expect_err("slow").to_string();
        assert!(slow.contains("took too long") && started.elapsed() < Duration::from_secs(10), "{slow}");
    }
}
