//! Which message travels on which topic, and as what.
//!
//! # For other languages
//! A topic is the iceoryx2 publish-subscribe service `hybridnav/<robot>/<topic>` with iceoryx2's default
//! settings, except for one publisher instead of two. Its payload is one `repr(C)` structure of
//! [`nav_core::messages`], little-endian as the machine is, without hidden padding, without user header:
//!
//! | topic | payload type name | size, bytes | alignment |
//! |---|---|---|---|
//! | scan | `hybridnav/LaserScan/v1` | 5800 | 8 |
//! | odom | `hybridnav/Odometry/v1` | 40 | 8 |
//! | goal | `hybridnav/Goal/v1` | 32 | 8 |
//! | cmd_vel | `hybridnav/CmdVel/v1` | 40 | 8 |
//! | status | `hybridnav/Status/v2` | 88 | 8 |
//!
//! After each message the writer notifies, with event id 0, the event service of the same name.

use iceoryx2::prelude::ZeroCopySend;
use nav_core::messages::{CmdVel, Goal, LaserScan, Odometry, Status};
use nav_core::topics::{self, Topic};

/// A message that has a topic.
///
/// # Safety
/// The type is `repr(C)`, holds no pointer, reference or handle, and every bit pattern is a valid value: other
/// processes write it.
pub unsafe trait Message: Copy + Default + std::fmt::Debug + 'static {
    /// Where it travels.
    const TOPIC: Topic;
}

// SAFETY: `repr(C)`, fixed-size numbers only.
unsafe impl Message for LaserScan {
    const TOPIC: Topic = topics::SCAN;
}
// SAFETY: as above.
unsafe impl Message for Odometry {
    const TOPIC: Topic = topics::ODOM;
}
// SAFETY: as above.
unsafe impl Message for Goal {
    const TOPIC: Topic = topics::GOAL;
}
// SAFETY: as above.
unsafe impl Message for CmdVel {
    const TOPIC: Topic = topics::CMD_VEL;
}
// SAFETY: as above.
unsafe impl Message for Status {
    const TOPIC: Topic = topics::STATUS;
}

/// A message under its versioned type name; the same bytes.
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub(crate) struct Wire<T: Message>(pub(crate) T);

// SAFETY: transparent over a `Message`, which promises what `ZeroCopySend` asks for.
unsafe impl<T: Message> ZeroCopySend for Wire<T> {
    unsafe fn type_name() -> &'static str {
        T::TOPIC.type_name
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_documented_sizes_are_true() {
        fn layout<T>() -> (usize, usize) {
            (size_of::<T>(), align_of::<T>())
        }
        assert_eq!(layout::<Wire<LaserScan>>(), (5800, 8));
        assert_eq!(layout::<Wire<Odometry>>(), (40, 8));
        assert_eq!(layout::<Wire<Goal>>(), (32, 8));
        assert_eq!(layout::<Wire<CmdVel>>(), (40, 8));
        assert_eq!(layout::<Wire<Status>>(), (88, 8));
    }
}
