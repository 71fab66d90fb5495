//! Ctrl-C and SIGTERM: a program finishes what it is at, saves, and says so. A second one ends it at once.

use anyhow::{Context, Result};
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Whether somebody asked the program to stop.
#[derive(Clone, Debug, Default)]
pub struct StopRequest {
    signal: Arc<AtomicUsize>,
}

impl StopRequest {
    /// Listens to SIGINT and SIGTERM from now on.
    ///
    /// # Errors
    /// A system that refuses signal handlers.
    pub fn listen() -> Result<Self> {
        let request = Self::default();
        for signal in [SIGINT, SIGTERM] {
            let armed = Arc::new(AtomicBool::new(false));
            // Order matters: the second signal finds the flag set by the first.
            flag::register_conditional_shutdown(signal, 128 + signal, armed.clone())
                .and_then(|_| flag::register(signal, armed))
                .and_then(|_| flag::register_usize(signal, request.signal.clone(), signal as usize))
                .context("cannot listen to signals")?;
        }
        Ok(request)
    }

    /// The exit code (130 or 143) that the request asks for, if there was one.
    pub fn exit_code(&self) -> Option<u8> {
        match self.signal.load(Ordering::Relaxed) {
            0 => None,
            signal => Some((128 + signal) as u8),
        }
    }
}
