//! A trained policy, as a run keeps it: weights, normaliser, task, and what it reached on validation worlds.

use anyhow::{Context, Result, ensure};
use nav_core::controller::Controller;
use nav_core::task::{ACTION_COUNT, Task};
use nav_env::ActingNetwork;
use rand::SeedableRng;
use serde::{Deserialize, Serialize};

use crate::acting::{Normaliser, pack};
use crate::config::Config;
use crate::nn::{Mlp, MlpShape, Rng};
use crate::train::past::Past;
use crate::train::verdict::GateReport;

/// A network's shape and weights.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Weights {
    shape: MlpShape,
    parameters: Vec<f32>,
}

impl Weights {
    /// Those of a network.
    pub fn of(mlp: &Mlp) -> Self {
        Self { shape: mlp.shape().clone(), parameters: mlp.parameters().to_vec() }
    }

    /// The network again.
    ///
    /// # Errors
    /// Parameters that do not fit the shape.
    pub fn network(&self) -> Result<Mlp> {
        let mut mlp = Mlp::new(self.shape.clone(), &mut Rng::seed_from_u64(0));
        ensure!(mlp.set_parameters(&self.parameters), "the saved weights do not fit their network");
        Ok(mlp)
    }
}

/// A trained policy.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Policy {
    /// The configuration that it was trained with, as TOML.
    pub config_toml: String,
    /// The commit of the trainer.
    pub commit: String,
    /// The task, with the deviation margin that did best.
    pub task: Task,
    /// How the actor's observations are normalised.
    pub normaliser: Normaliser,
    /// The low level.
    pub actor: Weights,
    /// The high level; none in a flat policy.
    pub scorer: Option<Weights>,
    /// What it reached.
    pub gate: GateReport,
    /// What lies behind it.
    pub past: Past,
    /// Steps of all stages.
    pub env_steps: u64,
    /// Updates of all stages.
    pub updates: u64,
    /// Time spent training, over all interruptions, s.
    pub seconds: f64,
}

impl Policy {
    /// The configuration.
    ///
    /// # Errors
    /// A configuration of another version.
    pub fn config(&self) -> Result<Config> {
        let config = Config::parse_unchecked(&self.config_toml, crate::config::Profile::Quick);
        config.context("the policy's configuration is of another version of the trainer")
    }

    /// The low level for acting.
    ///
    /// # Errors
    /// Damaged weights.
    pub fn low(&self) -> Result<ActingNetwork> {
        Ok(pack(&self.actor.network()?, Some(&self.normaliser), 1)?)
    }

    /// A controller that drives with the low level straight at the goal.
    ///
    /// # Errors
    /// Damaged weights.
    pub fn flat_controller(&self) -> Result<Controller<Vec<f32>>> {
        Ok(Controller::new(&self.task, None, self.low()?)?)
    }

    /// The high level for acting, if there is one.
    ///
    /// # Errors
    /// Damaged weights.
    pub fn high(&self) -> Result<Option<ActingNetwork>> {
        match &self.scorer {
            None => Ok(None),
            Some(scorer) => Ok(Some(pack(&scorer.network()?, None, ACTION_COUNT)?)),
        }
    }
}
