//! Not worse by more than a margin (Piaggio et al. 2012, the CONSORT statement's extension to such trials): the whole interval of the
//! difference must lie on the good side of the margin. With a 95 % interval that is a one-sided test at 2.5 %.

use super::Interval;

/// What an interval says about a margin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// The whole interval is above 0: better.
    Superior,
    /// The whole interval is above minus the margin.
    NotInferior,
    /// The interval holds minus the margin: these rows do not tell.
    Open,
    /// The whole interval is below minus the margin.
    Inferior,
}

impl Verdict {
    /// Judges the interval of a difference of which more is better.
    pub fn of(difference: Interval, margin: f64) -> Self {
        match difference {
            Interval { low, .. } if low > 0.0 => Self::Superior,
            Interval { low, .. } if low > -margin => Self::NotInferior,
            Interval { high, .. } if high < -margin => Self::Inferior,
            _ => Self::Open,
        }
    }

    /// In words.
    pub const fn words(self) -> &'static str {
        match self {
            Self::Superior => "better",
            Self::NotInferior => "not worse",
            Self::Open => "open",
            Self::Inferior => "worse",
        }
    }
}
