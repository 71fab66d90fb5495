//! The topics of a robot: who writes what, under which versioned type name.
//!
//! A service is named `hybridnav/<robot>/<topic>`, so that several robots share a machine. The type name
//! carries a version, because shared memory checks a payload's name, size and alignment but not its fields.

/// A topic: a name, the type that travels on it, and who writes it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Topic {
    /// Last part of the service name.
    pub name: &'static str,
    /// Versioned name of the payload type.
    pub type_name: &'static str,
    /// Who writes it, for people.
    pub writer: &'static str,
}

/// Lidar scans.
pub const SCAN: Topic =
    Topic { name: "scan", type_name: "hybridnav/LaserScan/v1", writer: "simulator or driver" };
/// Odometry.
pub const ODOM: Topic =
    Topic { name: "odom", type_name: "hybridnav/Odometry/v1", writer: "simulator or driver" };
/// Goals.
pub const GOAL: Topic = Topic { name: "goal", type_name: "hybridnav/Goal/v1", writer: "simulator or user" };
/// Velocity commands.
pub const CMD_VEL: Topic = Topic { name: "cmd_vel", type_name: "hybridnav/CmdVel/v1", writer: "runtime" };
/// What the runtime is doing.
pub const STATUS: Topic = Topic { name: "status", type_name: "hybridnav/Status/v2", writer: "runtime" };
