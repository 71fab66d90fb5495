//! Asked to end: by a signal, or by the program itself.

use signal_hook::consts::{SIGHUP, SIGINT, SIGQUIT, SIGTERM};
use std::fmt;
use std::io;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, OnceLock};

/// The signals that ask a program to end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Signal {
    /// SIGHUP: the terminal is gone.
    Hangup = 1,
    /// SIGINT: Ctrl-C.
    Interrupt = 2,
    /// SIGQUIT: Ctrl-\.
    Quit = 3,
    /// SIGTERM: a service manager.
    Terminate = 15,
}

impl Signal {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Hangup, Self::Interrupt, Self::Quit, Self::Terminate];

    /// Its number, as the system knows it.
    pub const fn number(self) -> i32 {
        match self {
            Self::Hangup => SIGHUP,
            Self::Interrupt => SIGINT,
            Self::Quit => SIGQUIT,
            Self::Terminate => SIGTERM,
        }
    }
}

impl fmt::Display for Signal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Hangup => "the terminal is gone",
            Self::Interrupt => "interrupted",
            Self::Quit => "asked to quit",
            Self::Terminate => "asked to terminate",
        })
    }
}

/// What a second signal does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Second {
    /// Ends the process at once: what it was finishing is not worth more than the person's time.
    EndsAtOnce,
    /// Nothing: a robot is being brought to a stand.
    IsIgnored,
}

/// Set by the first signal that anybody in this process listens to.
static ASKED: OnceLock<Arc<AtomicBool>> = OnceLock::new();

/// Whether a signal that somebody listens to has asked this process to end.
pub(crate) fn is_asked() -> bool {
    ASKED.get().is_some_and(|asked| asked.load(Ordering::Relaxed))
}

/// Which signal asked first, if any; cheap to look at in every tick.
#[derive(Clone, Debug, Default)]
pub struct Stop(Arc<AtomicUsize>);

impl Stop {
    /// Takes over SIGHUP (unless `nohup` had it ignored), SIGINT, SIGQUIT and SIGTERM.
    ///
    /// # Errors
    /// The operating system refuses.
    pub fn listen(second: Second) -> io::Result<Self> {
        let stop = Self::default();
        let asked = Arc::new(AtomicBool::new(false));
        for signal in Signal::ALL {
            let number = signal.number();
            if signal == Signal::Hangup && is_ignored(number) {
                continue;
            }
            if second == Second::EndsAtOnce {
                // Order matters: a second signal finds the flag that the first one set.
                signal_hook::flag::register_conditional_shutdown(number, 128 + number, asked.clone())?;
                signal_hook::flag::register(number, asked.clone())?;
            }
            signal_hook::flag::register(number, ASKED.get_or_init(Arc::default).clone())?;
            signal_hook::flag::register_usize(number, stop.0.clone(), signal as usize)?;
        }
        Ok(stop)
    }

    /// The newest signal, if any came.
    pub fn signal(&self) -> Option<Signal> {
        let asked = self.0.load(Ordering::Relaxed);
        Signal::ALL.into_iter().find(|signal| *signal as usize == asked)
    }
}

fn is_ignored(signal: libc::c_int) -> bool {
    // SAFETY: a sigaction is plain bits.
    let mut action: libc::sigaction = unsafe { std::mem::zeroed() };
    // SAFETY: only asks, into a valid place.
    let status = unsafe { libc::sigaction(signal, std::ptr::null(), &raw mut action) };
    status == 0 && action.sa_sigaction == libc::SIG_IGN
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_signal_that_asked_is_named() {
        let stop = Stop::default();
        assert_eq!(stop.signal(), None);
        for signal in Signal::ALL {
            stop.0.store(signal as usize, Ordering::Relaxed);
            assert_eq!(stop.signal(), Some(signal));
            assert_eq!(signal as i32, signal.number(), "the repr is the system's number");
        }
    }
}
