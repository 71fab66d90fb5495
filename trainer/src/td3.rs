//! TD3: twin delayed deep deterministic policy gradient (Fujimoto, van Hoof and Meger 2018), one update
//! from one batch.
//!
//! Algorithm 1 of the paper, with these differences:
//! 1. Hidden layers of the critics are layer-normalised (`critic_layer_norm`), which keeps their values
//!    bounded outside the data.
//! 2. The discount is a column of the batch (`gamma`, or 0 after a terminated episode), not a constant.
//! 3. The actor's loss may carry the CAPS regulariser (Mysore et al. 2021): squared difference of the action
//!    to that of the next observation (temporal) and to that of a perturbed observation (spatial), each a mean
//!    over batch and action dimensions.
//! 4. The actor's last layer starts small, so that a fresh policy does not sit in the flat ends of tanh.
//! 5. Where tanh is flat, the actor's gradient passes with a least slope (`tanh_slope_min`) if it moves the action
//!    inwards, so that a saturated actor can turn back.
//! 6. Gradients may be clipped by norm.

mod config;
mod batch;
mod smooth;
#[cfg(test)]
mod tests;

use nav_sim::normal::standard_normal;
use rand::SeedableRng;
use serde::{Deserialize, Serialize};

pub use self::batch::{Batch, Mirror, Transition};
pub use self::config::{Td3Config, Td3Losses};
use self::smooth::Smoothness;
use crate::nn::flat::mean;
use crate::nn::{Activation, Adam, AdamState, Buffer, Mlp, MlpShape, Rng, descend, flat};

/// A critic, its target and its optimiser.
#[derive(Debug)]
struct Critic {
    online: Mlp,
    target: Mlp,
    adam: Adam,
}

/// The learner.
#[derive(Debug)]
pub struct Td3 {
    config: Td3Config,
    observation: usize,
    action: usize,
    actor: Mlp,
    actor_target: Mlp,
    actor_adam: Adam,
    critics: [Critic; 2],
    smoothness: Option<Smoothness>,
    rng: Rng,
    updates: u64,
    losses: Td3Losses,
    target: Vec<f32>,
    gradient: Vec<f32>,
}

/// Everything that must be saved to continue exactly.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Td3State {
    actor: Vec<f32>,
    actor_target: Vec<f32>,
    actor_adam: AdamState,
    critics: [(Vec<f32>, Vec<f32>, AdamState); 2],
    learning_rates: (f32, f32),
    rng: Rng,
    updates: u64,
    losses: Td3Losses,
}

impl Td3 {
    /// A learner with fresh weights for observations and actions of the given widths.
    pub fn new(observation: usize, action: usize, config: Td3Config, seed: u64) -> Self {
        let mut rng = Rng::seed_from_u64(seed);
        let mut actor_shape = MlpShape::new(observation, &config.hidden, action, Activation::Tanh);
        actor_shape.output_gain = config.actor_output_gain;
        let mut critic_shape = MlpShape::new(observation + action, &config.hidden, 1, Activation::Identity);
        critic_shape.layer_norm = config.critic_layer_norm;
        let actor = Mlp::new(actor_shape, &mut rng);
        let critics = [(); 2].map(|()| {
            let online = Mlp::new(critic_shape.clone(), &mut rng);
            let adam = Adam::new(online.parameters().len(), config.critic_learning_rate);
            Critic { target: online.twin(), online, adam }
        });
        let smoothness = Smoothness::new(&config, observation, action);
        Self {
            actor_target: actor.twin(),
            actor_adam: Adam::new(actor.parameters().len(), config.actor_learning_rate),
            actor,
            critics,
            smoothness,
            rng,
            updates: 0,
            losses: Td3Losses::default(),
            target: Vec::new(),
            gradient: Vec::new(),
            observation,
            action,
            config,
        }
    }

    /// The policy.
    pub fn actor(&self) -> &Mlp {
        &self.actor
    }

    /// Takes over the weights of another actor, for itself and its target; false, and nothing changes, when it is of
    /// another size.
    #[must_use]
    pub fn set_actor(&mut self, actor: &Mlp) -> bool {
        self.actor.set_parameters(actor.parameters()) && self.actor_target.set_parameters(actor.parameters())
    }

    /// The first critic's values of normalised observations and actions, side by side.
    pub fn values(&mut self, inputs: &Buffer) -> &[f32] {
        self.critics[0].online.forward(&inputs.view(inputs.rows()))
    }

    /// Updates made.
    pub fn updates(&self) -> u64 {
        self.updates
    }

    /// Sets both learning rates to a share of the configured ones, for a schedule and after a roll-back.
    pub fn set_learning_rate_share(&mut self, share: f32) {
        self.actor_adam.set_learning_rate(share * self.config.actor_learning_rate);
        for critic in &mut self.critics {
            critic.adam.set_learning_rate(share * self.config.critic_learning_rate);
        }
    }

    /// One update of the critics and, every `policy_delay` updates, of actor and targets.
    ///
    /// The action columns of `batch` are overwritten.
    ///
    /// # Panics
    /// When the batch has other widths than the learner.
    pub fn update(&mut self, batch: &mut Batch) -> Td3Losses {
        assert_eq!(batch.widths(), (self.observation, self.action), "batch and learner agree on widths");
        self.updates += 1;
        self.compute_target(batch);
        self.update_critics(batch);
        if self.updates.is_multiple_of(u64::from(self.config.policy_delay.max(1))) {
            self.update_actor(batch);
            let tau = self.config.tau;
            flat::polyak(self.actor_target.parameters_mut(), self.actor.parameters(), tau);
            for Critic { online, target, .. } in &mut self.critics {
                flat::polyak(target.parameters_mut(), online.parameters(), tau);
            }
        }
        self.losses
    }

    /// `y = r + discount * min_i Q_i'(s', clip(pi'(s') + clip(noise)))`
    fn compute_target(&mut self, batch: &mut Batch) {
        let Td3Config { target_noise, target_noise_clip: clip, .. } = self.config;
        let actions = self.actor_target.forward(&batch.next_observation());
        for (row, action) in actions.chunks_exact(self.action).enumerate() {
            for (slot, action) in batch.next_action_mut(row).iter_mut().zip(action) {
                let noise = (target_noise * standard_normal(&mut self.rng)).clamp(-clip, clip);
                *slot = (action + noise).clamp(-1.0, 1.0);
            }
        }
        let input = batch.next_critic_input();
        let [first, second] = &mut self.critics;
        let values = first.target.forward(&input).iter().zip(second.target.forward(&input));
        self.target.clear();
        self.target.extend(
            values
                .zip(batch.rewards().iter().zip(batch.discounts()))
                .map(|((q1, q2), (reward, discount))| reward + discount * q1.min(*q2)),
        );
        self.losses.target_mean = mean(&self.target);
    }

    /// Mean squared error to the target, for each critic by itself.
    fn update_critics(&mut self, batch: &Batch) {
        let input = batch.critic_input();
        let rows = batch.rows() as f32;
        self.losses.critic = 0.0;
        self.losses.critic_gradient_norm = 0.0;
        for (index, Critic { online, adam, .. }) in self.critics.iter_mut().enumerate() {
            let q = online.forward(&input);
            if index == 0 {
                self.losses.q_mean = mean(q);
                self.losses.q_max = q.iter().copied().fold(f32::NEG_INFINITY, f32::max);
            }
            self.gradient.clear();
            self.gradient.extend(q.iter().zip(&self.target).map(|(q, y)| 2.0 / rows * (q - y)));
            let squares: f32 = q.iter().zip(&self.target).map(|(q, y)| (q - y) * (q - y)).sum();
            self.losses.critic += squares / rows;
            online.zero_gradients();
            online.backward(&input, &self.gradient);
            let norm = descend(online, adam, self.config.gradient_norm_max);
            self.losses.critic_gradient_norm = self.losses.critic_gradient_norm.max(norm);
        }
    }

    /// Ascends `Q1(s, pi(s))`, minus the smoothness losses.
    fn update_actor(&mut self, batch: &mut Batch) {
        let rows = batch.rows();
        match &mut self.smoothness {
            Some(smoothness) => {
                smoothness.fill(batch, &mut self.rng);
                self.actor.forward(&smoothness.input())
            }
            None => self.actor.forward(&batch.observation()),
        };
        let actions = &self.actor.output()[..rows * self.action];
        for (row, action) in actions.chunks_exact(self.action).enumerate() {
            batch.action_mut(row).copy_from_slice(action);
        }
        let saturated = actions.iter().filter(|action| action.abs() > 0.99).count();
        self.losses.saturation = saturated as f32 / actions.len() as f32;

        let critic = &mut self.critics[0].online;
        self.losses.actor = -mean(critic.forward(&batch.critic_input()));
        self.target.clear();
        self.target.resize(rows, -1.0 / rows as f32);
        let columns = self.observation..self.observation + self.action;
        self.gradient.clear();
        self.gradient.extend_from_slice(critic.input_gradient(&self.target, columns));
        if let Some(smoothness) = &self.smoothness {
            let (temporal, spatial) = smoothness.add_gradient(self.actor.output(), rows, &mut self.gradient);
            self.losses.smooth_temporal = temporal;
            self.losses.smooth_spatial = spatial;
        }
        self.actor.zero_gradients();
        let input = self.smoothness.as_ref().map_or_else(|| batch.observation(), Smoothness::input);
        self.actor.backward_with_slope_floor(&input, &self.gradient, self.config.tanh_slope_min);
        let limit = self.config.gradient_norm_max;
        self.losses.actor_gradient_norm = descend(&mut self.actor, &mut self.actor_adam, limit);
    }

    /// What must be saved to continue exactly.
    pub fn state(&self) -> Td3State {
        let critic = |critic: &Critic| {
            let Critic { online, target, adam } = critic;
            (online.parameters().to_vec(), target.parameters().to_vec(), adam.state().clone())
        };
        Td3State {
            actor: self.actor.parameters().to_vec(),
            actor_target: self.actor_target.parameters().to_vec(),
            actor_adam: self.actor_adam.state().clone(),
            critics: [critic(&self.critics[0]), critic(&self.critics[1])],
            learning_rates: (self.actor_adam.learning_rate(), self.critics[0].adam.learning_rate()),
            rng: self.rng.clone(),
            updates: self.updates,
            losses: self.losses,
        }
    }

    /// Continues from a saved state; false when it is of another network size (the learner is then useless).
    #[must_use]
    pub fn restore(&mut self, state: Td3State) -> bool {
        let mut fits = self.actor.set_parameters(&state.actor)
            && self.actor_target.set_parameters(&state.actor_target)
            && self.actor_adam.restore(state.actor_adam);
        self.actor_adam.set_learning_rate(state.learning_rates.0);
        for (critic, (online, target, adam)) in self.critics.iter_mut().zip(state.critics) {
            fits = fits
                && critic.online.set_parameters(&online)
                && critic.target.set_parameters(&target)
                && critic.adam.restore(adam);
            critic.adam.set_learning_rate(state.learning_rates.1);
        }
        self.rng = state.rng;
        self.updates = state.updates;
        self.losses = state.losses;
        fits
    }
}
