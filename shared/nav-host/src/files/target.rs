//! What a path leads to, before anything is written there.

use std::fs;
use std::io;
use std::os::unix::fs::FileTypeExt as _;
use std::path::{Path, PathBuf};

/// As many links in a row as Linux follows.
const LINKS_MAX: usize = 40;

/// Where bytes for a path go.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Target {
    /// Into a file of this path, which may not be there yet and is no link.
    File(PathBuf),
    /// Through this path into a pipe, a terminal or another device, or into what a process has open.
    Through(PathBuf),
}

impl Target {
    /// Follows links, also to what is not there yet.
    pub(super) fn of(path: &Path) -> io::Result<Self> {
        let mut path = path.to_owned();
        for _ in 0..LINKS_MAX {
            if path.file_name().is_none() && !path.is_dir() {
                return Err(refused("the path names no file"));
            }
            let kind = match fs::symlink_metadata(&path) {
                Ok(metadata) => metadata.file_type(),
                Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Self::File(path)),
                Err(error) => return Err(error),
            };
            if !kind.is_symlink() {
                return Self::of_kind(path, kind);
            }
            let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
            let folder = folder.unwrap_or(Path::new(".")).to_owned();
            if fs::canonicalize(&folder)?.starts_with("/proc") {
                // Such as /dev/stdout: what the link says need not be a path, and a file that is open must not be
                // replaced under whoever writes to it.
                let kind = fs::metadata(&path)?.file_type();
                return match Self::of_kind(path.clone(), kind)? {
                    Self::File(_) => Ok(Self::Through(path)),
                    through @ Self::Through(_) => Ok(through),
                };
            }
            path = folder.join(fs::read_link(&path)?);
        }
        Err(refused("it is a link that leads round in a circle"))
    }

    fn of_kind(path: PathBuf, kind: fs::FileType) -> io::Result<Self> {
        if kind.is_dir() {
            Err(io::ErrorKind::IsADirectory.into())
        } else if kind.is_socket() {
            Err(refused("it is a socket"))
        } else if kind.is_block_device() {
            Err(refused("it is a disk"))
        } else if kind.is_file() {
            Ok(Self::File(path))
        } else {
            Ok(Self::Through(path))
        }
    }
}

fn refused(why: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidInput, why)
}
