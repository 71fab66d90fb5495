//! One convention of exit codes for all programs.
//!
//! | code | when |
//! |---|---|
//! | 0 | everything that was asked for was done |
//! | 1 | it could not be done; one sentence on stderr says why, and what to do |
//! | 2 | the command line makes no sense (said by `clap`, which ends the program itself) |
//! | 129, 130, 131, 143 | asked to end by SIGHUP, SIGINT, SIGQUIT or SIGTERM, and ended in good order |

use crate::stop::Signal;
use crate::terminal::{self, tell};
use std::fmt::Display;
use std::process::{ExitCode, Termination};

/// How a program ended; returned by its `main`. What was said until then is written before the process ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exit {
    /// Everything was done.
    Done,
    /// It could not be done.
    Failed,
    /// A signal asked for the end before everything was done.
    Stopped(Signal),
}

impl Exit {
    /// How a program ended whose work gave `result`; an error is told on stderr, after `prefix`.
    pub fn of(prefix: &str, result: Result<Self, impl Display>) -> Self {
        result.unwrap_or_else(|error| {
            tell(format_args!("{prefix}: {error:#}"));
            Self::Failed
        })
    }

    /// The exit code.
    pub const fn code(self) -> u8 {
        match self {
            Self::Done => 0,
            Self::Failed => 1,
            Self::Stopped(signal) => 128 + signal as u8,
        }
    }
}

impl Termination for Exit {
    fn report(self) -> ExitCode {
        terminal::finish();
        ExitCode::from(self.code())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_are_as_documented() {
        let stopped = Signal::ALL.map(|signal| Exit::Stopped(signal).code());
        assert_eq!(stopped, [129, 130, 131, 143]);
        assert_eq!((Exit::Done.code(), Exit::Failed.code()), (0, 1));
        assert_eq!(Exit::of("test", Ok::<_, String>(Exit::Done)), Exit::Done);
        assert_eq!(Exit::of("test", Err("an error that a test asked for")), Exit::Failed);
    }
}
