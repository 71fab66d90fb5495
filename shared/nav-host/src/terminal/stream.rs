//! A queue of text before stdout or stderr, and the thread that writes it.

use crate::stop;
use std::collections::VecDeque;
use std::fs::File;
use std::io::{self, Write};
use std::os::fd::{AsFd, AsRawFd, OwnedFd};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Pieces of text that may wait: hours of a line a second.
const WAITING_MAX: usize = 4096;
/// A pipe that takes anything takes so many bytes without waiting (`PIPE_BUF`).
const PIPE_PIECE: usize = 4096;
/// How long the other stream may take until text overtakes it.
const ORDER: Duration = Duration::from_millis(100);
/// How long the end waits for a reader that takes nothing.
const PATIENCE: Duration = Duration::from_secs(60);
/// The same once a signal asked for the end.
const PATIENCE_ASKED: Duration = Duration::from_millis(500);
/// How often the end looks whether a signal came.
const GLANCE: Duration = Duration::from_millis(20);

pub(super) static OUT: Stream = Stream::new(|| io::stdout().as_fd().try_clone_to_owned());
pub(super) static ERR: Stream = Stream::new(|| io::stderr().as_fd().try_clone_to_owned());

/// A queue with its thread, which comes with the first text.
pub(super) struct Stream {
    open: fn() -> io::Result<OwnedFd>,
    state: Mutex<State>,
    changed: Condvar,
}

struct State {
    waiting: VecDeque<String>,
    /// Since when the thread has been writing a piece.
    writing_since: Option<Instant>,
    has_thread: bool,
    /// Pieces that found the queue full since it was last empty.
    lost: u64,
}

impl State {
    fn is_idle(&self) -> bool {
        self.waiting.is_empty() && self.writing_since.is_none()
    }
}

impl Stream {
    pub(super) const fn new(open: fn() -> io::Result<OwnedFd>) -> Self {
        let state = State { waiting: VecDeque::new(), writing_since: None, has_thread: false, lost: 0 };
        Self { open, state: Mutex::new(state), changed: Condvar::new() }
    }

    /// Leaves text to be written, or drops it where too much waits already.
    pub(super) fn push(&'static self, text: String) {
        let mut state = self.lock();
        if state.waiting.len() >= WAITING_MAX {
            state.lost += 1;
            return;
        }
        state.waiting.push_back(text);
        self.wake(state);
    }

    /// Leaves text to be written if nothing else is; whether it did.
    pub(super) fn push_if_idle(&'static self, text: String) -> bool {
        let mut state = self.lock();
        let is_idle = state.is_idle();
        if is_idle {
            state.waiting.push_back(text);
            self.wake(state);
        }
        is_idle
    }

    /// Waits for what was left before, so that what another stream gets next comes after it; not for a reader that
    /// takes its time.
    pub(super) fn settle(&self) {
        let asked = Instant::now();
        let mut state = self.lock();
        while !state.is_idle() {
            let since = state.writing_since.map_or(asked, |since| since.min(asked));
            let Some(left) = ORDER.checked_sub(since.elapsed()) else { return };
            state = self.wait(state, left);
        }
    }

    /// Waits until all is written, or until nothing was for as long as a reader can expect.
    pub(super) fn finish(&self) {
        let mut state = self.lock();
        let mut asked = None;
        while !state.is_idle() {
            let now = Instant::now();
            if asked.is_none() && stop::is_asked() {
                asked = Some(now);
            }
            let is_over =
                |since: Option<Instant>, patience| since.is_some_and(|since| now - since > patience);
            if is_over(asked, PATIENCE_ASKED) || is_over(state.writing_since, PATIENCE) {
                return;
            }
            state = self.wait(state, GLANCE);
        }
    }

    fn wake(&'static self, mut state: MutexGuard<'_, State>) {
        if !state.has_thread {
            let builder = std::thread::Builder::new().name("terminal".to_owned()).stack_size(1 << 17);
            state.has_thread = builder.spawn(|| self.write_for_ever()).is_ok();
            if !state.has_thread {
                self.write_here(&mut state.waiting);
            }
        }
        self.changed.notify_all();
    }

    /// Where the system has no thread to spare: writes what its reader takes soon, and drops the rest.
    fn write_here(&self, waiting: &mut VecDeque<String>) {
        let Ok(mut file) = (self.open)().map(File::from) else { return waiting.clear() };
        for text in waiting.drain(..) {
            for piece in text.as_bytes().chunks(PIPE_PIECE) {
                // Whoever has closed it misses it.
                if !takes_more(&file) || file.write_all(piece).is_err() {
                    break;
                }
            }
        }
    }

    fn write_for_ever(&self) {
        let mut file = (self.open)().map(File::from);
        loop {
            let mut state = self.lock();
            let text = loop {
                if let Some(text) = state.waiting.pop_front() {
                    break text;
                }
                state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
            };
            state.writing_since = Some(Instant::now());
            drop(state);
            if let Ok(file) = &mut file {
                // Whoever has closed it misses it.
                let _ = file.write_all(text.as_bytes());
            }
            let mut state = self.lock();
            state.writing_since = None;
            if state.lost > 0 && state.waiting.is_empty() {
                let lost = std::mem::take(&mut state.lost);
                state
                    .waiting
                    .push_back(format!("({lost} lines are missing here: nobody read them in time)\n"));
            }
            self.changed.notify_all();
        }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn wait<'a>(&'a self, state: MutexGuard<'a, State>, time: Duration) -> MutexGuard<'a, State> {
        self.changed.wait_timeout(state, time).unwrap_or_else(PoisonError::into_inner).0
    }
}

/// Whether a write would not wait for long.
fn takes_more(file: &File) -> bool {
    let mut poll = libc::pollfd { fd: file.as_raw_fd(), events: libc::POLLOUT, revents: 0 };
    // SAFETY: one valid entry.
    unsafe { libc::poll(&raw mut poll, 1, ORDER.as_millis() as libc::c_int) > 0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;
    use std::sync::OnceLock;

    /// The end of a pipe that a stream of the test writes to.
    fn pipe(end: &'static OnceLock<OwnedFd>) -> io::PipeReader {
        let (reader, writer) = io::pipe().expect("a pipe");
        end.set(writer.into()).expect("the first");
        reader
    }

    #[test]
    fn nobody_waits_for_a_reader_that_takes_nothing() {
        static END: OnceLock<OwnedFd> = OnceLock::new();
        static STREAM: Stream = Stream::new(|| END.get().expect("it is set").try_clone());
        let mut reader = pipe(&END);
        let line = format!("{}\n", "x".repeat(999));
        // More than a pipe and the queue hold together.
        for _ in 0..WAITING_MAX + 1000 {
            STREAM.push(line.clone());
        }
        STREAM.settle();
        assert!(!STREAM.push_if_idle("picture".to_owned()));
        assert!(!STREAM.lock().is_idle());
        let read = std::thread::spawn(move || {
            let (mut text, mut piece) = (String::new(), [0; 4096]);
            while !text.contains("missing here") {
                let count = reader.read(&mut piece).expect("readable");
                text.push_str(std::str::from_utf8(&piece[..count]).expect("text"));
            }
            text
        });
        STREAM.finish();
        let text = read.join().expect("no panic");
        let lines = text.lines().filter(|line| line.len() == 999).count();
        assert!((WAITING_MAX..WAITING_MAX + 1000).contains(&lines), "{lines}");
        let lost = format!("({} lines are missing", WAITING_MAX + 1000 - lines);
        assert!(text.ends_with("in time)\n") && text.contains(&lost), "{}", &text[text.len() - 100..]);
    }

    #[test]
    fn a_closed_end_is_no_error() {
        static END: OnceLock<OwnedFd> = OnceLock::new();
        static STREAM: Stream = Stream::new(|| END.get().expect("it is set").try_clone());
        drop(pipe(&END));
        (0..3).for_each(|_| STREAM.push("nobody reads this\n".to_owned()));
        STREAM.finish();
        assert!(STREAM.lock().is_idle());
    }
}
