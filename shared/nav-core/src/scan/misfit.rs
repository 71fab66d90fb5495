//! Why a scan cannot serve a policy, with what was needed and what came.

use core::fmt;

/// The first thing that keeps a scan from being driven on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Misfit {
    /// A number of the scan's header is not finite, or the increment is 0.
    Header {
        /// Its `angle_min_rad`.
        angle_min_rad: f32,
        /// Its `angle_increment_rad`.
        angle_increment_rad: f32,
        /// Its `range_min_m`.
        range_min_m: f32,
        /// Its `range_max_m`.
        range_max_m: f32,
    },
    /// More beams than a message holds.
    TooManyBeams {
        /// What it holds.
        most: u32,
        /// What its header claims.
        found: u32,
    },
    /// Fewer than half of the beams that the policy was trained with.
    FewBeams {
        /// What the policy was trained with.
        trained: u32,
        /// What came.
        found: u32,
    },
    /// Parts of the trained field of view that no beam looks into.
    NarrowView {
        /// The trained field of view, rad.
        trained_rad: f32,
        /// The part of it that beams look into, rad.
        found_rad: f32,
    },
    /// Less than half of the range that the policy was trained with.
    ShortRange {
        /// What the policy was trained with, m.
        trained_m: f32,
        /// What came, m.
        found_m: f32,
    },
    /// What stands closer than this is not measured, and it is outside the robot.
    FarMinimum {
        /// The farthest that can serve, m.
        most_m: f32,
        /// What came, m.
        found_m: f32,
    },
    /// Too many beams whose measurement failed.
    Blind {
        /// Beams that measured something, or nothing within their range.
        measured: u32,
        /// All beams.
        beams: u32,
    },
    /// No beam hits anything any more, where walls stood close.
    Vanished {
        /// For so long, s.
        for_s: f32,
        /// The nearest thing in the last scan that hit anything, m.
        nearest_m: f32,
    },
    /// It measured well, but too few scans ago it did not.
    Settling {
        /// Good scans in a row that are needed.
        needed: u32,
        /// Good scans in a row so far.
        good: u32,
    },
}

impl fmt::Display for Misfit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Header { angle_min_rad, angle_increment_rad, range_min_m, range_max_m } => write!(
                f,
                "the scan's header makes no sense (angle_min {angle_min_rad} rad, angle_increment {angle_increment_rad} \
                 rad, range_min {range_min_m} m, range_max {range_max_m} m): all must be numbers, and the increment not 0"
            ),
            Self::TooManyBeams { most, found } => {
                write!(f, "a scan holds {most} beams at most, {found} came: leave out every second one")
            }
            Self::FewBeams { trained, found } => write!(
                f,
                "{} beams needed, {found} came: the policy was trained with {trained}, and half of them can serve",
                trained.div_ceil(2)
            ),
            Self::NarrowView { trained_rad, found_rad } => write!(
                f,
                "a field of view of {:.0} degrees needed, beams look into {:.0} of them: check angle_min, \
                 angle_increment and the number of beams, or train for this lidar",
                trained_rad.to_degrees(),
                found_rad.to_degrees()
            ),
            Self::ShortRange { trained_m, found_m } => write!(
                f,
                "a range of {:.1} m needed, range_max is {found_m:.1} m: the policy was trained with {trained_m:.1} m, \
                 and half of it can serve",
                0.5 * trained_m
            ),
            Self::FarMinimum { most_m, found_m } => write!(
                f,
                "range_min is {found_m:.2} m, {most_m:.2} m can serve at most: what stands closer is not measured"
            ),
            Self::Blind { measured, beams } => write!(
                f,
                "{measured} of {beams} beams measured anything: a beam that hit nothing must read +inf (REP 117), not \
                 NaN or a number above range_max"
            ),
            Self::Vanished { for_s, nearest_m } => write!(
                f,
                "no beam has hit anything for {for_s:.1} s, though something stood {nearest_m:.1} m away: is the lidar \
                 covered or unplugged?"
            ),
            Self::Settling { needed, good } => {
                write!(f, "{needed} good scans in a row needed after bad ones, {good} came")
            }
        }
    }
}
