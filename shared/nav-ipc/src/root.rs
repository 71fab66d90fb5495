//! The folder of a world: owned by this user, written by nobody else, and locked while a program opens something in it.

use crate::error::IpcError;
use crate::user;
use std::fs::{self, DirBuilder, File, OpenOptions};
use std::io::{Read, Seek, Write};
use std::os::fd::AsRawFd;
use std::os::unix::fs::{DirBuilderExt, MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// The file that is locked while a program opens or makes something.
const LOCK_FILE: &str = "start.lock";
/// How long another program's start may take. Its own waits are of about a second each.
const START_WAIT: Duration = Duration::from_secs(20);
/// Between two looks at the lock.
const GLANCE: Duration = Duration::from_millis(1);

/// A folder that was found to be ours.
#[derive(Debug, Clone)]
pub(crate) struct Root {
    folder: PathBuf,
}

/// Held while something is opened: no other program of ours makes anything in this folder meanwhile.
#[derive(Debug)]
pub(crate) struct Starting {
    // Closing it gives the lock back, also when the process is killed.
    _file: File,
}

impl Root {
    /// Makes the folder (mode 0700) unless it is there, and looks whose it is.
    ///
    /// # Errors
    /// [`IpcError::Node`] when it cannot be made, [`IpcError::ForeignRoot`], [`IpcError::SharedRoot`].
    pub(crate) fn claim(folder: &Path) -> Result<Self, IpcError> {
        let failed =
            |error: std::io::Error| IpcError::Node { root: folder.to_owned(), reason: error.to_string() };
        // Whose it is, is said better below.
        let made = DirBuilder::new().recursive(true).mode(0o700).create(folder);
        let found = fs::symlink_metadata(folder).map_err(|error| failed(made.err().unwrap_or(error)))?;
        if found.uid() != user::id() {
            let (owner, us) = (user::name(found.uid()), user::name(user::id()));
            return Err(IpcError::ForeignRoot { root: folder.to_owned(), owner, us });
        }
        if !found.is_dir() || found.mode() & 0o022 != 0 {
            return Err(IpcError::SharedRoot { root: folder.to_owned() });
        }
        Ok(Self { folder: folder.to_owned() })
    }

    /// Waits until no other program is starting here.
    ///
    /// # Errors
    /// [`IpcError::Starting`] when another one does not get on, [`IpcError::Node`] when the lock cannot be had.
    pub(crate) fn start(&self) -> Result<Starting, IpcError> {
        let failed =
            |error: std::io::Error| IpcError::Node { root: self.folder.clone(), reason: error.to_string() };
        let mut file = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .mode(0o600)
            .open(self.folder.join(LOCK_FILE))
            .map_err(failed)?;
        let began = Instant::now();
        // SAFETY: the descriptor is open.
        while unsafe { libc::flock(file.as_raw_fd(), libc::LOCK_EX | libc::LOCK_NB) } != 0 {
            let error = std::io::Error::last_os_error();
            if error.kind() != std::io::ErrorKind::WouldBlock {
                return Err(failed(error));
            }
            if began.elapsed() > START_WAIT {
                let mut holder = String::new();
                // Who it is helps; that it is there is known without.
                let _ = file.read_to_string(&mut holder);
                return Err(IpcError::Starting {
                    root: self.folder.clone(),
                    holder: holder.trim().to_owned(),
                });
            }
            std::thread::sleep(GLANCE);
        }
        // For whoever waits in vain; the lock holds without.
        let _ = file.set_len(0).and_then(|()| file.rewind());
        let _ = writeln!(file, "{}", std::process::id());
        Ok(Starting { _file: file })
    }
}
