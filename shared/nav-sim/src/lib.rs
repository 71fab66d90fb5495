//! Floor 1: simulated worlds for a differential-drive robot with a lidar. Seeded and clock-free: the same
//! seed and commands give the same bits, on every machine: sine, logarithm and their like come from `libm`,
//! as in nav-core, never from the system's C library. (`dodgy_2d`, which chooses the velocities of ORCA people,
//! needs only sums, products and square roots for them: what it would draw at random is kept from it, see
//! `people/orca.rs`.)
//!
//! Reading order: [`world`] (what a world is), [`families`] (where worlds come from), [`simulation`]
//! (reset and step) with its parts [`dynamics`], [`odometer`], [`localiser`], [`disturbance`], [`obstacles`],
//! [`collision`], [`lidar`] (whose noise is [`normal`]) and [`people`], then [`geodesic`] (path check and shortest
//! distances), [`map_file`], [`world_file`] and [`cylinders`] (worlds from disk), [`drawing`] (pictures of episodes).

pub mod world;
pub mod families;

pub mod simulation;
pub mod dynamics;
pub mod odometer;
pub mod localiser;
pub mod disturbance;
pub mod obstacles;
pub mod collision;
pub mod body;
pub mod lidar;
pub mod normal;
pub mod people;

pub mod geodesic;

pub mod map_file;
pub mod world_file;
pub mod cylinders;

pub mod drawing;
