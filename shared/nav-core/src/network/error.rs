//! What can be wrong with a network before it runs. Running has no errors.

use super::{CpuLevel, MAX_CONSTANTS, MAX_MEMORY_FLOATS, MAX_SIDE, MAX_STEPS};
use core::fmt;

/// Why a network could not be described, packed or refreshed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NetworkError {
    /// More than [`MAX_STEPS`] steps.
    TooManySteps,
    /// More than [`MAX_CONSTANTS`] constants.
    TooManyConstants,
    /// A side of a matrix is zero or above [`MAX_SIDE`].
    Side {
        /// The refused length.
        length: usize,
    },
    /// The network needs more than [`MAX_MEMORY_FLOATS`] floats.
    TooLarge,
    /// Two things that must have the same length do not.
    Length {
        /// What was measured.
        what: &'static str,
        /// The length it must have.
        expected: usize,
        /// The length it has.
        found: usize,
    },
    /// A value belongs to another spec.
    ForeignValue,
    /// The spec has no input, or two.
    Input,
    /// The spec has no output, or its output is not contiguous.
    Output,
    /// The memory is too small.
    Memory {
        /// Floats needed.
        needed: usize,
        /// Floats given.
        given: usize,
    },
    /// This machine cannot run the asked instruction level.
    Level(CpuLevel),
    /// A refresh had other steps or shapes than the packed network.
    OtherStructure,
}

impl fmt::Display for NetworkError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooManySteps => write!(f, "the network has more than {MAX_STEPS} steps; use a smaller one"),
            Self::TooManyConstants => {
                write!(f, "the network has more than {MAX_CONSTANTS} constants; use a smaller one")
            }
            Self::Side { length } => write!(f, "a matrix side of {length} is outside 1..={MAX_SIDE}"),
            Self::TooLarge => write!(
                f,
                "the network needs more than {MAX_MEMORY_FLOATS} floats of memory; use a smaller one"
            ),
            Self::Length { what, expected, found } => {
                write!(f, "{what} has length {found}, expected {expected}")
            }
            Self::ForeignValue => write!(f, "a value is used with a spec that did not make it"),
            Self::Input => write!(f, "a network needs exactly one input: call `input` once, first"),
            Self::Output => {
                write!(f, "a network needs one contiguous output: call `output` with a whole value")
            }
            Self::Memory { needed, given } => {
                write!(
                    f,
                    "the network needs {needed} floats of memory but was given {given}; size it with `memory_len`"
                )
            }
            Self::Level(level) => {
                write!(f, "this processor cannot run {level} instructions; use `CpuLevel::detect`")
            }
            Self::OtherStructure => write!(
                f,
                "the new weights have other steps or shapes than the packed network; pack a new one"
            ),
        }
    }
}

impl core::error::Error for NetworkError {}
