//! Floor 2: the environment without torch. Robots drive in simulated worlds, to learn or to be judged.
//!
//! Reading order: [`worlds`] (where they drive); to learn, [`episode`] (one robot in one world, step by step), [`low`]
//! and [`high`] (what each level learns from); to be judged, [`messages`] and [`episode_loop`] (the one loop of an
//! episode) within [`limits`], [`robot`] (with a controller in the same process), [`searched`] (what a planner tells of itself), [`informed`] (one that is told who moves),
//! [`other_lidar`] (for its scans), [`seen`] (for its pictures), [`batch`] (many of them), [`rows`] and [`summary`] (what is kept of them). [`seeds`] keeps random streams apart.
//! [`robot_profile`] knows robots by name.

pub mod seeds;
pub mod robot_profile;
pub mod worlds;

pub mod episode;
pub mod low;
pub mod high;

pub mod messages;
pub mod episode_loop;
pub mod limits;
pub mod other_lidar;
pub mod searched;
pub mod robot;
pub mod informed;
pub mod seen;
pub mod batch;
pub mod rows;
pub mod summary;

/// A network for acting, with its own memory.
pub type ActingNetwork = nav_core::network::Network<Vec<f32>>;
