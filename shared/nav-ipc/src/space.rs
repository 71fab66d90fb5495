//! Room in shared memory. Its pages are only taken when they are first written, and where there are none left then, the
//! system ends the writer with SIGBUS. So room is looked for before anything is made, taken at once, and some is kept for
//! readers that join later.

use crate::config::IpcConfig;
use crate::error::IpcError;
use crate::leftovers::{SHARED_MEMORY, shared_files};
use std::cell::Cell;
use std::fs::{File, OpenOptions};
use std::os::fd::AsRawFd;
use std::os::unix::fs::{MetadataExt, OpenOptionsExt};

/// What a file takes at least, bytes.
const PAGE: u64 = 4096;
/// What a node needs, bytes.
pub(crate) const NODE: u64 = 4 * PAGE;
/// What a reader or a wake-up needs, with its services, bytes.
pub(crate) const READER: u64 = 8 * PAGE;
/// What a reader that joins a writer takes, or the other way round, bytes: the connection, and a page to spare.
const CONNECTION: u64 = 2 * PAGE;
/// Messages that a writer has room for: two in the queue and two in the hands of each of eight readers, two of its own.
const MESSAGES: u64 = 8 * (2 + 2) + 2;
/// A message's own head in shared memory, at most, bytes.
const HEAD: u64 = 128;

/// What a writer of messages of this size needs, with its services, bytes.
pub(crate) const fn writer(message_size: usize) -> u64 {
    READER + (MESSAGES * (message_size as u64 + HEAD)).next_multiple_of(PAGE)
}

/// Looks for room, without taking it. Does not allocate.
///
/// # Errors
/// [`IpcError::SharedMemoryFull`].
pub(crate) fn require(need: u64) -> Result<(), IpcError> {
    let free = free();
    if free < need {
        return Err(IpcError::SharedMemoryFull { need_kib: need.div_ceil(1024), free_kib: free / 1024 });
    }
    Ok(())
}

/// Free bytes; without a limit where none is known.
fn free() -> u64 {
    // SAFETY: a structure of numbers.
    let mut found: libc::statvfs = unsafe { std::mem::zeroed() };
    // SAFETY: a text with an end, and a structure to write to.
    let is_known = unsafe { libc::statvfs(c"/dev/shm".as_ptr(), &raw mut found) } == 0;
    if is_known && found.f_blocks > 0 { found.f_bavail * found.f_frsize } else { u64::MAX }
}

/// Takes all pages of a world's files.
///
/// # Errors
/// [`IpcError::SharedMemoryFull`] when there are not enough.
pub(crate) fn take(config: &IpcConfig) -> Result<(), IpcError> {
    for path in shared_files(config) {
        // What is gone meanwhile needs no room.
        let Ok(file) = OpenOptions::new().read(true).write(true).open(&path) else { continue };
        let Ok(metadata) = file.metadata() else { continue };
        let missing = metadata.len().next_multiple_of(PAGE).saturating_sub(metadata.blocks() * 512);
        if missing > 0 && !fill(&file, metadata.len()) {
            return Err(IpcError::SharedMemoryFull {
                need_kib: missing.div_ceil(1024),
                free_kib: free().min(missing - 1) / 1024,
            });
        }
    }
    Ok(())
}

/// Takes the pages of a file; false when there are not enough. Other failures are no reason not to try.
fn fill(file: &File, len: u64) -> bool {
    let len = libc::off_t::try_from(len).unwrap_or(libc::off_t::MAX);
    // SAFETY: an open file.
    unsafe { libc::posix_fallocate(file.as_raw_fd(), 0, len) != libc::ENOSPC }
}

/// The room of a port: what it may still need when others join, kept until then in a file without a name, which goes with
/// the process.
#[derive(Debug)]
pub(crate) struct Room {
    config: IpcConfig,
    kept: Option<File>,
    kept_len: u64,
    peers: Cell<usize>,
    is_new: Cell<bool>,
}

impl Room {
    /// Takes the pages of what was just made, and keeps some for `peers_max` that may join.
    ///
    /// # Errors
    /// [`IpcError::SharedMemoryFull`].
    pub(crate) fn take(config: &IpcConfig, peers_max: u64) -> Result<Self, IpcError> {
        take(config)?;
        let kept_len = peers_max * CONNECTION;
        let kept = OpenOptions::new()
            .read(true)
            .write(true)
            .custom_flags(libc::O_TMPFILE)
            .mode(0o600)
            .open(SHARED_MEMORY)
            .ok();
        if kept.as_ref().is_some_and(|file| !fill(file, kept_len)) {
            require(kept_len)?;
        }
        Ok(Self { config: config.clone(), kept, kept_len, peers: Cell::new(0), is_new: Cell::new(false) })
    }

    /// Before anything that connects to those who are there now: there must be room for those who joined. Does not
    /// allocate.
    ///
    /// # Errors
    /// [`IpcError::SharedMemoryFull`].
    pub(crate) fn expect(&self, peers: usize) -> Result<(), IpcError> {
        let joined = peers.saturating_sub(self.peers.get());
        if joined > 0 {
            let need = joined as u64 * CONNECTION;
            if require(need).is_err() {
                // Given back to the system, and taken again by what is made now.
                let _ = self.kept.as_ref().map(|file| file.set_len(0));
                require(need)?;
            }
            self.is_new.set(true);
        }
        self.peers.set(peers);
        Ok(())
    }

    /// After connecting: takes the pages of what was made, and keeps room again if there is any. Allocates when somebody
    /// joined.
    pub(crate) fn settle(&self) {
        if self.is_new.replace(false) {
            // A connection is one page, which has been written; other programs' files are theirs to care for.
            let _ = take(&self.config);
            let _ = self.kept.as_ref().map(|file| fill(file, self.kept_len));
        }
    }
}
