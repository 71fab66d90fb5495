//! Asked to end: by a signal, or by the program itself.

use signal_hook::consts::{SIGHUP, SIGINT, SIGQUIT, SIGTERM};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Which signal asked, if any; cheap to look at in every tick.
#[derive(Clone, Debug, Default)]
pub struct Stop(Arc<AtomicUsize>);

/// Who asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StopReason {
    /// SIGINT: a person at the terminal.
    Interrupt,
    /// SIGTERM: a service manager; or SIGHUP, SIGQUIT.
    Terminate,
}

impl Stop {
    /// Takes over SIGINT, SIGTERM, and like it SIGHUP (the terminal is gone; unless `nohup` ignores it) and SIGQUIT.
    ///
    /// # Errors
    /// The operating system refuses.
    pub fn install() -> std::io::Result<Self> {
        let stop = Self::default();
        for (signal, value) in [(SIGINT, 1), (SIGTERM, 2), (SIGHUP, 2), (SIGQUIT, 2)] {
            if signal == SIGHUP && is_ignored(signal) {
                continue;
            }
            signal_hook::flag::register_usize(signal, stop.0.clone(), value)?;
        }
        Ok(stop)
    }

    /// Whether and why to end.
    pub fn reason(&self) -> Option<StopReason> {
        match self.0.load(Ordering::Relaxed) {
            0 => None,
            1 => Some(StopReason::Interrupt),
            _ => Some(StopReason::Terminate),
        }
    }

    /// Asks as SIGTERM would.
    pub fn request(&self) {
        self.0.store(2, Ordering::Relaxed);
    }
}

fn is_ignored(signal: libc::c_int) -> bool {
    // SAFETY: a sigaction is plain bits.
    let mut action: libc::sigaction = unsafe { std::mem::zeroed() };
    // SAFETY: only asks, into a valid place.
    let status = unsafe { libc::sigaction(signal, std::ptr::null(), &raw mut action) };
    status == 0 && action.sa_sigaction == libc::SIG_IGN
}
