//! Pipes and devices: written through, with patience for whoever reads, but not for ever.

use std::ffi::CString;
use std::fs::{File, OpenOptions};
use std::io::{self, BufWriter, Read, Seek, Write};
use std::os::fd::{AsRawFd, FromRawFd};
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;
use std::time::{Duration, Instant};

/// For so long a pipe may have no reader, or one that takes nothing.
const PATIENCE: Duration = Duration::from_secs(5);

/// Whether we may write there.
pub(super) fn check(path: &Path) -> io::Result<()> {
    let path = CString::new(path.as_os_str().as_bytes())?;
    // SAFETY: only asks, about a path that ends with a zero.
    match unsafe { libc::faccessat(libc::AT_FDCWD, path.as_ptr(), libc::W_OK, libc::AT_EACCESS) } {
        0 => Ok(()),
        _ => Err(io::Error::last_os_error()),
    }
}

/// Collects all bytes in memory, then sends them.
pub(super) fn write(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> io::Result<()> {
    let mut buffered = BufWriter::new(in_memory()?);
    write(&mut buffered)?;
    buffered.flush()?;
    let mut file = buffered.into_inner().map_err(io::IntoInnerError::into_error)?;
    file.rewind()?;
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes)?;
    send(&open(path, PATIENCE)?, &bytes, PATIENCE)
}

/// A file that nobody else sees.
fn in_memory() -> io::Result<File> {
    // SAFETY: a name that ends with a zero.
    let descriptor = unsafe { libc::memfd_create(c"report".as_ptr(), libc::MFD_CLOEXEC) };
    if descriptor < 0 {
        return Err(io::Error::last_os_error());
    }
    // SAFETY: it is new and nobody else's.
    Ok(unsafe { File::from_raw_fd(descriptor) })
}

/// Opens for writing, once a pipe has a reader.
fn open(path: &Path, patience: Duration) -> io::Result<File> {
    let started = Instant::now();
    loop {
        let opened = OpenOptions::new()
            .append(true)
            .custom_flags(libc::O_NONBLOCK | libc::O_NOCTTY | libc::O_CLOEXEC)
            .open(path);
        match opened {
            Err(error) if error.raw_os_error() == Some(libc::ENXIO) => {
                if started.elapsed() >= patience {
                    return Err(nobody());
                }
                std::thread::sleep(Duration::from_millis(20));
            }
            opened => return opened,
        }
    }
}

fn send(mut file: &File, mut bytes: &[u8], patience: Duration) -> io::Result<()> {
    while !bytes.is_empty() {
        match file.write(bytes) {
            Ok(0) => return Err(io::ErrorKind::WriteZero.into()),
            Ok(count) => bytes = &bytes[count..],
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => wait(file, patience)?,
            Err(error) => return Err(error),
        }
    }
    Ok(())
}

/// Waits until something can be written.
fn wait(file: &File, patience: Duration) -> io::Result<()> {
    let mut asked = libc::pollfd { fd: file.as_raw_fd(), events: libc::POLLOUT, revents: 0 };
    let milliseconds = i32::try_from(patience.as_millis()).unwrap_or(i32::MAX);
    // SAFETY: one valid descriptor, for the time of the call.
    match unsafe { libc::poll(&raw mut asked, 1, milliseconds) } {
        0 => Err(nobody()),
        // Whatever it is, the next write finds it.
        _ => Ok(()),
    }
}

fn nobody() -> io::Error {
    io::Error::new(io::ErrorKind::TimedOut, "nobody reads from it")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reader_that_takes_nothing_is_not_waited_for_for_ever() {
        let mut ends = [0; 2];
        // SAFETY: room for both ends.
        assert_eq!(unsafe { libc::pipe2(ends.as_mut_ptr(), libc::O_NONBLOCK) }, 0);
        // SAFETY: both are new and nobody else's.
        let [_read, write] = ends.map(|end| unsafe { File::from_raw_fd(end) });
        let error = send(&write, &vec![0; 1 << 21], Duration::from_millis(50)).expect_err("it is full");
        assert_eq!(error.to_string(), "nobody reads from it");
    }

    #[test]
    fn a_pipe_without_a_reader_is_told() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("pipe");
        super::super::tests::make_pipe(&path);
        let error = open(&path, Duration::from_millis(50)).expect_err("nobody is there");
        assert_eq!(error.to_string(), "nobody reads from it");
    }
}
