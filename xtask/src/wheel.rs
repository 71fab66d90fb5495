//! Fetching a pinned Python wheel, verified, for the shared libraries inside it.

use std::fs::{self, File};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};
use sha2::{Digest, Sha256};

use crate::shell::{have, remove_folder, run_quiet, say, size_mb, tools};

/// One wheel, fixed by name, version and content.
pub(crate) struct Wheel {
    /// Name on the package index.
    pub name: &'static str,
    /// Exact version.
    pub version: &'static str,
    /// Platform tag it was built for, as pip spells it.
    pub platform: &'static str,
    /// Digest of the file, in hexadecimal.
    pub sha256: &'static str,
    /// Size of the file, for the progress line, MB.
    pub size_mb: u64,
}

impl Wheel {
    /// Downloads the wheel into `folder` (emptied first), or takes it from `local`, and verifies it.
    pub(crate) fn fetch(&self, folder: &Path, local: Option<&Path>) -> Result<PathBuf> {
        let path = match local {
            Some(path) => path.to_path_buf(),
            None => self.download(folder)?,
        };
        let found = sha256_of(&path)?;
        if found != self.sha256 {
            bail!(
                "{} has sha256 {found}, but {} {} must have {}; remove it and fetch it again",
                path.display(),
                self.name,
                self.version,
                self.sha256
            );
        }
        Ok(path)
    }

    fn download(&self, folder: &Path) -> Result<PathBuf> {
        remove_folder(folder)?;
        fs::create_dir_all(folder).with_context(|| format!("could not create {}", folder.display()))?;
        let wanted = folder.join("requirements.txt");
        let mut file = File::create(&wanted)?;
        writeln!(file, "{}=={} --hash=sha256:{}", self.name, self.version, self.sha256)?;
        let what = format!("the download of {} {} ({} MB)", self.name, self.version, self.size_mb);
        say(&what);
        run_quiet(
            pip()?
                .args(["download", "--no-deps", "--only-binary=:all:", "--require-hashes"])
                .args(["--python-version", "3.11", "--implementation", "cp", "--abi", "cp311"])
                .args(["--platform", self.platform, "--no-cache-dir", "--progress-bar", "off"])
                .args(["--disable-pip-version-check", "--quiet"])
                .arg("--requirement")
                .arg(&wanted)
                .arg("--dest")
                .arg(folder)
                // A small /tmp must not matter, and the growth of this folder is the progress.
                .env("TMPDIR", folder),
            &what,
            |_| say(&format!("  {} of {} MB", size_mb(folder).min(self.size_mb), self.size_mb)),
        )
        .context("check the network, or the package index pip is set to, and run this again")?;
        let found = fs::read_dir(folder)?
            .flatten()
            .map(|entry| entry.path())
            .find(|path| path.extension().is_some_and(|extension| extension == "whl"));
        found.with_context(|| format!("pip ended well but left no wheel of {}", self.name))
    }
}

/// Unpacks the members of a wheel that start with one of `prefixes` into `folder`.
///
/// Python unpacks: a wheel is a zip file, and python is here anyway because pip is.
pub(crate) fn unpack(wheel: &Path, prefixes: &[&str], folder: &Path) -> Result<()> {
    const SCRIPT: &str = "\
import sys, zipfile
wheel, folder, prefixes = sys.argv[1], sys.argv[2], tuple(sys.argv[3:])
with zipfile.ZipFile(wheel) as archive:
    archive.extractall(folder, [n for n in archive.namelist() if n.startswith(prefixes)])
";
    let mut python = Command::new("python3");
    python.args(["-c", SCRIPT]).arg(wheel).arg(folder).args(prefixes);
    run_quiet(&mut python, &format!("unpacking {}", wheel.display()), |since| {
        say(&format!("  {} s", since.as_secs()));
    })?;
    Ok(())
}

/// A pip that works: of this machine's python3, or, failing that, of an environment of our own.
pub(crate) fn pip() -> Result<Command> {
    let of = |python: &Path| {
        let mut command = Command::new(python);
        command.args(["-m", "pip"]);
        command
    };
    let system = Path::new("python3");
    if !have(system, &["--version"]) {
        bail!(
            "python3 is not installed; install it together with pip (on Debian: apt-get install python3-pip)"
        );
    }
    if have(system, &["-m", "pip", "--version"]) {
        return Ok(of(system));
    }
    let own = tools().join("pip");
    let python = own.join("bin/python3");
    if !have(&python, &["-m", "pip", "--version"]) {
        remove_folder(&own)?;
        let made = Command::new(system).args(["-m", "venv"]).arg(&own).output();
        if !made.is_ok_and(|made| made.status.success()) {
            remove_folder(&own)?;
            bail!(
                "python3 has no pip; install it (on Debian: apt-get install python3-pip) and run this again"
            );
        }
    }
    Ok(of(&python))
}

fn sha256_of(path: &Path) -> Result<String> {
    let mut file = File::open(path).with_context(|| format!("could not open {}", path.display()))?;
    let mut digest = Sha256::new();
    let mut buffer = vec![0_u8; 1 << 20];
    loop {
        let count = file.read(&mut buffer).with_context(|| format!("could not read {}", path.display()))?;
        if count == 0 {
            break;
        }
        digest.update(&buffer[..count]);
    }
    Ok(digest.finalize().iter().map(|byte| format!("{byte:02x}")).collect())
}
