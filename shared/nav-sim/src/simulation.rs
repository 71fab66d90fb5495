//! One robot in one world: reset and step.
//!
//! | step | what happens |
//! |---|---|
//! | 1 | people choose their velocities from where everybody stands |
//! | 2 | the command enters the latency queue; the one that leaves it becomes the base's target |
//! | 3 | base and people move in substeps; each is checked for collision, then for the goal |
//!
//! Start: the world's start pose, at rest. End: reached or collided (terminated), or `episode_s` is over
//! (truncated). Nothing here reads a clock; the same world, task, disturbance, seed and commands give the
//! same bits. People and sensor noise draw from separate streams, so noise never changes what people do.

mod outcome;

pub use self::outcome::Outcome;
use crate::body::Body;
use crate::disturbance::{Disturbance, DrawnDisturbance};
use crate::dynamics::Base;
use crate::lidar::{Lidar, measure};
use crate::localiser::Localisation;
use crate::obstacles::Obstacles;
use crate::odometer::Odometer;
use crate::people::{Crowd, PersonState, RobotState};
use crate::world::World;
use nav_core::footprint::Footprint;
use nav_core::geometry::{Pose, Vector};
use nav_core::messages::{Goal, Header, LaserScan, Odometry};
use nav_core::task::Task;
use nav_core::twist::Twist;
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use std::sync::Arc;

/// Below this speed a robot that is hit counts as standing, m/s of the reference robot ([`nav_core::scale`]).
pub const STANDING_MPS: f32 = 0.05;
/// [`Simulation::clearance_m`] looks this far, m of the reference robot.
pub const CLEARANCE_MAX_M: f32 = 10.0;

/// Separates the random streams of one seed.
const PEOPLE_STREAM: u64 = 0x7065_6f70_6c65;
const NOISE_STREAM: u64 = 0x6e_6f69_7365;
const LOCALISER_STREAM: u64 = 0x6c6f_6361_6c69;

/// One robot in one world.
#[derive(Clone, Debug)]
pub struct Simulation {
    world: Arc<World>,
    task: Task,
    disturbance: Disturbance,
    seed: u64,
    drawn: DrawnDisturbance,
    obstacles: Obstacles,
    lidar: Lidar,
    crowd: Crowd,
    base: Base,
    odometer: Odometer,
    localisation: Localisation,
    steps: u32,
    outcome: Outcome,
    hit_while_standing: bool,
}

impl Simulation {
    /// A simulation at its reset state.
    pub fn new(world: Arc<World>, task: &Task, disturbance: &Disturbance, seed: u64) -> Self {
        let drawn = disturbance.draw(task.control_period_s, &mut Xoshiro256PlusPlus::seed_from_u64(seed));
        let mut simulation = Self {
            obstacles: Obstacles::new(&world),
            lidar: Lidar::new(&task.lidar),
            crowd: Crowd::default(),
            base: Base::new(task, &drawn, world.start),
            odometer: Odometer::new(&drawn, world.start),
            localisation: Localisation::new(&drawn.localiser, seed ^ LOCALISER_STREAM),
            task: *task,
            disturbance: *disturbance,
            drawn,
            seed,
            world,
            steps: 0,
            outcome: Outcome::Running,
            hit_while_standing: false,
        };
        simulation.begin(seed);
        simulation
    }

    /// Starts another episode with the same task and disturbance, in the same memory. Once worlds as large have
    /// been seen, neither this nor a step allocates, except that ORCA people do (inside `dodgy_2d`).
    pub fn reset(&mut self, world: Arc<World>, seed: u64) {
        if !Arc::ptr_eq(&self.world, &world) {
            self.obstacles.rebuild(&world);
            self.world = world;
        }
        self.begin(seed);
    }

    /// Sets how long an episode may last, s, from this one on.
    pub fn set_episode_s(&mut self, episode_s: f32) {
        self.task.episode_s = episode_s;
    }

    fn begin(&mut self, seed: u64) {
        self.seed = seed;
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        self.drawn = self.disturbance.draw(self.task.control_period_s, &mut rng);
        self.base = Base::new(&self.task, &self.drawn, self.world.start);
        self.odometer = Odometer::new(&self.drawn, self.world.start);
        self.localisation = Localisation::new(&self.drawn.localiser, seed ^ LOCALISER_STREAM);
        self.crowd.reset(&self.world.people, &mut Xoshiro256PlusPlus::seed_from_u64(seed ^ PEOPLE_STREAM));
        self.steps = 0;
        self.outcome = Outcome::Running;
        self.hit_while_standing = false;
    }

    /// Drives for one control period and says how the episode stands. After the end nothing moves any more.
    pub fn step(&mut self, command: Twist) -> Outcome {
        if self.outcome.is_over() {
            return self.outcome;
        }
        let robot = RobotState {
            position: self.base.pose().position(),
            velocity: self.base.velocity_in_world(),
            radius_m: self.footprint().circumradius_m(),
        };
        self.crowd.decide(&self.world.people, robot, &self.obstacles, self.task.control_period_s);
        self.base.command(command);
        for _ in 0..self.base.substeps() {
            self.base.advance();
            self.odometer.advance(self.base.velocity(), self.base.substep_s());
            self.crowd.advance(self.base.substep_s());
            self.outcome = self.judged();
            if self.outcome.is_over() {
                break;
            }
        }
        self.steps += 1;
        self.localisation.advance(self.time_s(), self.base.pose(), self.odometer.pose());
        if self.outcome == Outcome::Collided {
            self.hit_while_standing =
                self.base.velocity().linear_mps.abs() < self.task.scale().mps(STANDING_MPS);
        } else if self.outcome == Outcome::Running && self.steps >= self.task.episode_steps() {
            self.outcome = Outcome::TimedOut;
        }
        self.outcome
    }

    fn judged(&self) -> Outcome {
        let body = self.body();
        let hits_person = self.crowd.people().iter().any(|person| body.touches_disc(&person.disc(), 0.0));
        if hits_person || self.obstacles.touches(&body) {
            Outcome::Collided
        } else if (self.world.goal - body.position()).norm() <= self.task.goal_radius_m {
            Outcome::Reached
        } else {
            Outcome::Running
        }
    }

    /// Measures a scan at the present pose. Noise depends on seed and step only: asked twice, the same scan.
    pub fn scan(&mut self, into: &mut LaserScan) {
        let moving = self.crowd.people().iter().map(PersonState::disc);
        let ranges_m = self.lidar.cast(self.task.lidar.pose(self.base.pose()), &self.obstacles, moving);
        let stream = (self.seed ^ NOISE_STREAM).wrapping_add(u64::from(self.steps) << 32);
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(stream);
        let DrawnDisturbance { range_noise_m, dropout, .. } = self.drawn;
        measure(ranges_m, &self.task.lidar, range_noise_m, dropout, &mut rng, into);
        into.header = self.header();
    }

    /// What wheel odometry believes at the present pose.
    pub fn odometry(&self) -> Odometry {
        Odometry {
            header: self.header(),
            pose: self.odometer.pose(),
            linear_mps: self.odometer.velocity().linear_mps,
            angular_radps: self.odometer.velocity().angular_radps,
            reserved: 0,
        }
    }

    /// The goal in the `odom` frame, where the newest correction of the localiser puts it. Without a localiser it
    /// does not move, and the drift stays.
    pub fn goal(&self, id: u32) -> Goal {
        let goal = self.localisation.odom_from_map().parent_from_local(self.world.goal);
        Goal { header: self.header(), x_m: goal.x, y_m: goal.y, radius_m: self.task.goal_radius_m, id }
    }

    /// Where the `odom` frame lies in the map (the world frame), as the localiser last said; without one, where it lay
    /// at reset. What `map_from_odom` makes of the odometry's pose is the localised pose.
    pub fn map_from_odom(&self) -> Pose {
        self.localisation.odom_from_map().inverse()
    }

    /// Order and simulated time of whatever is measured now: from 1 at reset, up by one a step.
    fn header(&self) -> Header {
        let seq = u64::from(self.steps) + 1;
        Header { stamp_ns: seq * self.task.control_period_ns(), seq }
    }

    /// True pose.
    pub fn pose(&self) -> Pose {
        self.base.pose()
    }

    /// True velocity.
    pub fn velocity(&self) -> Twist {
        self.base.velocity()
    }

    /// Steps since reset.
    pub fn steps(&self) -> u32 {
        self.steps
    }

    /// Steps until the episode is truncated.
    pub fn steps_left(&self) -> u32 {
        self.task.episode_steps().saturating_sub(self.steps)
    }

    /// Simulated time since reset, s.
    pub fn time_s(&self) -> f32 {
        self.steps as f32 * self.task.control_period_s
    }

    /// How the episode stands.
    pub fn outcome(&self) -> Outcome {
        self.outcome
    }

    /// The world.
    pub fn world(&self) -> &Arc<World> {
        &self.world
    }

    /// The world's static obstacles, prepared.
    pub fn obstacles(&self) -> &Obstacles {
        &self.obstacles
    }

    /// The task.
    pub fn task(&self) -> &Task {
        &self.task
    }

    /// The true footprint.
    pub fn footprint(&self) -> Footprint {
        self.task.robot.footprint.scaled(self.drawn.radius_scale)
    }

    /// The true footprint where it is. People who see the robot see the circle that it turns in.
    pub fn body(&self) -> Body {
        Body::new(self.footprint(), self.base.pose())
    }

    /// From the footprint's edge to the nearest static obstacle or person, m; negative in a collision, and
    /// never more than [`CLEARANCE_MAX_M`] (scaled).
    pub fn clearance_m(&self) -> f32 {
        let body = self.body();
        let most_m = self.task.scale().m(CLEARANCE_MAX_M);
        let people = self.crowd.people().iter().map(|person| body.distance_to_disc_m(&person.disc()));
        people.fold(self.obstacles.clearance_m(&body, most_m), f32::min)
    }

    /// Time until the footprint touches a person or static obstacle if all keep their present velocities
    /// (the robot straight ahead), s; `INFINITY` if that is more than [`crate::collision::HORIZON_S`] away.
    pub fn time_to_collision_s(&self) -> f32 {
        let (body, velocity) = (self.body(), self.base.velocity_in_world());
        let people = self
            .crowd
            .people()
            .iter()
            .map(|person| body.time_to_disc_s(&person.disc(), velocity - person.velocity));
        people.fold(self.time_to_static_s(&body, velocity), f32::min)
    }

    fn time_to_static_s(&self, body: &Body, velocity: Vector) -> f32 {
        let position = body.position();
        let end = position + velocity * crate::collision::HORIZON_S;
        let margin = Vector::repeat(body.footprint().circumradius_m());
        let mut soonest_s = f32::INFINITY;
        for (edges, discs) in
            self.obstacles.touching(position.inf(&end) - margin, position.sup(&end) + margin)
        {
            for edge in edges {
                soonest_s = soonest_s.min(body.time_to_edge_s(edge, velocity));
            }
            for disc in discs {
                soonest_s = soonest_s.min(body.time_to_disc_s(disc, velocity));
            }
        }
        soonest_s
    }

    /// The base, with the commands that are on their way to it.
    pub fn base(&self) -> &Base {
        &self.base
    }

    /// Everybody, with what each is about to do.
    pub fn crowd(&self) -> &Crowd {
        &self.crowd
    }

    /// Everybody, in the order of the world's people.
    pub fn people(&self) -> &[PersonState] {
        self.crowd.people()
    }

    /// Whether the episode ended in a collision while the robot drove slower than [`STANDING_MPS`].
    pub fn hit_while_standing(&self) -> bool {
        self.hit_while_standing
    }
}
