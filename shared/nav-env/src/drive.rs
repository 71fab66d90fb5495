//! One episode in process, through the runtime's own [`Controller`]: what is scored is what ships.

use nav_core::controller::Controller;
use nav_core::geometry::Point;
use nav_core::messages::{Goal, Header, LaserScan, Odometry};
use nav_core::metrics::{EpisodeEnd, EpisodeMetrics, EpisodeRecorder, StepTruth};
use nav_core::task::Task;
use nav_core::tick::{Inputs, Tick, TickStatus};
use nav_sim::disturbance::Disturbance;
use nav_sim::drawing::{Decision, EpisodeTrace, TraceStep};
use nav_sim::families::lasting;
use nav_sim::simulation::{Outcome, Simulation};

use crate::worlds::Place;

/// What drives an episode.
pub trait Driver: Tick {
    /// Called before each episode, for policies that plan on the known map.
    fn begin(&mut self, _place: &Place) {}
}

impl<S: AsRef<[f32]> + AsMut<[f32]>> Driver for Controller<S> {}

/// The messages of a simulated robot. Order and time go on from episode to episode, as a robot's do.
pub struct Bench {
    task: Task,
    disturbance: Disturbance,
    seq: u64,
    goal_id: u32,
    scan: Box<LaserScan>,
}

/// An episode, and how long the driver's ticks took.
pub struct Driven {
    /// What it came to.
    pub metrics: EpisodeMetrics,
    /// Mean time of a tick, ns.
    pub tick_mean_ns: f64,
    /// Longest tick, ns.
    pub tick_max_ns: u64,
    /// For a picture, if asked for.
    pub trace: Option<EpisodeTrace>,
}

impl Bench {
    /// A simulated robot for a task.
    pub fn new(task: &Task, disturbance: &Disturbance) -> Self {
        Self { task: *task, disturbance: *disturbance, seq: 0, goal_id: 0, scan: Box::default() }
    }

    /// Drives an episode to its end.
    pub fn drive(&mut self, driver: &mut impl Driver, place: &Place, with_trace: bool) -> Driven {
        let task = lasting(&self.task, place.family.episode_steps());
        let mut simulation =
            Simulation::new(place.world.clone(), &task, &self.disturbance, place.simulation_seed);
        let mut recorder = EpisodeRecorder::new(simulation.pose(), self.task.control_period_s);
        let mut trace = with_trace.then(|| self.trace_of(place));
        let (mut ticked_ns, mut tick_max_ns, mut ticks) = (0_u64, 0, 0_u64);
        self.goal_id += 1;
        driver.begin(place);
        let outcome = loop {
            let (odom, goal, now_ns) = self.messages(&mut simulation);
            let inputs = Inputs { scan: &self.scan, odom: &odom, goal: &goal };
            let clock = std::time::Instant::now();
            let (command, status) = driver.tick(now_ns, inputs);
            let tick_ns = clock.elapsed().as_nanos() as u64;
            (ticked_ns, ticks) = (ticked_ns + tick_ns, ticks + 1);
            tick_max_ns = tick_max_ns.max(tick_ns);
            if let Some(trace) = &mut trace {
                note(trace, &simulation, &status);
            }
            let outcome = simulation.step(command.twist());
            recorder.step(&StepTruth {
                pose: simulation.pose(),
                linear_mps: simulation.velocity().linear_mps,
                clearance_m: simulation.clearance_m(),
                time_to_collision_s: simulation.time_to_collision_s(),
            });
            if outcome.is_over() {
                break outcome;
            }
        };
        let end = match outcome {
            Outcome::Reached => EpisodeEnd::Success,
            Outcome::Collided => EpisodeEnd::Collision,
            Outcome::TimedOut | Outcome::Running => EpisodeEnd::Timeout,
        };
        let start = place.world.start.position();
        let euclidean_m = (place.world.goal - start).norm();
        let geodesic_m = place.field.path_length_m(start).unwrap_or(euclidean_m);
        if let Some(trace) = &mut trace {
            note_step(trace, &simulation);
            trace.end = Some(end);
        }
        Driven {
            metrics: recorder.finish(end, simulation.hit_while_standing(), geodesic_m, euclidean_m),
            tick_mean_ns: ticked_ns as f64 / ticks as f64,
            tick_max_ns,
            trace,
        }
    }

    fn messages(&mut self, simulation: &mut Simulation) -> (Odometry, Goal, u64) {
        self.seq += 1;
        let header = Header { seq: self.seq, stamp_ns: self.seq * self.task.control_period_ns() };
        simulation.scan(&mut self.scan);
        self.scan.header = header;
        let odom = Odometry { header, ..simulation.odometry() };
        let goal = Goal { header, ..simulation.goal(self.goal_id) };
        (odom, goal, header.stamp_ns)
    }

    fn trace_of(&self, place: &Place) -> EpisodeTrace {
        EpisodeTrace {
            world: place.world.clone(),
            robot_radius_m: self.task.robot.radius_m,
            goal_radius_m: self.task.goal_radius_m,
            title: place.world.name.clone(),
            steps: Vec::new(),
            decisions: Vec::new(),
            end: None,
        }
    }
}

fn note(trace: &mut EpisodeTrace, simulation: &Simulation, status: &TickStatus) {
    if status.decided.is_some() {
        trace.decisions.push(Decision {
            step: trace.steps.len(),
            subgoal: Point::new(status.subgoal_m.0, status.subgoal_m.1),
            action: status.action as u32,
        });
    }
    note_step(trace, simulation);
}

fn note_step(trace: &mut EpisodeTrace, simulation: &Simulation) {
    let people = simulation.people().iter().map(|person| person.position).collect();
    trace.steps.push(TraceStep { pose: simulation.pose(), people });
}
