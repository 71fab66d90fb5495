//! Words for a person at the terminal.

use std::fmt::Display;
use std::io::Write;

/// Prints a line. Whoever has closed the terminal misses it, and the program goes on.
pub fn say(line: impl Display) {
    let _ = writeln!(std::io::stdout(), "{line}");
}
