//! What a simulated robot publishes at a moment.

use nav_core::messages::{Goal, Header, LaserScan, Odometry};
use nav_core::tick::Inputs;
use nav_sim::simulation::Simulation;

/// Simulated time that passes between two episodes, ns. Setting a robot down elsewhere takes time, and who drives it must not
/// take what was seen before for what is there now, even where it is set down as it stood: an episode does not depend on
/// those before it.
const BETWEEN_EPISODES_NS: u64 = 100_000_000_000;

/// Header of a robot's `seq`-th messages, in simulated time; `episode` counts those that it began.
pub fn header(seq: u64, episode: u32, period_ns: u64) -> Header {
    Header { stamp_ns: seq * period_ns + u64::from(episode) * BETWEEN_EPISODES_NS, seq }
}

/// The newest message of each topic that a robot writes.
#[derive(Clone, Debug, Default)]
pub struct Messages {
    /// The scan.
    pub scan: Box<LaserScan>,
    /// The odometry.
    pub odom: Odometry,
    /// The goal.
    pub goal: Goal,
}

impl Messages {
    /// Takes in the simulation's present moment under one header.
    pub fn measure(&mut self, simulation: &mut Simulation, goal_id: u32, header: Header) {
        simulation.scan(&mut self.scan);
        self.scan.header = header;
        self.odom = Odometry { header, ..simulation.odometry() };
        self.goal = Goal { header, ..simulation.goal(goal_id) };
    }

    /// As a controller reads them.
    pub fn inputs(&self) -> Inputs<'_> {
        Inputs { scan: &self.scan, odom: &self.odom, goal: &self.goal }
    }
}
