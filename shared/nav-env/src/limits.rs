//! How an episode ends where somebody asks for something else than the task and the family say: a time limit of a
//! benchmark, a goal that is easier to reach. The policy is not told.

use nav_core::task::Task;
use nav_sim::families::lasting;
use serde::{Deserialize, Serialize};

/// What is asked for; nothing by default.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Limits {
    /// Simulated time after which an episode is over, s.
    pub time_limit_s: Option<f32>,
    /// The goal counts as reached when the robot's centre is this close, m.
    pub goal_radius_m: Option<f32>,
}

impl Limits {
    /// The first limit that makes no sense, as a sentence.
    ///
    /// # Errors
    /// A limit outside its range, named by its flag and unit.
    pub fn validate(&self) -> Result<(), &'static str> {
        let within =
            |value: Option<f32>, low: f32, high: f32| value.is_none_or(|value| value >= low && value <= high);
        if !within(self.time_limit_s, 1.0, 86_400.0) {
            return Err("--time-limit must lie in [1, 86400] s");
        }
        if !within(self.goal_radius_m, 0.05, 2.0) {
            return Err("--goal-radius must lie in [0.05, 2] m");
        }
        Ok(())
    }

    /// The task of an episode in a world that needs so long, s: without limits that of the policy, or longer
    /// where the world needs it.
    pub fn task(&self, task: &Task, least_s: f32) -> Task {
        let mut limited = lasting(task, least_s);
        if let Some(time_limit_s) = self.time_limit_s {
            limited.episode_s = time_limit_s;
        }
        if let Some(goal_radius_m) = self.goal_radius_m {
            limited.goal_radius_m = goal_radius_m;
        }
        limited
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_limit_replaces_what_task_and_family_say() {
        let task = Task { control_period_s: 0.05, ..Task::default() };
        let longer = Limits::default().task(&task, 80.0);
        assert_eq!((longer, longer.episode_steps()), (Task { episode_s: 80.0, ..task }, 1600));
        let limits = Limits { time_limit_s: Some(12.0), goal_radius_m: Some(1.0) };
        assert_eq!(limits.task(&task, 80.0), Task { episode_s: 12.0, goal_radius_m: 1.0, ..task });
    }

    #[test]
    fn nonsense_is_refused_by_its_flag() {
        let time = |time_limit_s| Limits { time_limit_s: Some(time_limit_s), goal_radius_m: None }.validate();
        assert_eq!(time(100.0), Ok(()));
        for bad in [0.0, -1.0, 1e9, f32::NAN] {
            assert!(time(bad).is_err_and(|sentence| sentence.contains("--time-limit")), "{bad}");
        }
        let radius = Limits { time_limit_s: None, goal_radius_m: Some(0.0) };
        assert!(radius.validate().is_err_and(|sentence| sentence.contains("--goal-radius")));
    }
}
