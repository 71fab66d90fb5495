//! Programs that keep every core busy.

use super::child::Bound;
use std::io;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// The hidden subcommand that a hog runs.
pub const SUBCOMMAND: &str = "loop-hog";

/// Running hogs; they end when dropped, or by themselves soon after the phase.
#[derive(Debug)]
pub struct Hogs {
    _running: Vec<Bound>,
}

impl Hogs {
    /// So many hogs, for a phase of this length.
    ///
    /// # Errors
    /// This program cannot be started again.
    pub fn start(count: usize, phase: Duration) -> io::Result<Self> {
        let program = std::env::current_exe()?;
        // Long enough for loading the model and for the phase, short enough never to be found tomorrow.
        let seconds = phase.as_secs() + 30;
        let start = |_| {
            let mut command = Command::new(&program);
            command.arg(SUBCOMMAND).arg(seconds.to_string()).stdin(Stdio::null());
            Bound::spawn(&mut command)
        };
        Ok(Self { _running: (0..count).map(start).collect::<io::Result<_>>()? })
    }
}

/// What a hog does: compute, without a system call, until its time is over.
pub fn hog(seconds: u64) {
    let started = Instant::now();
    let mut state = 1_u64;
    while started.elapsed() < Duration::from_secs(seconds) {
        for _ in 0..1_000_000 {
            state = std::hint::black_box(state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1));
        }
    }
}
