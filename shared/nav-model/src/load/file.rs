//! Reading a file that may be hostile: once, bounded, without following links out of its folder.

use nav_host::sha256::sha256_hex;
use std::ffi::OsStr;
use std::fs::OpenOptions;
use std::io::{self, Read};
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};

/// A file's bytes and the hash of exactly these bytes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FileBytes {
    /// The content.
    pub bytes: Vec<u8>,
    /// SHA-256 of `bytes`, as manifests write it.
    pub sha256: String,
}

/// Why a file was not read.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    /// It is missing, not permitted, or failed while being read.
    #[error("cannot read {}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The last part of the path is a symbolic link, out of its folder where it is a file of one.
    #[error("{} is a symbolic link to elsewhere; put the file itself there", path.display())]
    Link {
        /// The file.
        path: PathBuf,
    },
    /// It is a folder, a device, a pipe or a socket.
    #[error("{} is not a regular file", path.display())]
    NotAFile {
        /// The file.
        path: PathBuf,
    },
    /// It holds more bytes than the limit.
    #[error("{} is larger than {limit_bytes} bytes; a navigation policy is far smaller, check the path", path.display())]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// The most bytes that would have been read.
        limit_bytes: u64,
    },
}

/// Reads a file of a folder as [`read_file`] does; a link is followed where it stays within the folder, as in the volumes of
/// container orchestrators.
///
/// # Errors
/// As [`read_file`]; a link out of the folder is [`FileError::Link`].
pub fn read_file_in(folder: &Path, name: &str, limit_bytes: u64) -> Result<FileBytes, FileError> {
    let path = folder.join(name);
    if !path.is_symlink() {
        return read_file(&path, limit_bytes);
    }
    let real = |path: &Path| {
        path.canonicalize().map_err(|source| FileError::Io { path: path.to_path_buf(), source })
    };
    let target = real(&path)?;
    if !target.starts_with(real(folder)?) {
        return Err(FileError::Link { path });
    }
    read_file(&target, limit_bytes)
}

/// Reads a file that somebody named, as one of the folder that the name leads to: [`read_file_in`].
///
/// # Errors
/// As [`read_file_in`]; a name that is none of a file is [`FileError::NotAFile`].
pub fn read_named_file(path: &Path, limit_bytes: u64) -> Result<FileBytes, FileError> {
    let (Some(folder), Some(name)) = (path.parent(), path.file_name().and_then(OsStr::to_str)) else {
        return Err(FileError::NotAFile { path: path.to_path_buf() });
    };
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    read_file_in(folder, name, limit_bytes)
}

/// Reads at most `limit_bytes` of the regular file at `path`, once, and hashes what was read.
///
/// Whoever uses the result uses the bytes that were hashed: the file is not opened again.
///
/// # Errors
/// When it is no regular file, a link, too large, or cannot be read.
pub fn read_file(path: &Path, limit_bytes: u64) -> Result<FileBytes, FileError> {
    let at = || path.to_path_buf();
    let io = |source| FileError::Io { path: at(), source };
    // O_NONBLOCK so that opening a pipe does not wait for a writer.
    let flags = libc::O_NOFOLLOW | libc::O_CLOEXEC | libc::O_NONBLOCK;
    let file = match OpenOptions::new().read(true).custom_flags(flags).open(path) {
        Err(error) if error.raw_os_error() == Some(libc::ELOOP) => {
            return Err(FileError::Link { path: at() });
        }
        other => other.map_err(io)?,
    };
    let metadata = file.metadata().map_err(io)?;
    if !metadata.is_file() {
        return Err(FileError::NotAFile { path: at() });
    }
    let too_large = || FileError::TooLarge { path: at(), limit_bytes };
    if metadata.len() > limit_bytes {
        return Err(too_large());
    }
    let mut bytes = Vec::new();
    file.take(limit_bytes.saturating_add(1)).read_to_end(&mut bytes).map_err(io)?;
    // It may have grown since its length was asked for.
    if bytes.len() as u64 > limit_bytes {
        return Err(too_large());
    }
    let sha256 = sha256_hex(&bytes);
    Ok(FileBytes { bytes, sha256 })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_hashes_and_bounds() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("model");
        std::fs::write(&path, b"abc").unwrap();
        let file = read_file(&path, 3).unwrap();
        assert_eq!(file.bytes, b"abc");
        assert_eq!(file.sha256, sha256_hex(b"abc"));
        assert!(matches!(read_file(&path, 2), Err(FileError::TooLarge { limit_bytes: 2, .. })));
    }

    #[test]
    fn links_within_the_folder_are_followed_and_others_are_not() {
        let folder = tempfile::tempdir().unwrap();
        let outside = folder.path().join("secret");
        std::fs::write(&outside, b"secret").unwrap();
        // As a ConfigMap is mounted: td3.onnx -> ..data/td3.onnx, ..data -> ..2026.
        let volume = folder.path().join("volume");
        std::fs::create_dir_all(volume.join("..2026")).unwrap();
        std::fs::write(volume.join("..2026/td3.onnx"), b"abc").unwrap();
        std::os::unix::fs::symlink("..2026", volume.join("..data")).unwrap();
        std::os::unix::fs::symlink("..data/td3.onnx", volume.join("td3.onnx")).unwrap();
        assert_eq!(read_file_in(&volume, "td3.onnx", 10).unwrap().bytes, b"abc");
        assert_eq!(read_named_file(&volume.join("td3.onnx"), 10).unwrap().bytes, b"abc");
        assert!(matches!(read_named_file(Path::new("/"), 10), Err(FileError::NotAFile { .. })));
        std::os::unix::fs::symlink(&outside, volume.join("stolen")).unwrap();
        assert!(matches!(read_file_in(&volume, "stolen", 10), Err(FileError::Link { .. })));
        assert!(matches!(read_file_in(&volume, "none", 10), Err(FileError::Io { .. })));
    }

    #[test]
    fn links_folders_pipes_and_missing_files_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("model");
        std::fs::write(&path, b"abc").unwrap();
        let link = folder.path().join("link");
        std::os::unix::fs::symlink(&path, &link).unwrap();
        assert!(matches!(read_file(&link, 10), Err(FileError::Link { .. })));
        assert!(matches!(read_file(folder.path(), 10), Err(FileError::NotAFile { .. })));
        assert!(matches!(read_file(&folder.path().join("none"), 10), Err(FileError::Io { .. })));
        assert!(matches!(read_file(Path::new("/dev/zero"), 10), Err(FileError::NotAFile { .. })));
    }
}
