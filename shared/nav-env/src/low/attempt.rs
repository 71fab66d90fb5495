//! How an attempt at a target can end, and what is told of a step of it.

/// How an attempt at a target ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Attempt {
    /// It goes on.
    Running,
    /// The target was reached (terminated).
    Reached,
    /// The robot collided (terminated).
    Collided,
    /// It believes to be at the goal and is not, so that it would stand there (terminated, unpaid).
    Astray,
    /// It took too long (truncated).
    GivenUp,
    /// The episode ended on the way to a subgoal (truncated): says nothing about the policy.
    Cut,
}

/// What a step led to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepReport {
    /// What it earned.
    pub reward: f32,
    /// How the attempt stands.
    pub attempt: Attempt,
    /// Whether it ended the attempt for good, so that nothing follows.
    pub is_terminated: bool,
}
