//! Files that are either whole or as they were before.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// Writes `path` through a temporary file beside it: write, flush to the disk, rename, flush the folder. A
/// crash, a full disk or a pulled plug leaves the previous file as it was.
///
/// # Errors
/// Whatever the file system or `write` says; the temporary file is then gone.
pub fn write_atomically(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> io::Result<()> {
    let temporary = temporary_path(path)?;
    let result = write_through(&temporary, write).and_then(|()| fs::rename(&temporary, path));
    if result.is_err() {
        // The first error is the one to report; a temporary file that cannot be removed is harmless.
        let _ = fs::remove_file(&temporary);
        return result;
    }
    sync_folder(path)
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
/// The folder cannot be made or written, or `path` is one itself.
pub fn check_writable(path: &Path) -> io::Result<()> {
    if let Some(folder) = path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
        fs::create_dir_all(folder)?;
    }
    if path.is_dir() {
        return Err(io::ErrorKind::IsADirectory.into());
    }
    let temporary = temporary_path(path)?;
    File::create(&temporary)?;
    fs::remove_file(&temporary)
}

/// Where `path` is written before it is renamed.
fn temporary_path(path: &Path) -> io::Result<PathBuf> {
    let Some(name) = path.file_name() else {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "the path names no file"));
    };
    Ok(path.with_file_name(format!(".{}.tmp", name.to_string_lossy())))
}

fn write_through(path: &Path, write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>) -> io::Result<()> {
    let mut file = BufWriter::with_capacity(1 << 20, File::create(path)?);
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
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_leaves_the_previous_file_and_no_rubbish() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("policy.onnx");
        replace(&path, b"first").expect("the first write");
        let full = |file: &mut BufWriter<File>| {
            file.write_all(b"half")?;
            Err(io::Error::from(io::ErrorKind::StorageFull))
        };
        let error = write_atomically(&path, full).expect_err("the disk is full");
        assert_eq!(error.kind(), io::ErrorKind::StorageFull);
        assert_eq!(fs::read(&path).expect("the file is there"), b"first");
        assert_eq!(fs::read_dir(folder.path()).expect("the folder is there").count(), 1);
        replace(&path, b"second").expect("the second write");
        assert_eq!(fs::read(&path).expect("the file is there"), b"second");
    }

    #[test]
    fn what_cannot_be_written_is_known_before() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("reports").join("a.json");
        check_writable(&path).expect("its folder is made");
        assert_eq!(fs::read_dir(folder.path().join("reports")).expect("there now").count(), 0);
        let error = check_writable(folder.path()).expect_err("a folder is no file");
        assert_eq!(error.kind(), io::ErrorKind::IsADirectory);
        replace(&path, b"{}").expect("written");
        assert!(check_writable(&path.join("below.json")).is_err(), "a file is no folder");
        check_writable(&path).expect("it may be replaced");
        assert_eq!(fs::read(&path).expect("the file is there"), b"{}", "and is not yet");
    }
}
