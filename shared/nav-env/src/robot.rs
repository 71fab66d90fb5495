//! A simulated robot with its controller in the same process: what is scored is what ships.

use nav_core::controller::Controller;
use nav_core::geometry::{Point, Pose};
use nav_core::metrics::EpisodeMetrics;
use nav_core::shield::Shield;
use nav_core::task::Task;
use nav_core::tick::{Tick, TickStatus};
use nav_core::twist::Twist;
use nav_sim::disturbance::Disturbance;
use nav_sim::drawing::{Decision, EpisodeTrace, Seen, TraceStep};
use nav_sim::simulation::Simulation;
use std::convert::Infallible;
use std::time::Instant;

use crate::episode_loop::{Answer, Commands, Onlooker, drive_episode};
use crate::limits::Limits;
use crate::messages::{Messages, header};
use crate::other_lidar::OtherLidar;
use crate::searched::Searched;
use crate::seen::seen;
use crate::worlds::Place;

/// What drives an episode.
pub trait Driver: Tick {
    /// Called before each episode, for those that plan on the known map.
    fn begin(&mut self, _place: &Place) {}

    /// Called before each tick with where the `odom` frame lies in the map, for those that follow a path on it.
    fn localise(&mut self, _map_from_odom: Pose) {}

    /// Called before each tick with the true simulation, for ceilings: drivers that know what no robot can.
    fn see(&mut self, _truth: &Simulation) {}

    /// What its searches took since [`Self::begin`], of those that plan on a grid.
    fn searched(&self) -> Option<Searched> {
        None
    }

    /// The safety gate that it stands behind, for pictures of whom it follows.
    fn shield(&self) -> Option<&Shield> {
        None
    }
}

impl<S: AsRef<[f32]> + AsMut<[f32]>> Driver for Controller<S> {
    fn shield(&self) -> Option<&Shield> {
        Self::shield(self)
    }
}

/// A simulated robot. Order and time of its messages go on from episode to episode, as a robot's do.
#[derive(Clone, Debug)]
pub struct SimulatedRobot {
    task: Task,
    disturbance: Disturbance,
    limits: Limits,
    lidar: Option<OtherLidar>,
    seq: u64,
    goal_id: u32,
    messages: Messages,
}

/// An episode, and how long the driver's ticks took.
pub struct Driven {
    /// What it came to.
    pub metrics: EpisodeMetrics,
    /// Mean time of a tick, ns.
    pub tick_mean_ns: u64,
    /// Longest tick, ns.
    pub tick_max_ns: u64,
    /// What the driver's searches took, if it plans.
    pub searched: Option<Searched>,
    /// For a picture, if asked for.
    pub trace: Option<EpisodeTrace>,
}

impl SimulatedRobot {
    /// A simulated robot for a task.
    pub fn new(task: &Task, disturbance: &Disturbance) -> Self {
        Self {
            task: *task,
            disturbance: *disturbance,
            limits: Limits::default(),
            lidar: None,
            seq: 0,
            goal_id: 0,
            messages: Messages::default(),
        }
    }

    /// With other limits for its episodes.
    pub fn with_limits(self, limits: Limits) -> Self {
        Self { limits, ..self }
    }

    /// With another lidar than the policy was trained with.
    pub fn with_lidar(self, lidar: Option<OtherLidar>) -> Self {
        Self { lidar, ..self }
    }

    /// Drives an episode to its end.
    pub fn drive(&mut self, driver: &mut (impl Driver + ?Sized), place: &Place, with_trace: bool) -> Driven {
        let task = self.limits.task(&self.task, place.scene.episode_s(&self.task.robot));
        let task = self.lidar.map_or(task, |lidar| lidar.on(&task));
        let mut simulation =
            Simulation::new(place.world.clone(), &task, &self.disturbance, place.simulation_seed);
        let mut trace = with_trace.then(|| EpisodeTrace::begin(&place.world, &task));
        self.goal_id += 1;
        driver.begin(place);
        let goal_id = self.goal_id;
        let (status, command) = (TickStatus::default(), Twist::ZERO);
        let mut commands = InProcess { robot: self, driver, status, command, times: TickTimes::default() };
        let Ok(metrics) = drive_episode(&mut simulation, place, goal_id, &mut commands, &mut trace);
        let TickTimes { count, total_ns, max_ns } = commands.times;
        let searched = commands.driver.searched();
        if let Some(trace) = &mut trace {
            trace.steps.push(TraceStep::of(&simulation, None));
            (trace.end, trace.hit_while_standing) = (Some(metrics.end), metrics.hit_while_standing);
        }
        Driven { metrics, tick_mean_ns: total_ns / count.max(1), tick_max_ns: max_ns, searched, trace }
    }
}

/// Commands from a driver that is called.
struct InProcess<'a, D: ?Sized> {
    robot: &'a mut SimulatedRobot,
    driver: &'a mut D,
    /// Of the newest tick.
    status: TickStatus,
    /// What left in it.
    command: Twist,
    times: TickTimes,
}

/// How long ticks took.
#[derive(Default)]
struct TickTimes {
    count: u64,
    total_ns: u64,
    max_ns: u64,
}

impl<D: Driver + ?Sized> Commands for InProcess<'_, D> {
    type Error = Infallible;

    fn exchange(&mut self, simulation: &mut Simulation, goal_id: u32) -> Result<Answer, Infallible> {
        let robot = &mut *self.robot;
        robot.seq += 1;
        let header = header(robot.seq, goal_id, robot.task.control_period_ns());
        robot.messages.measure(simulation, goal_id, header);
        self.driver.localise(simulation.map_from_odom());
        self.driver.see(simulation);
        let begun = Instant::now();
        let (command, status) = self.driver.tick(header.stamp_ns, robot.messages.inputs());
        let tick_ns = begun.elapsed().as_nanos() as u64;
        self.times.count += 1;
        self.times.total_ns += tick_ns;
        self.times.max_ns = self.times.max_ns.max(tick_ns);
        (self.status, self.command) = (status, command.twist());
        Ok(Answer { command: command.twist(), state: status.state })
    }
}

/// For a picture, if one is wanted.
impl<D: Driver + ?Sized> Onlooker<InProcess<'_, D>> for Option<EpisodeTrace> {
    fn commanded(&mut self, simulation: &Simulation, commands: &InProcess<'_, D>) {
        let Some(trace) = self else { return };
        let status = &commands.status;
        if status.decided.is_some() {
            trace.decisions.push(Decision {
                step: trace.steps.len(),
                subgoal: Point::new(status.subgoal_m.0, status.subgoal_m.1),
                action: status.action as u32,
            });
        }
        trace.steps.push(TraceStep::of(simulation, Some(commands.seen(simulation))));
    }
}

impl<D: Driver + ?Sized> InProcess<'_, D> {
    /// What the robot saw and did in the newest tick.
    fn seen(&self, simulation: &Simulation) -> Seen {
        let tracks = self.driver.shield().map_or(&[][..], |shield| shield.tracker().tracks());
        Seen {
            wish: self.status.wish,
            command: self.command,
            intervention: self.status.intervention,
            ..seen(simulation, &self.robot.messages, tracks)
        }
    }
}
