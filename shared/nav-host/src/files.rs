//! Files that are either whole or as they were before.
//!
//! A path may be more than a file's: a link is kept and what it leads to is written, and pipes and devices are written
//! through. Folders, sockets and disks are refused.

mod target;
mod through;

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use target::Target;

/// Writes `path` through a temporary file of a new name beside it: write, flush to the disk, rename, flush the folder. A
/// crash, a full disk or a pulled plug leaves the previous file as it was. What is no file gets the same bytes once they
/// are complete.
///
/// # Errors
/// Whatever the file system or `write` says; the temporary file is then gone. A pipe that nobody reads is an error too.
pub fn write_atomically(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> io::Result<()> {
    let path = match Target::of(path)? {
        Target::File(path) => path,
        Target::Through(path) => return through::write(&path, write),
    };
    let (temporary, file) = new_beside(&path)?;
    let result = like_the_old(&path, &file)
        .and_then(|()| write_whole(file, write))
        .and_then(|()| fs::rename(&temporary, &path));
    if result.is_err() {
        // The first error is the one to report; a temporary file that cannot be removed is harmless.
        let _ = fs::remove_file(&temporary);
        return result;
    }
    sync_folder(&path)
}

/// Writes a file of these bytes, whole or not at all; see [`write_atomically`].
///
/// # Errors
/// Whatever the file system says.
pub fn replace(path: &Path, bytes: impl AsRef<[u8]>) -> io::Result<()> {
    write_atomically(path, |file| file.write_all(bytes.as_ref()))
}

/// Whether `path` can be written later; makes its folder, and leaves nothing else behind.
///
/// # Errors
/// The folder cannot be made or written, or `path` is a folder, a socket or a disk, or a pipe or device that must not
/// be written.
pub fn check_writable(path: &Path) -> io::Result<()> {
    let path = match Target::of(path)? {
        Target::File(path) => path,
        // Not opened: whoever reads a pipe would take our closing it for the end.
        Target::Through(path) => return through::check(&path),
    };
    if let Some(folder) = path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
        fs::create_dir_all(folder)?;
    }
    let (temporary, _) = new_beside(&path)?;
    fs::remove_file(&temporary)
}

/// A new file in the folder of `path`, under a name that nobody had: `.NAME.PROCESS-NUMBER.tmp`.
fn new_beside(path: &Path) -> io::Result<(PathBuf, File)> {
    static NUMBER: AtomicU64 = AtomicU64::new(0);
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    loop {
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let temporary = path.with_file_name(format!(".{name}.{}-{number}.tmp", std::process::id()));
        match File::create_new(&temporary) {
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
            made => return made.map(|file| (temporary, file)),
        }
    }
}

/// Gives a new file the permissions of the one that it will replace, if there is one.
fn like_the_old(path: &Path, file: &File) -> io::Result<()> {
    match fs::metadata(path) {
        Ok(old) => file.set_permissions(old.permissions()),
        Err(_) => Ok(()),
    }
}

fn write_whole(file: File, write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>) -> io::Result<()> {
    let mut file = BufWriter::with_capacity(1 << 20, file);
    write(&mut file)?;
    file.flush()?;
    file.get_ref().sync_all()
}

fn sync_folder(path: &Path) -> io::Result<()> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    // Only where a folder can be opened as a file; elsewhere the rename is as durable as it gets.
    if cfg!(unix) { File::open(folder.unwrap_or(Path::new(".")))?.sync_all() } else { Ok(()) }
}

#[cfg(test)]
mod tests;
