//! The commands that left for the base, which it may have yet to obey.

use crate::observation::SENT_COMMANDS;
use crate::twist::Twist;

/// So many are kept.
pub const SENT_MAX: usize = 128;

/// The last commands, one a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sent([Twist; SENT_MAX]);

impl Default for Sent {
    fn default() -> Self {
        Self::of(&[Twist::ZERO])
    }
}

impl Sent {
    /// These, newest first, and before the last of them the same for ever.
    ///
    /// # Panics
    /// Without any.
    pub fn of(newest_first: &[Twist]) -> Self {
        let mut sent = [newest_first[newest_first.len() - 1]; SENT_MAX];
        for (to, from) in sent.iter_mut().zip(newest_first) {
            *to = *from;
        }
        Self(sent)
    }

    /// A tick later.
    pub fn push(&mut self, command: Twist) {
        self.0.rotate_right(1);
        self.0[0] = command;
    }

    /// The same history with another newest command.
    pub fn with_newest(mut self, command: Twist) -> Self {
        self.0[0] = command;
        self
    }

    /// Newest first.
    pub fn as_slice(&self) -> &[Twist] {
        &self.0
    }

    /// The mean of `ticks` commands, beginning so many ticks before the newest.
    pub fn mean(&self, since: usize, ticks: usize) -> Twist {
        let from = since.min(SENT_MAX - 1);
        let block = &self.0[from..(from + ticks.max(1)).min(SENT_MAX)];
        let sum = block[1..].iter().fold(block[0], |sum, command| {
            Twist::new(sum.linear_mps + command.linear_mps, sum.angular_radps + command.angular_radps)
        });
        let share = 1.0 / block.len() as f32;
        Twist::new(sum.linear_mps * share, sum.angular_radps * share)
    }

    /// As a policy sees them: the means over the last steps of so many ticks, newest first.
    pub fn seen(&self, step_ticks: usize) -> [Twist; SENT_COMMANDS] {
        core::array::from_fn(|step| self.mean(step * step_ticks, step_ticks))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_is_seen_as_the_mean_of_its_ticks() {
        let mut sent = Sent::default();
        (1..=6_u8).for_each(|tick| sent.push(Twist::new(f32::from(tick), -f32::from(tick))));
        assert_eq!(sent.seen(1), [Twist::new(6.0, -6.0), Twist::new(5.0, -5.0)]);
        assert_eq!(sent.seen(2), [Twist::new(5.5, -5.5), Twist::new(3.5, -3.5)]);
        assert_eq!(sent.mean(5, 4), Twist::new(0.25, -0.25), "before the first it stood");
        assert_eq!(sent.with_newest(Twist::ZERO).seen(1)[0], Twist::ZERO);
        assert_eq!(sent.mean(SENT_MAX + 9, 1), Twist::ZERO, "nothing older is kept");
    }
}
