//! The defaults of every field, and what the profiles make of them.

use nav_core::manifest::Algorithm;
use nav_core::reward::{RewardProfile, decomposed, paper};
use nav_core::task::Task;
use nav_env::low::Progress;
use nav_sim::disturbance::Disturbance;
use nav_sim::families::Family;

use super::{CollapseConfig, Config, CurveConfig, GateConfig, HighConfig, LowConfig, Profile};
use crate::dqn::DqnConfig;
use crate::td3::Td3Config;

impl Default for Config {
    fn default() -> Self {
        Self::of_profile(Profile::Quick)
    }
}

impl Config {
    /// The defaults of a profile.
    pub fn of_profile(profile: Profile) -> Self {
        Self::of(profile, Task::default())
    }

    /// The defaults of a profile for a task.
    pub fn of(profile: Profile, task: Task) -> Self {
        let mut config = Self {
            profile,
            robot: None,
            algorithm: Algorithm::Hybrid,
            seed: 1,
            worlds_per_family: 300,
            task,
            disturbance: Disturbance::trained().on(&task.robot),
            low: LowConfig::of(&task),
            high: HighConfig::of(&task),
            gate: GateConfig::default(),
            curve: CurveConfig::default(),
        };
        if profile == Profile::Full {
            config.worlds_per_family = 1_000;
            config.high.decisions = 250_000;
            config.high.dqn.hidden = vec![128, 128];
            config.gate.low_reach = 0.97;
            config.gate.low_collision = 0.02;
            config.gate.spin = 0.03;
            config.gate.static_collision = 0.1;
            config.gate.clutter_success = 0.95;
            config.gate.u_trap_success = 0.85;
        }
        config
    }
}

impl Default for LowConfig {
    fn default() -> Self {
        Self::of(&Task::default())
    }
}

/// The discount of a tick, from that of a step of the reference robot.
fn discount_of_tick(task: &Task, discount: f32) -> f32 {
    let share = task.step_share();
    if (share - 1.0).abs() < 1e-6 { discount } else { discount.powf(share) }
}

impl LowConfig {
    /// What suits a task.
    fn of(task: &Task) -> Self {
        let scale = task.scale();
        Self {
            families: vec![
                Family::Clutter,
                Family::Boxes,
                Family::Tight,
                Family::Rooms,
                Family::Maze,
                Family::UTrap,
                Family::Crowd,
            ],
            envs: 16,
            env_steps: 400_000,
            warmup_steps: 5_000,
            env_steps_per_update: 6,
            batch: 256,
            replay_capacity: 400_000,
            discount: discount_of_tick(task, 0.98),
            n_step: task.ticks(3.0 * scale.step_s()) as usize,
            mirror: true,
            noise: [0.05, 0.5],
            goal_share: 0.3,
            subgoal_m: [0.7, 3.0].map(|m| scale.m(m)),
            subgoal_s: scale.s(8.0),
            final_learning_rate_share: 0.1,
            reward: RewardProfile::Decomposed,
            progress: Progress::Straight,
            decomposed: decomposed::LowWeights::of(task),
            paper: paper::LowWeights::default(),
            collapse: CollapseConfig::default(),
            td3: Td3Config {
                hidden: vec![128, 128],
                actor_learning_rate: 1e-3,
                critic_learning_rate: 1e-3,
                smooth_temporal: 0.05,
                smooth_spatial: 0.0,
                ..Td3Config::default()
            },
        }
    }
}

impl Default for CollapseConfig {
    fn default() -> Self {
        Self { from_share: 0.34, reach_min: 0.1, saturation_max: 0.5 }
    }
}

impl Default for HighConfig {
    fn default() -> Self {
        Self::of(&Task::default())
    }
}

impl HighConfig {
    /// What suits a task.
    fn of(task: &Task) -> Self {
        Self {
            families: vec![
                Family::Clutter,
                Family::Boxes,
                Family::UTrap,
                Family::DeepU,
                Family::Maze,
                Family::Rooms,
                Family::Crowd,
            ],
            envs: 32,
            decisions: 90_000,
            warmup_decisions: 3_000,
            decisions_per_update: 3,
            batch: 128,
            replay_capacity: 150_000,
            discount: discount_of_tick(task, 0.995),
            n_step: 3,
            mirror: true,
            epsilon: [1.0, 0.05],
            epsilon_share: 0.4,
            random_goal_share: 0.25,
            final_learning_rate: 1.5e-4,
            reward: RewardProfile::Decomposed,
            decomposed: decomposed::HighWeights::of(task),
            paper: paper::HighWeights::default(),
            deviation_margins: vec![0.0, 0.1, 0.25, 0.5],
            dqn: DqnConfig { hidden: vec![64, 64], ..DqnConfig::default() },
        }
    }
}

impl Default for CurveConfig {
    fn default() -> Self {
        Self { points: 0, worlds: 20 }
    }
}

impl Default for GateConfig {
    fn default() -> Self {
        Self {
            low_reach: 0.9,
            low_collision: 0.05,
            spin: 0.05,
            worlds: 120,
            choosing_worlds: 60,
            static_collision: 0.15,
            people_collision_beyond_reactive: 0.05,
            clutter_success: 0.9,
            u_trap_success: 0.8,
        }
    }
}
