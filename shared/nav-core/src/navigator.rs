//! From messages to observations, and from choices to targets: everything of acting but the networks.
//!
//! Once a tick: [`Navigator::observe`]; if [`Navigator::decision_due`], [`Navigator::prepare_decision`], a
//! choice, [`Navigator::commit`]; then [`Navigator::encode_low`] and a low-level action. The trainer calls the
//! same steps with its own choices; [`crate::controller::Controller`] calls them with the networks'.

mod decision;
mod driving;
mod rhythm;
mod standing;

pub use self::decision::{ActiveDecision, DecisionReason};

use self::rhythm::Rhythm;
use self::standing::Standing;
use crate::closing::ClosingSpeeds;
use crate::geometry::{Point, Pose, wrap_angle};
use crate::history::History;
use crate::local_map::{CELL_M, LocalMap};
use crate::messages::{Goal, LaserScan, Odometry};
use crate::observation::{CHANGE_S, CHANGE_TICKS, Compression, HIGH_OBSERVATION};
use crate::optimistic::OptimisticGeodesic;
use crate::scale::Scale;
use crate::scan::{Misfit, SECTOR_COUNT, ScanGeometry, ScanReader, ScanView};
use crate::subgoal::Candidates;
use crate::task::{ACTION_GOAL, Memory, ShieldMode, Task};
use crate::twist::Twist;

/// A robot is stuck when its pose is that of so long ago, s of the reference robot.
const STUCK_S: f32 = 0.9;
/// Ticks that this can be at most, and the present.
const STUCK_TICKS: usize = 451;
/// A robot that is this far from where it was when a new goal comes was set down elsewhere, m of the reference robot.
const SET_DOWN_M: f32 = 0.3;
/// Or one that is turned this far from how it stood, rad.
const SET_DOWN_RAD: f32 = 0.5;
/// The robot has arrived within this share of the goal's radius.
const ARRIVAL_SHARE: f32 = 0.3;
/// Or inside the radius, when it is this much farther from the centre than it was at best, m of the reference
/// robot.
const ARRIVAL_SLACK_M: f32 = 0.02;

/// What the robot knows on its way to a goal.
#[derive(Clone, Debug)]
pub struct Navigator {
    task: Task,
    geometry: ScanGeometry,
    reader: ScanReader,
    compression: Compression,
    scan: ScanView,
    map: LocalMap,
    geodesic: OptimisticGeodesic,
    pose: Pose,
    velocity: Twist,
    goal: Point,
    goal_radius_m: f32,
    goal_id: Option<u32>,
    scale: Scale,
    rhythm: Rhythm,
    /// Compressed clearances, from now to [`CHANGE_S`] ago.
    clearance: History<[f32; SECTOR_COUNT], CHANGE_TICKS>,
    closing: ClosingSpeeds,
    has_gap: bool,
    /// The newest step began elsewhere than the last one ended.
    was_set_down: bool,
    /// Poses from now to [`STUCK_S`] ago.
    trail: History<Pose, STUCK_TICKS>,
    standing: Standing,
    steps: u32,
    best_distance_m: f32,
    /// As [`Self::best_distance_m`], since the goal was last corrected.
    approach_m: f32,
    has_arrived: bool,
    decision: Option<ActiveDecision>,
    last_action: Option<usize>,
    last_bearing_rad: f32,
    candidates: Option<Candidates>,
    high: [f32; HIGH_OBSERVATION],
}

impl Navigator {
    /// Ready for the first goal.
    pub fn new(task: &Task) -> Self {
        let scale = task.scale();
        let rhythm = Rhythm::new(task, &scale);
        let geometry = ScanGeometry::new(task);
        let scan = ScanView::new(&geometry);
        Self {
            task: *task,
            compression: Compression::new(geometry.clearance_max_m(), &scale),
            geometry,
            reader: ScanReader::new(task),
            scan,
            map: LocalMap::new(Point::origin(), scale.m(CELL_M), rhythm.visit_steps),
            geodesic: OptimisticGeodesic::default(),
            pose: Pose::default(),
            velocity: Twist::ZERO,
            goal: Point::origin(),
            goal_radius_m: task.goal_radius_m,
            goal_id: None,
            scale,
            rhythm,
            clearance: History::new(task.ticks(scale.s(CHANGE_S)), [0.0; SECTOR_COUNT]),
            closing: ClosingSpeeds::new(task),
            has_gap: false,
            was_set_down: false,
            trail: History::new(task.ticks(scale.s(STUCK_S)), Pose::default()),
            standing: Standing::new(Pose::default(), &scale),
            steps: 0,
            best_distance_m: f32::INFINITY,
            approach_m: f32::INFINITY,
            has_arrived: false,
            decision: None,
            last_action: None,
            last_bearing_rad: 0.0,
            candidates: None,
            high: [0.0; HIGH_OBSERVATION],
        }
    }

    /// Takes in one step's messages. A goal of a new id forgets everything of the last one; another place with the
    /// same id corrects it (a localiser has found out how far odometry has drifted): it is followed at once, and all
    /// that is remembered stays.
    pub fn observe(&mut self, scan: &LaserScan, odom: &Odometry, goal: &Goal) {
        let moved_m = (odom.pose.position() - self.pose.position()).norm();
        let turned_rad = wrap_angle(odom.pose.yaw_rad - self.pose.yaw_rad).abs();
        self.pose = odom.pose;
        self.velocity = odom.twist();
        let is_new = self.goal_id != Some(goal.id);
        self.was_set_down = is_new && (moved_m > self.scale.m(SET_DOWN_M) || turned_rad > SET_DOWN_RAD);
        if self.was_set_down {
            self.reader.forget_walls();
        } else if is_new {
            self.reader.forget();
        }
        let reach_m = scan.range_max_m;
        self.scan.update(&self.geometry, self.reader.read(scan, self.pose), reach_m);
        if is_new {
            self.goal = Point::new(goal.x_m, goal.y_m);
            self.goal_radius_m = goal.radius_m;
            self.start(goal.id);
        } else {
            self.correct(Point::new(goal.x_m, goal.y_m), goal.radius_m);
            self.steps += 1;
            self.standing.step(self.pose.position());
        }
        let had_gap = core::mem::take(&mut self.has_gap);
        self.remember(is_new || had_gap);
        self.candidates = None;
        self.best_distance_m = self.best_distance_m.min(self.goal_distance_m());
        self.approach_m = self.approach_m.min(self.goal_distance_m());
        self.has_arrived |= self.arrives();
        if let Some(decision) = &mut self.decision {
            decision.held_ticks += 1;
        }
    }

    /// Whether a scan can be driven on; asked once a tick, before [`Self::observe`].
    ///
    /// # Errors
    /// Why it cannot.
    pub fn inspect_scan(&mut self, scan: &LaserScan) -> Result<(), Misfit> {
        self.reader.inspect(scan)
    }

    /// See [`ScanReader::set_shield`].
    pub fn set_shield(&mut self, mode: ShieldMode) {
        self.reader.set_shield(mode);
    }

    /// See [`ScanReader::set_no_return_m`].
    pub fn set_no_return_m(&mut self, no_return_m: f32) {
        self.reader.set_no_return_m(no_return_m);
    }

    /// Whether this goal, as it is now, was seen together with a scan.
    pub fn knows(&self, goal: &Goal) -> bool {
        let known = (self.goal_id, self.goal, self.goal_radius_m);
        known == (Some(goal.id), Point::new(goal.x_m, goal.y_m), goal.radius_m)
    }

    fn start(&mut self, goal_id: u32) {
        self.goal_id = Some(goal_id);
        self.steps = 0;
        self.best_distance_m = f32::INFINITY;
        self.approach_m = f32::INFINITY;
        self.has_arrived = false;
        self.decision = None;
        self.last_action = None;
        self.map.clear(self.pose.position());
        self.trail.fill(self.pose);
        self.standing = Standing::new(self.pose, &self.scale);
    }

    /// The goal of the present id lies here. If that is elsewhere than before, whether it is reached is found out anew.
    fn correct(&mut self, goal: Point, radius_m: f32) {
        if (goal, radius_m) == (self.goal, self.goal_radius_m) {
            return;
        }
        (self.goal, self.goal_radius_m) = (goal, radius_m);
        self.approach_m = f32::INFINITY;
        // One that stands well inside need not move.
        self.has_arrived &= self.goal_distance_m() < radius_m;
        if let Some(decision) = &mut self.decision
            && decision.action == ACTION_GOAL
        {
            decision.subgoal = goal;
        }
    }

    fn remember(&mut self, is_first: bool) {
        let mut now = [0.0; SECTOR_COUNT];
        let ranges_m = self.scan.sectors_m().iter().zip(self.geometry.reach_m());
        for (value, (&range_m, &reach_m)) in now.iter_mut().zip(ranges_m) {
            *value = self.compression.of(range_m - reach_m);
        }
        if is_first {
            self.clearance.fill(now);
            self.closing.restart(&self.scan, self.pose);
        } else {
            self.clearance.push(now);
            self.closing.update(&self.geometry, &self.scan, self.pose);
        }
        self.trail.push(self.pose);
        self.map.recenter(self.pose.position());
        if self.steps.is_multiple_of(self.rhythm.visit) {
            self.map.visit(self.pose.position());
        }
        if self.steps.is_multiple_of(self.rhythm.map) && self.task.decision.memory == Memory::Full {
            let (sin, cos) = libm::sincosf(self.pose.yaw_rad);
            self.map.integrate(self.pose.position(), cos, sin, &self.scan);
        }
    }

    /// Forgets the goal and all that was seen on the way to it: the next step starts anew, even for the same goal.
    pub fn forget(&mut self) {
        self.goal_id = None;
    }

    /// Steps were missed: what the next scan shows must not be compared with those before.
    pub fn note_gap(&mut self) {
        self.has_gap = true;
    }

    /// Whether the robot was carried elsewhere when the newest step's goal came.
    pub fn was_set_down(&self) -> bool {
        self.was_set_down
    }

    /// Straight distance to the goal, m.
    pub fn goal_distance_m(&self) -> f32 {
        (self.goal - self.pose.position()).norm()
    }

    /// Whether the goal of the present id was reached; it stays reached unless a correction moves it away.
    ///
    /// Odometry drifts, so that the robot does not stop at the rim of the goal's radius: it drives on towards
    /// the centre until it is within a third of the radius, or no longer comes closer.
    pub fn goal_reached(&self) -> bool {
        self.has_arrived
    }

    fn arrives(&self) -> bool {
        let distance_m = self.goal_distance_m();
        let was_inside = self.approach_m < self.goal_radius_m;
        was_inside
            && (distance_m < ARRIVAL_SHARE * self.goal_radius_m
                || distance_m > self.approach_m + self.scale.m(ARRIVAL_SLACK_M))
    }

    /// The newest pose, `odom_from_robot`.
    pub fn pose(&self) -> Pose {
        self.pose
    }

    /// The goal, `odom` frame, m.
    pub fn goal(&self) -> Point {
        self.goal
    }

    /// The digested scan.
    pub fn scan(&self) -> &ScanView {
        &self.scan
    }

    /// The rolling map.
    pub fn map(&self) -> &LocalMap {
        &self.map
    }
}
