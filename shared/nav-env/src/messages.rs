//! What a simulated robot publishes at a moment.

use nav_core::messages::{Goal, Header, LaserScan, Odometry};
use nav_core::tick::Inputs;
use nav_sim::simulation::Simulation;

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
