//! What a critic promised of an attempt, beside what came of it.
//!
//! The mean of a critic over a batch (`td3/q_mean`, `dqn/q_mean`) says nothing by itself. Of every attempt (stage of a
//! low level) or episode (stage of a high level) that terminated, the discounted return that really came from each
//! state to the end is compared with the critic's value of that state and of what was done there. The mean difference
//! is the bias (`td3/q_bias`, `dqn/q_bias`): positive where the critic promises too much. Attempts that were cut short
//! are left out, because what would have come of them is unknown.

use serde::{Deserialize, Serialize};

/// An attempt so far.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Trail {
    /// States and what was done there, side by side, as the learner reads them.
    inputs: Vec<f32>,
    rewards: Vec<f32>,
    /// From each state to the next.
    discounts: Vec<f32>,
}

/// A terminated attempt, judged.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Judged {
    /// Its states.
    pub states: u32,
    /// Discounted returns from each of them to the end, summed.
    pub returned: f32,
    /// The critic's values of them, summed.
    pub promised: f32,
}

impl Trail {
    /// Adds a state and what was done there, what it earned, and the discount to the next state.
    pub fn push(&mut self, input: &[&[f32]], reward: f32, discount: f32) {
        input.iter().for_each(|part| self.inputs.extend_from_slice(part));
        self.rewards.push(reward);
        self.discounts.push(discount);
    }

    /// Sum of the rewards, undiscounted.
    pub fn total(&self) -> f32 {
        self.rewards.iter().fold(0.0, |sum, reward| sum + reward)
    }

    /// Judges an attempt that has terminated by the values that the learner gives its states, summed.
    pub fn judge(&self, promised: impl FnOnce(&[f32]) -> f32) -> Judged {
        let (mut from_here, mut returned) = (0.0, 0.0);
        for (reward, discount) in self.rewards.iter().zip(&self.discounts).rev() {
            from_here = reward + discount * from_here;
            returned += from_here;
        }
        Judged { states: self.rewards.len() as u32, returned, promised: promised(&self.inputs) }
    }

    /// Forgets everything, for the next attempt.
    pub fn clear(&mut self) {
        self.inputs.clear();
        self.rewards.clear();
        self.discounts.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn returns_are_discounted_from_each_state_to_the_end() {
        let mut trail = Trail::default();
        trail.push(&[&[1.0], &[2.0]], 1.0, 0.5);
        trail.push(&[&[3.0], &[4.0]], 2.0, 0.5);
        trail.push(&[&[5.0], &[6.0]], 4.0, 0.5);
        let judged = trail.judge(|inputs| {
            assert_eq!(inputs, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
            10.0
        });
        // 4, then 2 + 4 / 2, then 1 + 4 / 2.
        assert_eq!(judged, Judged { states: 3, returned: 4.0 + 4.0 + 3.0, promised: 10.0 });
        assert!((trail.total() - 7.0).abs() < 1e-6);
        trail.clear();
        assert_eq!(
            trail.judge(|inputs| inputs.len() as f32),
            Judged { states: 0, returned: 0.0, promised: 0.0 }
        );
    }
}
