//! What exactly is wrong, with the value that was expected and the one that came: a fault bit as a sentence.

use crate::scan::Misfit;
use core::fmt;

/// Stamps this far ahead are of another clock, ns: three years.
const WALL_CLOCK_NS: u64 = 100_000_000_000_000_000;

/// One of the messages that a tick reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Input {
    /// The scan.
    Scan,
    /// The odometry.
    Odom,
    /// The goal.
    Goal,
}

impl Input {
    const fn name(self) -> &'static str {
        match self {
            Self::Scan => "scan",
            Self::Odom => "odom",
            Self::Goal => "goal",
        }
    }
}

/// Why a tick has a fault.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cause {
    /// The scan cannot serve.
    Scan(Misfit),
    /// Stamped but not counted.
    NoSequence(Input),
    /// A stamp from the future.
    Future {
        /// Of which message.
        input: Input,
        /// By so much, ns.
        by_ns: u64,
    },
    /// Order or time went back, or one of them stood still while the other went on.
    Backwards {
        /// Of which message.
        input: Input,
        /// `seq` before and now.
        seq: (u64, u64),
        /// `stamp_ns` before and now.
        stamp_ns: (u64, u64),
    },
    /// A number that is not finite, or so large that a float has no centimetres left.
    Number {
        /// Of which message.
        input: Input,
        /// Which field.
        field: &'static str,
        /// What came.
        found: f32,
    },
    /// The pose jumped.
    Jump {
        /// By so much, m and rad.
        moved: (f32, f32),
        /// The robot can have made so much, m and rad.
        possible: (f32, f32),
    },
    /// The pose stands still while the robot is commanded to move and the scan shows that it does.
    Frozen {
        /// For so long, s.
        for_s: f32,
    },
    /// The goal's heartbeat has stopped.
    StaleGoal {
        /// Age of the newest goal, s.
        age_s: f32,
        /// What was asked for, s.
        limit_s: f32,
    },
    /// Scans come at another rate than the policy was trained for; no fault, and measured by whoever reads them.
    Rate {
        /// Time from one scan to the next in training, s.
        trained_s: f32,
        /// And now, s.
        found_s: f32,
    },
}

impl Cause {
    /// Whether both say the same, with whatever numbers: to be told once.
    pub fn is_like(&self, other: &Self) -> bool {
        let kind = core::mem::discriminant::<Self>;
        match (self, other) {
            (Self::Scan(a), Self::Scan(b)) => core::mem::discriminant(a) == core::mem::discriminant(b),
            _ => kind(self) == kind(other),
        }
    }
}

impl fmt::Display for Cause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Scan(misfit) => misfit.fmt(f),
            Self::NoSequence(input) => write!(
                f,
                "the {} has a stamp, but its seq is 0, which means that nothing came yet: count messages from 1",
                input.name()
            ),
            Self::Future { input, by_ns } if by_ns > WALL_CLOCK_NS => write!(
                f,
                "the {} is stamped {:.0} years ahead: stamps must be of CLOCK_MONOTONIC, this one looks like the wall \
                 clock's",
                input.name(),
                by_ns as f64 / 31_557_600e9
            ),
            Self::Future { input, by_ns } => write!(
                f,
                "the {} is stamped {:.1} ms in the future: stamp with CLOCK_MONOTONIC of this machine, when measuring",
                input.name(),
                by_ns as f64 / 1e6
            ),
            Self::Backwards { input, seq, stamp_ns } => write!(
                f,
                "the {}'s seq went from {} to {} and its stamp by {:.3} ms: both must grow with each message",
                input.name(),
                seq.0,
                seq.1,
                (stamp_ns.1 as f64 - stamp_ns.0 as f64) / 1e6
            ),
            Self::Number { input, field, found } => write!(
                f,
                "{field} of the {} is {found}: it must be a number below 100000 (a float has no centimetres beyond \
                 100 km: shift the origin)",
                input.name()
            ),
            Self::Jump { moved, possible } => write!(
                f,
                "the odometry jumped by {:.2} m and {:.2} rad, the robot can have made {:.2} m and {:.2} rad: the goal \
                 no longer lies where it did, send it again",
                moved.0, moved.1, possible.0, possible.1
            ),
            Self::Frozen { for_s } => write!(
                f,
                "the odometry's pose has not changed for {for_s:.1} s, though the robot is commanded to move and the scan \
                 changes: check the wheel encoders; a goal of another id tries again"
            ),
            Self::StaleGoal { age_s, limit_s } => write!(
                f,
                "the newest goal is {age_s:.1} s old, {limit_s:.1} s are allowed: whoever sends goals has stopped"
            ),
            Self::Rate { trained_s, found_s } => write!(
                f,
                "scans come every {:.0} ms, the policy was trained for one every {:.0} ms: publish at {:.0} Hz",
                1e3 * found_s,
                1e3 * trained_s,
                1.0 / trained_s
            ),
        }
    }
}
