//! Whom the safety gate follows. The runtime does not say; a tracker of the same kind, which sees the same scans, does.

use nav_core::scan::beams::Beams;
use nav_core::task::{Lidar, Task};
use nav_core::tracker::{Track, Tracker};
use nav_env::messages::Messages;

/// A tracker on the messages that are sent.
#[derive(Debug)]
pub(crate) struct Follow {
    lidar: Lidar,
    tracker: Box<Tracker>,
    beams: Box<Beams>,
}

impl Follow {
    /// Before the first scan of an episode.
    pub(crate) fn new(task: &Task) -> Self {
        Self { lidar: task.lidar, tracker: Box::new(Tracker::new(task)), beams: Box::new(Beams::new()) }
    }

    /// Takes in what was sent.
    pub(crate) fn take(&mut self, messages: &Messages) {
        self.beams.read(&messages.scan, f32::INFINITY);
        let lidar_pose = self.lidar.pose(messages.odom.pose);
        self.tracker.update(&self.beams, lidar_pose, messages.scan.header.stamp_ns);
    }

    /// Everybody who is followed, `odom` frame.
    pub(crate) fn tracks(&self) -> &[Track] {
        self.tracker.tracks()
    }
}
