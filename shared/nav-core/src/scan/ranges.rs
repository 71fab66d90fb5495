//! What a range of a scan means (REP 117, and what drivers do besides).
//!
//! | a range reads | it means |
//! |---|---|
//! | `INFINITY` | nothing within `range_max_m` |
//! | a number within the scan's limits | something there |
//! | a positive number below `range_min_m` | something there: too near to be exact, but an obstacle |
//! | 0, a negative number, `-INFINITY` (REP 117) | something too near to be measured: it counts as touching the robot |
//! | NaN, a finite number above `range_max_m` | the measurement failed: nothing is known |
//! | at least the driver's own `no_return_m` | nothing within `range_max_m` |

use crate::messages::LaserScan;

/// Where something is, m: 0 for too near to be measured, `INFINITY` for nothing, NaN for nothing known.
pub(super) fn meaning_m(scan: &LaserScan, range_m: f32, no_return_m: f32) -> f32 {
    if range_m <= 0.0 {
        return 0.0;
    }
    if range_m < scan.range_min_m {
        return range_m;
    }
    if range_m >= no_return_m || range_m == f32::INFINITY {
        return f32::INFINITY;
    }
    // A hair more, because limits and ranges are rounded in different places.
    if range_m <= scan.range_max_m * 1.001 { range_m } else { f32::NAN }
}
