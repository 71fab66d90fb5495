//! The folder of a run, and the folder of runs.
//!
//! | file | holds |
//! |---|---|
//! | `config.toml` | every field of the configuration |
//! | `checkpoints/` | the newest training states |
//! | `scalars.csv`, `events.*` | scalars over environment steps |
//! | `curve.csv` | how the policy did on validation worlds meanwhile, if that was wanted (`curve.points`) |
//! | `lock` | nothing; held by the process that trains |
//! | `low.bin` | the policy whose low level is used, if none is trained |
//! | `attempts.toml` | which attempt of how many it is, and the seeds tried before; none if it is the only one |
//! | `policy.bin` | the trained policy with all verdicts on it; there once the run has finished |
//! | `more.toml` | how far it was trained on after that (`--more`), if it was |
//! | `policy-before-more-1.bin` | the policy that it had before, and so on for each `--more` |
//! | `failed.txt` | why the run was stopped for good, if it was |
//! | `more-failed.txt` | the same of being trained on; the policy is then the one before |

use anyhow::{Context, Result, bail};
use nav_host::files::write_atomically;
use nav_host::sha256::sha256_hex;
use std::fs::{File, TryLockError};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use super::past::Attempts;
use super::policy::Policy;
use crate::checkpoint::{Checkpoint, Contents};
use crate::config::{Config, Profile};

/// Where runs are kept unless `--out` says otherwise.
pub const RUNS_FOLDER: &str = "runs";
const CONFIG: &str = "config.toml";
const POLICY: &str = "policy.bin";
const LOW: &str = "low.bin";
const FAILED: &str = "failed.txt";

/// The folder of one run.
#[derive(Clone, Debug)]
pub struct RunFolder {
    path: PathBuf,
}

impl RunFolder {
    /// Makes the folder of a new run and writes its configuration, which attempt it is, and the policy whose low level it
    /// uses if it does not train one.
    ///
    /// # Errors
    /// A folder that already holds a run, or cannot be written.
    pub fn create(path: &Path, config: &Config, low: Option<&Policy>, attempts: &Attempts) -> Result<Self> {
        let folder = Self { path: path.to_path_buf() };
        if folder.path.join(CONFIG).exists() {
            bail!(
                "{} already holds a run: continue it with --resume {0}, or choose another --out",
                path.display()
            );
        }
        std::fs::create_dir_all(path)
            .with_context(|| format!("cannot make the folder {}", path.display()))?;
        // The configuration last: without it the folder is no run.
        if let Some(low) = low {
            folder.write_policy(LOW, low)?;
        }
        folder.write_attempts(attempts)?;
        folder.write_text(CONFIG, &config.to_toml())?;
        Ok(folder)
    }

    /// Opens the folder of an existing run.
    ///
    /// # Errors
    /// A folder that holds no run.
    pub fn open(path: &Path) -> Result<Self> {
        if !path.join(CONFIG).is_file() {
            bail!(
                "{} holds no run (no {CONFIG}): give the folder that `trainer train` named",
                path.display()
            );
        }
        Ok(Self { path: path.to_path_buf() })
    }

    /// The newest run below [`RUNS_FOLDER`] that `wanted` accepts.
    ///
    /// # Errors
    /// None there.
    pub fn newest(wanted: impl Fn(&Self) -> bool, what: &str) -> Result<Self> {
        let entries = std::fs::read_dir(RUNS_FOLDER).into_iter().flatten().flatten();
        let runs = entries.filter_map(|entry| Self::open(&entry.path()).ok()).filter(|run| wanted(run));
        runs.max_by_key(Self::changed).with_context(|| {
            format!(
                "there is no {what} run in {RUNS_FOLDER}/: start one with `trainer train`, or name its folder"
            )
        })
    }

    fn changed(&self) -> SystemTime {
        let time = |path: &Path| std::fs::metadata(path).and_then(|data| data.modified()).ok();
        time(&self.policy_path()).or_else(|| time(&self.checkpoints())).unwrap_or(SystemTime::UNIX_EPOCH)
    }

    /// A name for the next run below [`RUNS_FOLDER`]: numbered, with what it trains and for which robot.
    pub fn next_path(config: &Config) -> PathBuf {
        let entries = std::fs::read_dir(RUNS_FOLDER).into_iter().flatten().flatten();
        let number = |name: &str| name.split('-').next().and_then(|number| number.parse::<u32>().ok());
        let last =
            entries.filter_map(|entry| number(&entry.file_name().to_string_lossy())).max().unwrap_or(0);
        let algorithm = format!("{:?}", config.algorithm).to_lowercase();
        let robot = config.robot.as_ref().map_or_else(String::new, |name| format!("-{name}"));
        Path::new(RUNS_FOLDER).join(format!(
            "{:04}-{algorithm}{robot}-{}-seed{}",
            last + 1,
            config.profile,
            config.seed
        ))
    }

    /// The folder itself.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The folder of its checkpoints.
    pub fn checkpoints(&self) -> PathBuf {
        self.path.join("checkpoints")
    }

    pub(super) fn policy_path(&self) -> PathBuf {
        self.path.join(POLICY)
    }

    /// Whether the run has finished.
    pub fn is_finished(&self) -> bool {
        self.policy_path().is_file()
    }

    /// Whether training can go on here, or another attempt is due.
    pub fn is_unfinished(&self) -> bool {
        match self.is_finished() {
            // What cannot be read cannot go on, either.
            true => self.due_attempt().is_ok_and(|due| due.is_some()),
            false => self.failure().is_none(),
        }
    }

    /// Why the run was stopped for good, and what to do, if it was.
    pub fn failure(&self) -> Option<String> {
        self.reason(FAILED)
    }

    pub(super) fn reason(&self, name: &str) -> Option<String> {
        let path = self.path.join(name);
        path.is_file().then(|| std::fs::read_to_string(path).unwrap_or_default().trim_end().to_owned())
    }

    /// Keeps why the run was stopped for good.
    ///
    /// # Errors
    /// A folder that cannot be written.
    pub fn save_failure(&self, reason: &str) -> Result<()> {
        self.write_text(FAILED, &format!("{reason}\n"))
    }

    pub(super) fn write_text(&self, name: &str, text: &str) -> Result<()> {
        let path = self.path.join(name);
        write_atomically(&path, |file| file.write_all(text.as_bytes()))
            .with_context(|| format!("cannot write {}", path.display()))
    }

    /// Keeps every other process from training in this folder for as long as the result lives.
    ///
    /// # Errors
    /// Another process that trains here.
    pub fn lock(&self) -> Result<File> {
        let path = self.path.join("lock");
        let file = File::create(&path).with_context(|| format!("cannot write {}", path.display()))?;
        match file.try_lock() {
            Ok(()) => Ok(file),
            Err(TryLockError::WouldBlock) => bail!(
                "another process is training in {}: wait for it, stop it, or choose another --out",
                self.path.display()
            ),
            Err(TryLockError::Error(error)) => {
                Err(error).with_context(|| format!("cannot lock {}", path.display()))
            }
        }
    }

    /// The configuration that the run was started with, and the SHA-256 of its text.
    ///
    /// # Errors
    /// A configuration that was edited into nonsense, or is of another version.
    pub fn config(&self) -> Result<(Config, String)> {
        let path = self.path.join(CONFIG);
        let text =
            std::fs::read_to_string(&path).with_context(|| format!("cannot read {}", path.display()))?;
        let config =
            Config::parse_unchecked(&text, Profile::Quick).with_context(|| path.display().to_string())?;
        Ok((config, sha256_hex(text.as_bytes())))
    }

    /// The policy whose low level this run uses, if it trains none.
    ///
    /// # Errors
    /// A damaged file.
    pub fn borrowed_low(&self) -> Result<Option<Policy>> {
        self.kept_policy(&self.path.join(LOW))
    }

    pub(super) fn kept_policy(&self, path: &Path) -> Result<Option<Policy>> {
        if !path.exists() {
            return Ok(None);
        }
        Ok(Some(Checkpoint::load(path)?.value("policy")?))
    }

    /// Writes the trained policy.
    ///
    /// # Errors
    /// A folder that cannot be written.
    pub fn save_policy(&self, policy: &Policy) -> Result<()> {
        self.write_policy(POLICY, policy)
    }

    fn write_policy(&self, name: &str, policy: &Policy) -> Result<()> {
        let mut contents = Contents::new();
        contents.value("policy", policy).context("the policy cannot be serialised")?;
        let path = self.path.join(name);
        write_atomically(&path, |file| contents.write_to(policy.env_steps, file))
            .with_context(|| format!("cannot write {}", path.display()))
    }

    /// Reads the trained policy.
    ///
    /// # Errors
    /// A run that has not finished, or a damaged file.
    pub fn policy(&self) -> Result<Policy> {
        if let Some(reason) = self.failure() {
            bail!("the run {} was stopped for good: {reason}", self.path.display());
        }
        if !self.is_finished() {
            bail!(
                "the run {} has not finished: continue it with `trainer train --resume {0}`",
                self.path.display()
            );
        }
        Ok(Checkpoint::load(&self.policy_path())?.value("policy")?)
    }
}
