//! Words for a person at the terminal.
//!
//! They must never stop the work: `println!` panics where the terminal is gone, and blocks where a pipe is full. Here,
//! lines wait in a queue of bounded length for a thread that writes them. Whoever has closed the terminal misses them,
//! and so does whoever lets the queue run over; the program goes on. At its end, [`finish`] waits for the reader, but
//! not long if a signal asked for the end. Where the system has no thread to spare, lines are written at once, as far as
//! their reader takes them.
//!
//! How much is said is one level for the whole program ([`Level`]): results and errors always, the rest as asked for.
//!
//! Control characters never reach the terminal, wherever the text came from: see [`escaped`].

mod escape;
mod level;
mod size;
mod stream;

pub use escape::{escaped, one_line};
#[cfg(feature = "manual")]
pub use level::LogArguments;
pub use level::{Level, says, set_level};
pub use size::size;

use std::fmt::Display;
use stream::{ERR, OUT};

/// Prints a line of results (or more of them), to stdout.
pub fn say(line: impl Display) {
    ERR.settle();
    OUT.push(escaped(&line.to_string()) + "\n");
}

/// Prints a line about how it goes, to stdout.
pub fn inform(line: impl Display) {
    if says(Level::Info) {
        say(line);
    }
}

/// Prints why it ends, to stderr: an error, or what a person must know to go on.
pub fn tell(line: impl Display) {
    OUT.settle();
    ERR.push(escaped(&line.to_string()) + "\n");
}

/// Prints a warning, or a fault with its cause, to stderr.
pub fn warn(line: impl Display) {
    tell_at(Level::Warn, line);
}

/// Prints a line about how it goes, to stderr.
pub fn note(line: impl Display) {
    tell_at(Level::Info, line);
}

/// Prints what helps to find a mistake, to stderr.
pub fn debug(line: impl Display) {
    tell_at(Level::Debug, line);
}

fn tell_at(level: Level, line: impl Display) {
    if says(level) {
        tell(line);
    }
}

/// Draws on stdout as it is, control characters included; what comes from elsewhere must be [`one_line`] in it. Whether
/// it was drawn: not while the terminal is busy with what came before.
pub fn draw(picture: String) -> bool {
    OUT.push_if_idle(picture)
}

/// Waits until everything was written or nobody takes it any more; [`crate::exit::Exit`] does it for each program.
pub fn finish() {
    OUT.finish();
    ERR.finish();
}
