//! Words for a person at the terminal. Whoever has closed it misses them, and the program goes on: `println!`
//! and `eprintln!` would panic.

use std::fmt::Display;
use std::io::Write;

/// Prints a line of results, to stdout.
pub fn say(line: impl Display) {
    let _ = writeln!(std::io::stdout(), "{line}");
}

/// Prints a line about how it goes, or why it does not, to stderr.
pub fn note(line: impl Display) {
    let _ = writeln!(std::io::stderr(), "{line}");
}
