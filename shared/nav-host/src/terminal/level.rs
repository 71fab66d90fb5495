//! How much is said.

use std::sync::atomic::{AtomicU8, Ordering};

/// How much a program says; each level says what those before it say, too.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(feature = "manual", derive(clap::ValueEnum))]
pub enum Level {
    /// Errors, and the result that was asked for
    Error,
    /// Also warnings, and faults with their causes
    Warn,
    /// Also how it goes
    #[default]
    Info,
    /// Also what helps to find a mistake: what was loaded, what first came, each decision
    Debug,
}

static LEVEL: AtomicU8 = AtomicU8::new(Level::Info as u8);

/// Whether anything is said at a level.
pub fn says(level: Level) -> bool {
    level as u8 <= LEVEL.load(Ordering::Relaxed)
}

/// Says this much from now on.
pub fn set_level(level: Level) {
    LEVEL.store(level as u8, Ordering::Relaxed);
}

/// The option of every program.
#[cfg(feature = "manual")]
#[derive(Clone, Copy, Debug, Default, clap::Args)]
pub struct LogArguments {
    /// How much to say
    #[arg(long = "log", global = true, value_name = "LEVEL", value_enum, default_value_t)]
    level: Level,
}

#[cfg(feature = "manual")]
impl LogArguments {
    /// Says as much as was asked for from now on.
    pub fn apply(self) {
        set_level(self.level);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_level_says_what_those_before_it_say() {
        let all = [Level::Error, Level::Warn, Level::Info, Level::Debug];
        assert_eq!(all.map(says), [true, true, true, false], "the default");
        set_level(Level::Error);
        assert_eq!(all.map(says), [true, false, false, false]);
        set_level(Level::Debug);
        assert_eq!(all.map(says), [true; 4]);
    }
}
