//! Fault bits of [`CmdVel::faults`](super::CmdVel::faults) and [`Status::faults`](super::Status::faults), with
//! their names.

use core::fmt;

/// No scan was ever received, or the last one is too old.
pub const STALE_SCAN: u32 = 1;
/// No odometry was ever received, or the last one is too old.
pub const STALE_ODOM: u32 = 1 << 1;
/// No goal was ever received.
pub const NO_GOAL: u32 = 1 << 2;
/// A network answered NaN or infinity.
pub const NON_FINITE: u32 = 1 << 3;
/// The scan cannot serve: its geometry, too few beams that measured, or nothing hit where walls stood.
pub const BAD_SCAN: u32 = 1 << 4;
/// A stamp from the future, or time or order running backwards.
pub const BAD_CLOCK: u32 = 1 << 5;
/// The command was cut to the speed limits.
pub const SPEED_LIMITED: u32 = 1 << 6;
/// The command was cut to the acceleration limits.
pub const ACCELERATION_LIMITED: u32 = 1 << 7;
/// Odometry or goal holds a number that is not finite.
pub const BAD_INPUT: u32 = 1 << 8;
/// The odometry jumped by more than the robot can drive, or stands still while the robot moves.
pub const BAD_ODOM: u32 = 1 << 9;
/// The goal's heartbeat has stopped, where one was asked for.
pub const STALE_GOAL: u32 = 1 << 10;
/// The command was cut because something touches ahead, or nothing is known of what is there.
pub const CLOSED_AHEAD: u32 = 1 << 11;
/// The safety gate let another command through than was wished.
pub const SHIELDED: u32 = 1 << 12;
/// As [`CLOSED_AHEAD`] of what is behind a robot that reverses.
pub const CLOSED_BEHIND: u32 = 1 << 13;

/// Bits that only say that a message is yet to come.
pub const MISSING: u32 = STALE_SCAN | STALE_ODOM | NO_GOAL | STALE_GOAL;
/// Bits that force a stop (the others only shape the command).
pub const STOPPING: u32 = MISSING | NON_FINITE | BAD_SCAN | BAD_CLOCK | BAD_INPUT | BAD_ODOM;

/// Names for people, bit by bit.
pub const NAMES: [&str; 14] = [
    "stale scan",
    "stale odometry",
    "no goal",
    "network not finite",
    "unusable scan",
    "time runs wrong",
    "speed limited",
    "acceleration limited",
    "input not a number",
    "odometry impossible",
    "stale goal",
    "no way ahead",
    "shield acts",
    "no way back",
];

/// Prints the names of these bits, or `ok` when there are none.
pub fn names(faults: u32) -> impl fmt::Display {
    Names(faults)
}

struct Names(u32);

impl fmt::Display for Names {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.0 == 0 {
            return f.write_str("ok");
        }
        let mut separator = "";
        for (_, name) in NAMES.iter().enumerate().filter(|(bit, _)| self.0 >> bit & 1 == 1) {
            write!(f, "{separator}{name}")?;
            separator = ", ";
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use std::string::ToString;

    #[test]
    fn each_bit_has_its_name() {
        let bits = [
            (STALE_SCAN, "stale scan"),
            (STALE_ODOM, "stale odometry"),
            (NO_GOAL, "no goal"),
            (NON_FINITE, "network not finite"),
            (BAD_SCAN, "unusable scan"),
            (BAD_CLOCK, "time runs wrong"),
            (SPEED_LIMITED, "speed limited"),
            (ACCELERATION_LIMITED, "acceleration limited"),
            (BAD_INPUT, "input not a number"),
            (BAD_ODOM, "odometry impossible"),
            (STALE_GOAL, "stale goal"),
            (CLOSED_AHEAD, "no way ahead"),
            (SHIELDED, "shield acts"),
            (CLOSED_BEHIND, "no way back"),
        ];
        assert_eq!(bits.len(), NAMES.len());
        for (bit, name) in bits {
            assert_eq!(names(bit).to_string(), name);
        }
        assert_eq!(names(0).to_string(), "ok");
        assert_eq!(names(STALE_SCAN | BAD_CLOCK).to_string(), "stale scan, time runs wrong");
    }
}
