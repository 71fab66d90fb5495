//! The messages of a robot: plain `repr(C)` numbers of fixed size, so that they can live in shared memory
//! and be read from any language. Names and meaning follow ROS `sensor_msgs/LaserScan`, `nav_msgs/Odometry`
//! and `geometry_msgs/Twist`.
//!
//! [`crate::topics`] says who writes which, and under which type name it travels.

pub mod fault;

use crate::geometry::Pose;
use crate::twist::Twist;

/// The most beams that a scan can hold.
pub const MAX_BEAMS: usize = 1440;

/// When and in which order a message was made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(C)]
pub struct Header {
    /// Monotonic time of the measurement or decision, ns. Never wall-clock time.
    pub stamp_ns: u64,
    /// Counts up by one with each message of a writer, from 1; 0 means that nothing was ever received.
    pub seq: u64,
}

impl Header {
    /// Whether a message was ever received.
    pub const fn is_received(&self) -> bool {
        self.seq != 0
    }

    /// Age at `now_ns`, ns; zero for a stamp of the future (see [`Self::is_from_future`]).
    pub const fn age_ns(&self, now_ns: u64) -> u64 {
        now_ns.saturating_sub(self.stamp_ns)
    }

    /// Whether the stamp lies after `now_ns`.
    pub const fn is_from_future(&self, now_ns: u64) -> bool {
        self.stamp_ns > now_ns
    }
}

/// One revolution (or field of view) of a planar lidar, in its own frame ([`Lidar::mount`](crate::task::Lidar::mount)).
///
/// A range of `INFINITY` means that nothing was hit within `range_max_m`; NaN, or a value below
/// `range_min_m`, is a measurement that failed.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct LaserScan {
    /// Time and order.
    pub header: Header,
    /// Direction of beam 0 in the lidar's frame, rad.
    pub angle_min_rad: f32,
    /// From one beam to the next, counter-clockwise, rad.
    pub angle_increment_rad: f32,
    /// Shortest valid range, m.
    pub range_min_m: f32,
    /// Longest valid range, m.
    pub range_max_m: f32,
    /// How many entries of `ranges_m` are in use, at most [`MAX_BEAMS`].
    pub beam_count: u32,
    /// Keeps the layout free of hidden padding; always 0.
    pub reserved: u32,
    /// Ranges from the sensor origin, m; entries past `beam_count` are unspecified.
    pub ranges_m: [f32; MAX_BEAMS],
}

impl Default for LaserScan {
    fn default() -> Self {
        Self {
            header: Header::default(),
            angle_min_rad: 0.0,
            angle_increment_rad: 0.0,
            range_min_m: 0.0,
            range_max_m: 0.0,
            beam_count: 0,
            reserved: 0,
            ranges_m: [0.0; MAX_BEAMS],
        }
    }
}

impl LaserScan {
    /// The ranges in use, m; cut at [`MAX_BEAMS`] whatever `beam_count` says.
    pub fn ranges_m(&self) -> &[f32] {
        &self.ranges_m[..(self.beam_count as usize).min(MAX_BEAMS)]
    }
}

/// Where wheel odometry believes the robot is, in the `odom` frame, and how it moves.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct Odometry {
    /// Time and order.
    pub header: Header,
    /// `odom_from_robot`.
    pub pose: Pose,
    /// Forward speed, m/s.
    pub linear_mps: f32,
    /// Turning rate, counter-clockwise, rad/s.
    pub angular_radps: f32,
    /// Keeps the layout free of hidden padding; always 0.
    pub reserved: u32,
}

impl Odometry {
    /// The measured velocity.
    pub const fn twist(&self) -> Twist {
        Twist::new(self.linear_mps, self.angular_radps)
    }
}

/// Where to go, in the `odom` frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct Goal {
    /// Time and order.
    pub header: Header,
    /// Position, m.
    pub x_m: f32,
    /// Position, m.
    pub y_m: f32,
    /// The goal is reached when the robot's centre is this close, m.
    pub radius_m: f32,
    /// Tells one goal (one episode) from the next. A new id makes the controller forget the last goal and all that it
    /// remembers of the way; the same id with another place is a correction (a localiser has found out how far odometry
    /// has drifted): it is followed at once, and everything is remembered.
    pub id: u32,
}

/// A velocity command for the base.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct CmdVel {
    /// Time and order.
    pub header: Header,
    /// Forward speed, m/s.
    pub linear_mps: f32,
    /// Turning rate, counter-clockwise, rad/s.
    pub angular_radps: f32,
    /// `seq` of the scan that this answers.
    pub scan_seq: u64,
    /// Why the command is as it is: [`crate::messages::fault`] bits, 0 when the policy's own wish passed.
    pub faults: u32,
    /// What the runtime was doing when it commanded this: [`RunState`] as a number. It travels with the command, so that
    /// whoever drives an episode knows it without a race.
    pub state: u32,
}

impl CmdVel {
    /// The commanded velocity.
    pub const fn twist(&self) -> Twist {
        Twist::new(self.linear_mps, self.angular_radps)
    }
}

/// What the runtime is doing, once a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct Status {
    /// Time and order.
    pub header: Header,
    /// [`RunState`] as a number.
    pub state: u32,
    /// [`fault`] bits of this tick.
    pub faults: u32,
    /// Id of the goal being driven to.
    pub goal_id: u32,
    /// The subgoal's action index (see [`crate::task`]).
    pub subgoal_action: u32,
    /// The subgoal in the `odom` frame, m.
    pub subgoal_x_m: f32,
    /// The subgoal in the `odom` frame, m.
    pub subgoal_y_m: f32,
    /// What was wished before the safety gate saw it, forward speed, m/s.
    pub wish_linear_mps: f32,
    /// The same, turning rate, rad/s.
    pub wish_angular_radps: f32,
    /// Age of the scan when the tick began, ns.
    pub scan_age_ns: u64,
    /// Age of the odometry when the tick began, ns.
    pub odom_age_ns: u64,
    /// Time spent in the controller: observation, networks and guard, ns.
    pub policy_ns: u64,
    /// Time spent in the whole tick, ns.
    pub tick_ns: u64,
    /// Deadlines missed since start.
    pub overruns: u64,
}

/// What the runtime is doing; [`crate::run_state`] says when.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u32)]
pub enum RunState {
    /// Up, commanding zero: no goal, or input is missing.
    #[default]
    Ready = 0,
    /// Driving to the goal.
    Driving = 1,
    /// The goal is reached; commanding zero.
    Reached = 2,
    /// A fault stops the robot for as long as it lasts; commanding zero.
    Stopped = 3,
}

impl RunState {
    /// All of them, in the order of their numbers.
    pub const ALL: [Self; 4] = [Self::Ready, Self::Driving, Self::Reached, Self::Stopped];

    /// The state of a number on the wire.
    pub fn of(number: u32) -> Option<Self> {
        Self::ALL.into_iter().find(|state| *state as u32 == number)
    }

    /// Its name, for people.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Ready => "ready",
            Self::Driving => "driving",
            Self::Reached => "at the goal",
            Self::Stopped => "stopped",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::mem::{offset_of, size_of};

    /// The wire layout, as documented for other languages: a change here needs a new type name.
    #[test]
    fn layouts_are_as_documented() {
        assert_eq!(size_of::<LaserScan>(), 16 + 6 * 4 + MAX_BEAMS * 4);
        assert_eq!(size_of::<Odometry>(), 16 + 6 * 4);
        assert_eq!(size_of::<Goal>(), 16 + 4 * 4);
        assert_eq!(size_of::<CmdVel>(), 16 + 2 * 4 + 8 + 2 * 4);
        assert_eq!((offset_of!(CmdVel, faults), offset_of!(CmdVel, state)), (32, 36));
        assert_eq!(size_of::<Status>(), 16 + 8 * 4 + 5 * 8);
    }

    #[test]
    fn a_run_state_is_found_by_its_number() {
        for (number, state) in RunState::ALL.into_iter().enumerate() {
            assert_eq!((state as usize, RunState::of(number as u32)), (number, Some(state)));
        }
        assert_eq!(RunState::of(4), None);
    }
}
