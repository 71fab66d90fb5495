//! Processes of the measurement, which do not outlive it.

use std::io;
use std::os::unix::process::CommandExt;
use std::process::{Child, Command, Output};

/// A running process: killed when dropped, and by the kernel when the thread that started it is gone.
#[derive(Debug)]
pub(super) struct Bound(Option<Child>);

impl Bound {
    pub(super) fn spawn(command: &mut Command) -> io::Result<Self> {
        let parent = std::process::id();
        let bind = move || {
            // SAFETY: both calls take numbers only and may be made between fork and exec.
            let (status, parent_now) =
                unsafe { (libc::prctl(libc::PR_SET_PDEATHSIG, libc::SIGKILL), libc::getppid()) };
            match status {
                // It ended before it could be bound to.
                0 if parent_now.unsigned_abs() != parent => Err(io::ErrorKind::BrokenPipe.into()),
                0 => Ok(()),
                _ => Err(io::Error::last_os_error()),
            }
        };
        // SAFETY: `bind` neither allocates nor locks.
        let child = unsafe { command.pre_exec(bind) }.spawn()?;
        Ok(Self(Some(child)))
    }

    /// Waits for its end and what it wrote.
    pub(super) fn finish(mut self) -> io::Result<Output> {
        self.0.take().map_or_else(|| Err(io::ErrorKind::NotFound.into()), Child::wait_with_output)
    }
}

impl Drop for Bound {
    fn drop(&mut self) {
        if let Some(child) = &mut self.0 {
            // It may have ended by itself.
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn is_alive(id: u32) -> bool {
        std::path::Path::new(&format!("/proc/{id}")).exists()
    }

    fn sleeper() -> Bound {
        Bound::spawn(Command::new("sleep").arg("60")).expect("sleep starts")
    }

    fn id(bound: &Bound) -> u32 {
        bound.0.as_ref().expect("running").id()
    }

    #[test]
    fn it_ends_when_dropped() {
        let sleeper = sleeper();
        let id = id(&sleeper);
        assert!(is_alive(id));
        drop(sleeper);
        assert!(!is_alive(id));
    }

    #[test]
    fn it_ends_with_the_thread_that_started_it() {
        let mut orphan = std::thread::spawn(sleeper).join().expect("no panic");
        let status = orphan.0.as_mut().expect("running").wait().expect("waited for");
        assert!(!status.success(), "killed, not slept out: {status}");
    }
}
