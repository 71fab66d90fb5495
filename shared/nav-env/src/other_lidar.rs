//! A lidar that the policy was not trained with: the controller resamples its scans.

use nav_core::messages::MAX_BEAMS;
use nav_core::task::{Lidar, Task};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// Beams and range that replace those of the task in the simulation, written `360x12` (beams x metres).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub struct OtherLidar {
    /// Beams over the trained field of view.
    pub beam_count: u32,
    /// Longest range, m.
    pub range_max_m: f32,
}

impl OtherLidar {
    /// The task of a robot with this lidar.
    pub fn on(self, task: &Task) -> Task {
        let Self { beam_count, range_max_m } = self;
        Task { lidar: Lidar { beam_count, range_max_m, ..task.lidar }, ..*task }
    }
}

impl FromStr for OtherLidar {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parse = || {
            let (beams, range) = text.split_once('x')?;
            let (beam_count, range_max_m): (u32, f32) = (beams.parse().ok()?, range.parse().ok()?);
            let is_fine =
                (1..=MAX_BEAMS as u32).contains(&beam_count) && (1.0..=100.0).contains(&range_max_m);
            is_fine.then_some(Self { beam_count, range_max_m })
        };
        parse().ok_or_else(|| {
            format!("{text} is no lidar: give beams (1 to {MAX_BEAMS}) and metres (1 to 100), as in 360x12")
        })
    }
}

impl TryFrom<String> for OtherLidar {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

impl From<OtherLidar> for String {
    fn from(lidar: OtherLidar) -> Self {
        lidar.to_string()
    }
}

impl fmt::Display for OtherLidar {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x{}", self.beam_count, self.range_max_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_written_as_it_is_read() {
        for text in ["360x12", "36x3.5", "1440x100"] {
            assert_eq!(text.parse::<OtherLidar>().expect("a lidar").to_string(), text);
        }
        for bad in ["360", "0x5", "1441x5", "72x0.5", "72xNaN", "x", "72x5x3"] {
            assert!(bad.parse::<OtherLidar>().is_err_and(|error| error.contains("360x12")), "{bad}");
        }
        let task = "360x12".parse::<OtherLidar>().expect("a lidar").on(&Task::default());
        assert_eq!((task.lidar.beam_count, task.robot), (360, Task::default().robot));
    }
}
