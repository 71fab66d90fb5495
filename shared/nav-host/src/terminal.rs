//! Words for a person at the terminal.
//!
//! They must never stop the work: `println!` panics where the terminal is gone, and blocks where a pipe is full. Here,
//! lines wait in a queue of bounded length for a thread that writes them. Whoever has closed the terminal misses them,
//! and so does whoever lets the queue run over; the program goes on. At its end, [`finish`] waits for the reader, but
//! not long if a signal asked for the end.
//!
//! Control characters never reach the terminal, wherever the text came from: see [`escaped`].

mod escape;
mod size;
mod stream;

pub use escape::{escaped, one_line};
pub use size::size;

use std::fmt::Display;
use stream::{ERR, OUT};

/// Prints a line of results (or more of them), to stdout.
pub fn say(line: impl Display) {
    ERR.settle();
    OUT.push(escaped(&line.to_string()) + "\n");
}

/// Prints a line about how it goes, or why it does not, to stderr.
pub fn note(line: impl Display) {
    OUT.settle();
    ERR.push(escaped(&line.to_string()) + "\n");
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
