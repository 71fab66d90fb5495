//! What an update is told and what it tells.

use serde::{Deserialize, Serialize};

use crate::nn::EXPLODED;

/// Hyper-parameters. Names follow the paper where it has one.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Td3Config {
    /// Hidden widths of actor and critics.
    pub hidden: Vec<usize>,
    /// Adam step size of the actor.
    pub actor_learning_rate: f32,
    /// Adam step size of the critics.
    pub critic_learning_rate: f32,
    /// Polyak rate of the targets.
    pub tau: f32,
    /// Critic updates for one update of actor and targets.
    pub policy_delay: u32,
    /// Standard deviation of the target policy's noise, in units of the action.
    pub target_noise: f32,
    /// Largest target policy noise.
    pub target_noise_clip: f32,
    /// Whether the critics' hidden layers are normalised.
    pub critic_layer_norm: bool,
    /// Factor on the initial weights of the actor's last layer.
    pub actor_output_gain: f32,
    /// Least slope that the actor's tanh passes a gradient with where that moves the action inwards; 0 is the exact
    /// derivative, with which an actor in the flat ends of tanh never leaves them.
    pub tanh_slope_min: f32,
    /// Largest gradient norm, for actor and each critic; 0 means no limit.
    pub gradient_norm_max: f32,
    /// Weight of the temporal smoothness of the actor; 0 means off.
    pub smooth_temporal: f32,
    /// Weight of the spatial smoothness of the actor; 0 means off.
    pub smooth_spatial: f32,
    /// Standard deviation of the perturbation of the spatial smoothness, in units of the observation.
    pub smooth_spatial_noise: f32,
}

impl Default for Td3Config {
    fn default() -> Self {
        Self {
            hidden: vec![256, 256],
            actor_learning_rate: 3e-4,
            critic_learning_rate: 3e-4,
            tau: 0.005,
            policy_delay: 2,
            target_noise: 0.2,
            target_noise_clip: 0.5,
            critic_layer_norm: true,
            actor_output_gain: 0.1,
            tanh_slope_min: 0.1,
            gradient_norm_max: 0.0,
            smooth_temporal: 0.0,
            smooth_spatial: 0.0,
            smooth_spatial_noise: 0.05,
        }
    }
}

/// What one update tells. Values of the actor are those of its newest update.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Td3Losses {
    /// Mean squared TD error, summed over both critics.
    pub critic: f32,
    /// Mean of `-Q1(s, pi(s))`, without the regulariser.
    pub actor: f32,
    /// Mean of the first critic over the batch.
    pub q_mean: f32,
    /// Largest value of the first critic in the batch.
    pub q_max: f32,
    /// Mean of the TD target.
    pub target_mean: f32,
    /// Norm of the critics' gradient before clipping, the larger of the two.
    pub critic_gradient_norm: f32,
    /// Norm of the actor's gradient before clipping.
    pub actor_gradient_norm: f32,
    /// Temporal smoothness loss, unweighted; 0 when off.
    pub smooth_temporal: f32,
    /// Spatial smoothness loss, unweighted; 0 when off.
    pub smooth_spatial: f32,
    /// Share of the policy's actions beyond ±0.99, where the exact slope of tanh is below 0.02.
    pub saturation: f32,
}

impl Td3Losses {
    /// Whether every number is finite and no value has exploded; a run that is not sane must be rolled back.
    pub fn is_sane(&self) -> bool {
        let Self { critic, actor, q_mean, q_max, target_mean, .. } = *self;
        let values = [actor, q_mean, q_max, target_mean].iter().all(|value| value.abs() < EXPLODED);
        let others = [critic, self.critic_gradient_norm, self.actor_gradient_norm];
        values && others.iter().all(|value| value.is_finite())
    }
}
