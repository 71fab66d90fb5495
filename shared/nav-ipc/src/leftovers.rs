//! What processes leave that were killed while they made it: iceoryx2 would wait for it to be finished, for a file
//! without a size for ever.
//!
//! Everything here is called while the folder is locked ([`crate::root::Root::start`]), so that no other program of ours
//! is making a service. Programs of other languages do not take that lock. What they make is recognised by being finished
//! within moments, or by being open in a process.

use crate::config::IpcConfig;
use crate::error::IpcError;
use std::fs::{self, Metadata, OpenOptions};
use std::io::Write;
use std::os::unix::fs::{MetadataExt, OpenOptionsExt, PermissionsExt};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Where shared memory shows as files.
pub(crate) const SHARED_MEMORY: &str = "/dev/shm";
/// Making a file takes microseconds; one that is half made for this long is left by somebody.
const MAKING: Duration = Duration::from_millis(100);
/// Between two looks.
const GLANCE: Duration = Duration::from_millis(5);

/// The name after the prefix of the one file that iceoryx2 opens to every user (mode 0666): a counter of nodes. Its type,
/// as SHA-1, and the version are part of it.
const COUNTER_NAME: &str = "9204dd183d1c4d8e1ff592a30766ffa6765aa8b5_node.0_10_0.global_mgmt";
/// What is in it: the version (0.10.0, 16 bits each), and how many nodes there have been.
const COUNTER: [u8; 16] = [0, 0, 10, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0];

/// The shared memory of a world.
pub(crate) fn shared_files(config: &IpcConfig) -> impl Iterator<Item = PathBuf> {
    let entries = fs::read_dir(SHARED_MEMORY).into_iter().flatten().flatten();
    let prefix = config.prefix().to_owned();
    entries
        .filter(move |entry| entry.file_name().as_encoded_bytes().starts_with(prefix.as_bytes()))
        .map(|entry| entry.path())
}

/// Removes what is half made and nobody's.
///
/// # Errors
/// [`IpcError::HalfMade`] when a process that lives does not get on, or the file cannot be removed;
/// [`IpcError::ForeignFile`] when another user has put a file in our way.
pub(crate) fn remove_half_made(config: &IpcConfig) -> Result<(), IpcError> {
    let mut found = half_made(config)?;
    let began = Instant::now();
    while !found.is_empty() && began.elapsed() < MAKING {
        std::thread::sleep(GLANCE);
        let still = half_made(config)?;
        found.retain(|path| still.contains(path));
    }
    for path in found {
        let holder = holder(&path);
        if holder.is_some() || fs::remove_file(&path).is_err() && path.exists() {
            return Err(is_half_made(path));
        }
    }
    Ok(())
}

fn half_made(config: &IpcConfig) -> Result<Vec<PathBuf>, IpcError> {
    let mut found = Vec::new();
    let mut add = |path: PathBuf, is_half_made: fn(&Metadata) -> bool| {
        // What is gone meanwhile is nobody's trouble.
        let Ok(metadata) = fs::symlink_metadata(&path) else { return Ok(()) };
        if metadata.uid() != crate::user::id() {
            return Err(IpcError::ForeignFile { owner: crate::user::name(metadata.uid()), path });
        }
        if is_half_made(&metadata) {
            found.push(path);
        }
        Ok(())
    };
    // Shared memory becomes readable when it is finished, a service's description read-only.
    for path in shared_files(config) {
        add(path, |metadata| metadata.len() == 0 || metadata.mode() & 0o400 == 0)?;
    }
    for entry in fs::read_dir(config.root().join("services")).into_iter().flatten().flatten() {
        add(entry.path(), |metadata| metadata.is_file() && metadata.mode() & 0o200 != 0)?;
    }
    Ok(found)
}

/// That a file of a loop that runs is half made, and by whom.
pub(crate) fn is_half_made(path: PathBuf) -> IpcError {
    IpcError::HalfMade { holder: holder(&path).unwrap_or_else(|| "nobody".to_owned()), path }
}

/// A process that has the file open, if one can be seen that has.
fn holder(path: &Path) -> Option<String> {
    let name = path.to_string_lossy();
    let holds = |process: &Path| {
        let maps = fs::read_to_string(process.join("maps")).unwrap_or_default();
        let descriptors = fs::read_dir(process.join("fd")).into_iter().flatten().flatten();
        maps.lines().any(|line| line.ends_with(&*name))
            || descriptors.filter_map(|entry| fs::read_link(entry.path()).ok()).any(|link| link == path)
    };
    let processes = fs::read_dir("/proc").into_iter().flatten().flatten();
    processes
        .filter_map(|entry| Some((entry.file_name().to_str()?.parse::<u32>().ok()?, entry.path())))
        .find(|(_, process)| holds(process))
        .map(|(id, _)| format!("process {id}"))
}

/// Makes the counter of nodes before iceoryx2 does, for this user alone; one that is open to others is closed to them.
///
/// # Errors
/// [`IpcError::Node`] when it cannot be made.
pub(crate) fn secure_counter(config: &IpcConfig) -> Result<(), IpcError> {
    let failed = |error: std::io::Error| IpcError::Node { root: config.root(), reason: error.to_string() };
    let path = Path::new(SHARED_MEMORY).join(format!("{}{COUNTER_NAME}", config.prefix()));
    match fs::symlink_metadata(&path) {
        Ok(found) if found.mode() & 0o077 != 0 => {
            fs::set_permissions(&path, fs::Permissions::from_mode(0o600)).map_err(failed)
        }
        Ok(_) => Ok(()),
        Err(_) => {
            // Aside, and renamed: it is never seen half made.
            let aside = Path::new(SHARED_MEMORY).join(format!("{}{}", config.prefix(), std::process::id()));
            // Of a process of the same number, killed here.
            let _ = fs::remove_file(&aside);
            let mut file =
                OpenOptions::new().write(true).create_new(true).mode(0o600).open(&aside).map_err(failed)?;
            file.write_all(&COUNTER).map_err(failed)?;
            fs::rename(&aside, &path).map_err(failed)
        }
    }
}
