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
    /// Takes over SIGINT, SIGTERM, and like it SIGHUP (the terminal is gone) and SIGQUIT.
    ///
    /// # Errors
    /// The operating system refuses.
    pub fn install() -> std::io::Result<Self> {
        let stop = Self::default();
        for (signal, value) in [(SIGINT, 1), (SIGTERM, 2), (SIGHUP, 2), (SIGQUIT, 2)] {
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
