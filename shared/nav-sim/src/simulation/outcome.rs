//! How an episode stands, and how it ends.

/// How an episode stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// It goes on.
    Running,
    /// The robot's centre came within the goal radius (terminated).
    Reached,
    /// The footprint touched an obstacle or a person, or left the bounds (terminated).
    Collided,
    /// `episode_s` is over (truncated).
    TimedOut,
}

impl Outcome {
    /// Whether the episode ended by what happened in it.
    pub const fn is_terminated(self) -> bool {
        matches!(self, Self::Reached | Self::Collided)
    }

    /// Whether the episode ended.
    pub const fn is_over(self) -> bool {
        !matches!(self, Self::Running)
    }
}
