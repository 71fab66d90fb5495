//! One robot in one world, through the robot's own navigator and guard.

use nav_core::geometry::{Point, Pose};
use nav_core::guard::Guard;
use nav_core::messages::{LaserScan, Odometry};
use nav_core::navigator::Navigator;
use nav_core::observation::LOW_OBSERVATION;
use nav_core::shielding::Shielding;
use nav_core::task::Task;
use nav_core::twist::Twist;
use nav_sim::disturbance::Disturbance;
use nav_sim::families::lasting;
use nav_sim::simulation::{Outcome, Simulation};

use crate::worlds::Place;

/// A robot that has believed for so long that it has arrived, and has not, will not find out any more: a localiser's
/// correction takes less, s.
const ASTRAY_S: f32 = 3.0;

/// A simulated robot, observed at every moment.
#[derive(Clone, Debug)]
pub struct Episode {
    task: Task,
    place: Place,
    simulation: Simulation,
    navigator: Navigator,
    guard: Guard,
    /// The safety gate and the odometry that it goes by; none in training.
    gate: Option<Box<(Shielding, Odometry)>>,
    scan: Box<LaserScan>,
    goal_id: u32,
    /// Steps for which it has believed to have arrived.
    arrived_steps: u32,
}

impl Episode {
    /// A robot at the start of a place.
    pub fn new(place: Place, task: &Task, disturbance: &Disturbance, seed: u64) -> Self {
        let lasting_task = lasting(task, place.scene.episode_s(&task.robot));
        let simulation = Simulation::new(place.world.clone(), &lasting_task, disturbance, seed);
        let mut episode = Self {
            task: *task,
            place,
            simulation,
            navigator: Navigator::new(task),
            guard: Guard::new(task),
            gate: None,
            scan: Box::default(),
            goal_id: 0,
            arrived_steps: 0,
        };
        episode.observe();
        episode
    }

    /// The same, behind the safety gate if the task has one: from the next [restart](Self::restart) on.
    #[must_use]
    pub fn behind_gate(self) -> Self {
        let gate = Some(Box::new((Shielding::new(&self.task), Odometry::default())));
        Self { gate, ..self }
    }

    /// Starts again, elsewhere.
    pub fn restart(&mut self, place: Place, seed: u64) {
        self.simulation.reset(place.world.clone(), seed);
        let least_s = place.scene.episode_s(&self.task.robot);
        self.simulation.set_episode_s(lasting(&self.task, least_s).episode_s);
        self.place = place;
        self.goal_id = self.goal_id.wrapping_add(1);
        self.arrived_steps = 0;
        self.guard.restart_from(Twist::ZERO, 0);
        if let Some(gate) = &mut self.gate {
            gate.0.forget();
        }
        self.observe();
    }

    /// Drives a step with a low-level action in [-1, 1].
    pub fn drive(&mut self, action: [f32; 2]) -> Outcome {
        let wish = self.navigator.decode_low(action);
        self.send(wish)
    }

    /// Stands (or brakes) for a step.
    pub fn wait(&mut self) -> Outcome {
        self.send(Twist::ZERO)
    }

    fn send(&mut self, wish: Twist) -> Outcome {
        let safe = match self.gate.as_deref() {
            Some((gate, odom)) => gate.filter(wish, odom, &self.guard, &self.navigator).0,
            None => wish,
        };
        let (command, _) = self.guard.limit(safe);
        let outcome = self.simulation.step(command);
        self.observe();
        outcome
    }

    fn observe(&mut self) {
        self.simulation.scan(&mut self.scan);
        let (odom, goal) = (self.simulation.odometry(), self.simulation.goal(self.goal_id));
        self.navigator.observe(&self.scan, &odom, &goal);
        if let Some(gate) = &mut self.gate {
            gate.0.observe(&self.scan, &odom, &self.navigator);
            gate.1 = odom;
        }
        self.arrived_steps = if self.navigator.goal_reached() { self.arrived_steps + 1 } else { 0 };
    }

    /// Whether the robot stands where it wrongly believes the goal to be, and will for the rest of the episode.
    pub fn is_astray(&self) -> bool {
        let period_s = self.task.control_period_s;
        !self.simulation.outcome().is_over() && self.arrived_steps as f32 * period_s > ASTRAY_S
    }

    /// What the low level sees of the way to the decision's subgoal.
    pub fn encode_low(&self, observation: &mut [f32; LOW_OBSERVATION]) {
        self.navigator.encode_low(self.guard.sent(), observation);
    }

    /// What the low level sees of the way to any target of the `odom` frame.
    pub fn encode_low_towards(&self, target: Point, observation: &mut [f32; LOW_OBSERVATION]) {
        self.navigator.encode_low_towards(target, self.guard.sent(), observation);
    }

    /// Where it drives.
    pub fn place(&self) -> &Place {
        &self.place
    }

    /// What the robot knows.
    pub fn navigator(&self) -> &Navigator {
        &self.navigator
    }

    /// What the robot knows, to decide with.
    pub fn navigator_mut(&mut self) -> &mut Navigator {
        &mut self.navigator
    }

    /// The truth.
    pub fn simulation(&self) -> &Simulation {
        &self.simulation
    }

    /// Shortest way from where the robot truly is to the goal, m; `None` where its centre is closer to an
    /// obstacle than the footprint fits.
    pub fn way_m(&self) -> Option<f32> {
        self.place.field.distance_m(self.simulation.pose().position())
    }

    /// Where the robot truly is.
    pub fn pose(&self) -> Pose {
        self.simulation.pose()
    }
}
