//! Floor 2: the environment without torch. Robots drive in simulated worlds, to learn or to be judged.
//!
//! Reading order: [`worlds`] (where they drive), [`episode`] (one robot in one world, step by step), [`low`] and
//! [`high`] (what each level learns from), [`drive`] (an episode through a controller, as on the robot) and
//! [`batch`] (many of them); [`seeds`] keeps random streams apart.

pub mod seeds;
pub mod worlds;

pub mod episode;
pub mod high;
pub mod low;

pub mod batch;
pub mod drive;

/// A network for acting, with its own memory.
pub type ActingNetwork = nav_core::network::Network<Vec<f32>>;
