//! The words of the loop: how it behaves and why it ends.

use nav_host::stop::Signal;
use nav_ipc::IpcError;
use std::time::Duration;

/// When to tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Pace {
    /// At the policy's fixed rate, in phase with the scans: for robots and simulators in real time.
    Clock,
    /// Once for each scan, at the scan's own time, as fast as they come: lock-step, deterministic.
    Scan,
}

/// How the loop behaves.
#[derive(Clone, Copy, Debug)]
pub struct DrivePlan {
    /// When to tick.
    pub pace: Pace,
    /// End this long after the first scan.
    pub duration: Option<Duration>,
    /// End with an error when no scan came for this long.
    pub idle_exit: Option<Duration>,
    /// End when whoever writes the scans says goodbye.
    pub exit_with_peer: bool,
    /// Abort at the first allocation in the loop instead of counting.
    pub assert_no_alloc: bool,
    /// Tick at this period instead of the task's, ns; for measuring.
    pub period_ns: Option<u64>,
}

/// Why a run ended well.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// The asked duration is over.
    Duration,
    /// Whoever wrote the scans has left.
    PeerLeft,
    /// Asked by a signal while driving; the robot was commanded to a stop.
    Stopped(Signal),
    /// Asked by a signal before the first scan; nothing was commanded.
    StoppedWaiting(Signal),
}

impl std::fmt::Display for End {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Duration => f.write_str("the asked duration is over"),
            Self::PeerLeft => f.write_str("whoever published the scans has left"),
            Self::Stopped(signal) => write!(f, "{signal}; the robot was commanded to a stop"),
            Self::StoppedWaiting(signal) => write!(f, "{signal} before the first scan"),
        }
    }
}

/// Why a run ended badly.
#[derive(Debug, thiserror::Error)]
pub enum DriveError {
    /// No scan ever came.
    #[error(
        "no scan arrived within {seconds:.1} s: start the simulator or the robot's driver with the same --robot name, \
         or wait longer with --idle-exit"
    )]
    NoScan {
        /// How long it waited, s.
        seconds: f64,
    },
    /// Scans stopped coming.
    #[error("no scan for {seconds:.1} s: whoever published them is gone; the robot was commanded to a stop")]
    ScansStopped {
        /// How long it waited, s.
        seconds: f64,
    },
    /// Shared memory.
    #[error(transparent)]
    Ipc(#[from] IpcError),
}
