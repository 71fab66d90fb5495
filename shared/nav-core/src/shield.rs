//! The safety gate between the policy and the wheels: the nearest safe command to the wish leaves.
//!
//! A command is safe when both of these hold (`danger.rs`):
//!
//! - **The robot can still stop.** After the command it comes to a stand without touching anything that was seen, however
//!   late the base obeys. Because that was so after the last command, it is so now for the command to stop: no sequence of
//!   wishes leads into something that stands.
//! - **There is a way to go on** for the next seconds (to hold course, to stop, to turn aside, to step out of the way) on
//!   which nobody who moves is met, if they keep their velocities; with room to spare, where that can be had.
//!
//! Where the wish is not safe, the cheapest of a lattice of commands leaves, and where none is safe, the one that touches
//! latest and softest. The work is bounded, nothing is random, and all of it is in the frame of the robot as it is.
//!
//! | file | what |
//! |---|---|
//! | `motion.rs` | where the robot will be: commands under way, latency, lag, acceleration limits |
//! | `people.rs` | where those who move will be, from [`crate::tracker`] |
//! | `sectors.rs`, `standing.rs` | what stands, from the scans of the last moment |
//! | `kept.rs` | what stood near before that, and no beam has hit since |
//! | `nose.rs` | how near a rectangle may come to what is ahead of it, to be able to turn |
//! | `patience.rs` | how much of its margin a rectangle keeps that has stood for long |
//! | `grid.rs` | of that, a map that answers most questions with one bit |
//! | `lattice.rs` | the commands that are tried, the nearest to the wish first |
//! | `ways.rs` | the ways to go on that are tried |
//! | `intervention.rs` | what the gate did, and because of what |
//! | `danger.rs` | what a command leads to |
//!
//! **Shapes.** A disc is judged by where its centre goes. A rectangle is judged by its outline, turned as it will be: when it
//! turns on the spot its corners sweep, so that a turn, too, must be one that it can still stop, and it has stopped only when it
//! turns no more. Ahead it keeps so much room that it can turn. Where nothing is free, as everywhere, what is near already may
//! not come nearer still, and so the way out is the way in.
//!
//! **What it cannot promise.** It knows what the lidar shows: nothing behind corners, nothing narrower than the gap between
//! two beams at the distance that stopping takes, nothing above or below the plane. People may walk faster than the robot
//! can get out of their way, turn into it at arm's length, or come from where the robot cannot go. At 1.5 m/s and 2.5 rad/s
//! wishes that ram may still graze something (the property test allows 4 in 1,000; at 1 m/s and 1 rad/s none). A base that slips, a
//! lidar that errs by more than [`margin_m`] (for a rectangle that has stood, by more than 0.35 of it), or one that obeys later
//! than its [`latency_s`](crate::task::Robot::latency_s) breaks the promise for what stands, too. It is no certified safety function.

mod danger;
mod grid;
mod intervention;
mod kept;
mod lattice;
mod motion;
mod nose;
mod patience;
mod people;
mod sectors;
mod standing;
mod ways;

pub use self::intervention::{Hazard, Intervention};
pub use self::lattice::Open;
pub use self::people::Mover;
pub use self::standing::{MARGIN_M, margin_m};

use self::danger::{Danger, Obstacles};
use self::kept::Kept;
use self::motion::{Clock, LATE_MAX, UnderWay};
use self::patience::Patience;
use self::people::People;
use self::sectors::{Sectors, View};
use self::standing::{Room, Standing};
use crate::geometry::{Point, Pose};
use crate::messages::LaserScan;
use crate::scale::Scale;
use crate::scan::beams::Beams;
use crate::sent::Sent;
use crate::task::{Lidar, Robot, Task};
use crate::tracker::{TRACKS_MAX, Tracker};
use crate::twist::Twist;
use heapless::Vec;

/// So many commands are tried at most, which bounds the work of a tick.
const TRIED: usize = 20;
/// What coming close to somebody at once is worth, as the cost of another command than the wish...
const CLOSE_COST: f32 = 0.6;
/// ...touching somebody at the end of the time looked ahead (twice that at once)...
const TOUCH_COST: f32 = 5.0;
/// ...and what stands, however little; and for each metre of the reference robot ([`Scale`]) inside of what should be
/// kept free.
const STANDING_COST: (f32, f32) = (10.0, 500.0);
/// Nobody is taken to come faster, m/s.
const PEOPLE_MPS: f32 = 2.0;
/// Hits this near to somebody whose place is given are theirs, m beyond the radius.
const PERSON_EDGE_M: f32 = 0.1;

/// The gate.
#[derive(Clone, Debug)]
pub struct Shield {
    robot: Robot,
    lidar: Lidar,
    scale: Scale,
    clock: Clock,
    latency: usize,
    no_return_m: f32,
    beams: Beams,
    sectors: Sectors,
    tracker: Tracker,
    movers: Vec<Mover, TRACKS_MAX>,
    is_informed: bool,
    /// Everything that was hit, people too: what the robot must be able to stop before, whatever moves.
    hits: Standing,
    /// What was hit and is nobody who moves.
    walls: Standing,
    /// What was, longer ago than that.
    kept: Kept,
    patience: Patience,
    people: People,
}

impl Shield {
    /// For the robot of a task.
    pub fn new(task: &Task) -> Self {
        let (clock, scale) = (Clock::new(task), task.scale());
        Self {
            robot: task.robot,
            lidar: task.lidar,
            scale,
            clock,
            latency: clock.steps(task.control_period_s).min(LATE_MAX),
            no_return_m: f32::INFINITY,
            beams: Beams::new(),
            sectors: Sectors::new(&task.robot.footprint),
            tracker: Tracker::new(task),
            movers: Vec::new(),
            is_informed: false,
            hits: Standing::new(&scale, &task.robot.footprint),
            walls: Standing::new(&scale, &task.robot.footprint),
            kept: Kept::new(&scale),
            patience: Patience::new(&scale, &task.robot.footprint),
            people: People::new(),
        }
    }

    /// A finite range from which on the lidar's driver means that nothing was hit, m.
    pub fn set_no_return_m(&mut self, no_return_m: f32) {
        self.no_return_m = no_return_m;
    }

    /// Says who moves (`odom` frame) from now on, in place of the tracker: for ceilings in simulation.
    pub fn inform(&mut self, movers: impl Iterator<Item = Mover>) {
        self.is_informed = true;
        self.movers.clear();
        self.movers.extend(movers.take(TRACKS_MAX));
    }

    /// Takes in a scan that was taken with the robot at `pose` (`odom_from_robot`).
    pub fn see(&mut self, scan: &LaserScan, pose: Pose) {
        let stamp_ns = scan.header.stamp_ns;
        self.patience.see(pose, stamp_ns);
        self.beams.read(scan, self.no_return_m);
        self.sectors.lay_out(&self.beams);
        // Beams and who is followed by them are seen from where the lidar is, courses from where the robot is.
        let lidar_pose = self.lidar.pose(pose);
        self.tracker.update(&self.beams, lidar_pose, stamp_ns);
        if !self.is_informed {
            let moving = self.tracker.tracks().iter().filter(|track| track.is_moving());
            self.movers.clear();
            self.movers.extend(moving.map(|track| Mover {
                position: track.position,
                velocity: track.velocity,
                radius_m: track.radius_m,
            }));
        }
        let here = pose.position();
        let away = |mover: &Mover| (mover.position - here).norm_squared();
        self.movers.sort_unstable_by(|a, b| away(a).total_cmp(&away(b)));
        let far_m = (self.robot.linear_max_mps + PEOPLE_MPS) * self.clock.horizon_s();
        self.people.foresee(&self.movers, pose, &self.clock, &self.robot, far_m);

        let (beams, sectors) = (&self.beams, &self.sectors);
        let (footprint, mount) = (&self.robot.footprint, &self.lidar.mount);
        let view = View { beams, sectors, pose: lidar_pose, stamp_ns, footprint, mount };
        self.hits.see(&view, |_| false, |_| {});
        let (beams, tracker, movers) = (&self.beams, &self.tracker, &self.movers);
        let is_informed = self.is_informed;
        let is_person = |index: usize| {
            if !is_informed {
                return tracker.owner(index).is_some_and(|owner| tracker.tracks()[owner].is_moving());
            }
            let beam = &beams.as_slice()[index];
            let hit =
                lidar_pose.parent_from_local(Point::new(beam.range_m * beam.cos, beam.range_m * beam.sin));
            movers.iter().any(|mover| (hit - mover.position).norm() < mover.radius_m + PERSON_EDGE_M)
        };
        let kept = &mut self.kept;
        let leaving = |point| kept.keep(point, here);
        self.walls.see(&view, is_person, leaving);
        let stopping_m = self.stopping_m();
        self.kept.look_again(&self.beams, lidar_pose, stamp_ns, stopping_m);

        // What was hit by one beam may reach up to the next one.
        let (lidar, spacing_rad) = (lidar_pose.position(), self.hits.spacing_rad(&self.beams));
        let share = self.patience.share();
        self.hits.lay_out(&self.kept, pose, lidar, Room { share, edge_rad: spacing_rad }, stopping_m);
        if !self.people.is_empty() {
            let far_m = self.robot.linear_max_mps * self.clock.horizon_s() + 2.0 * footprint.circumradius_m();
            // Farther ahead there will be other scans to go by.
            self.walls.lay_out(&self.kept, pose, lidar, Room { share, edge_rad: 0.5 * spacing_rad }, far_m);
        }
    }

    /// What lies farther away is of no concern to a robot that stops, m: the way at the fastest speed while commands are
    /// late, while braking, and half as much again.
    fn stopping_m(&self) -> f32 {
        let robot = &self.robot;
        let steps = self.clock.steps(robot.latency_s) + self.clock.held + 2;
        let late_s = steps as f32 * self.clock.step_s[0];
        1.5 * (robot.linear_max_mps * late_s + robot.braking_m()) + 2.0 * robot.footprint.circumradius_m()
    }

    /// The safe command nearest to `wish`, and why, if it is another. `sent` are the last commands, newest first, `measured`
    /// what the base does; where the way is not `open`, nothing is tried that leads there.
    pub fn filter(
        &self,
        wish: Twist,
        measured: Twist,
        sent: &Sent,
        open: Open,
    ) -> (Twist, Option<Intervention>) {
        let danger = Danger {
            robot: &self.robot,
            scale: &self.scale,
            clock: &self.clock,
            latency: self.latency,
            hits: Obstacles { points: &self.hits, grid: None },
            walls: Obstacles { points: &self.walls, grid: None },
            people: &self.people,
            under_way: UnderWay { measured, sent: self.clock.commands(sent) },
        };
        let wish = self.robot.limited(wish);
        let Some(met) = danger.of(wish, f32::INFINITY) else { return (wish, None) };
        let (hits, walls) = (self.hits.grid(), self.walls.grid());
        let danger = Danger {
            hits: Obstacles { points: &self.hits, grid: Some(&hits) },
            walls: Obstacles { points: &self.walls, grid: Some(&walls) },
            ..danger
        };
        let mut best = (danger.cost(&met), wish, true);
        let mut tried = 0;
        for (away, candidate) in lattice::candidates(&self.robot, wish, open) {
            if away >= best.0 {
                continue;
            }
            let met = danger.of(candidate, best.0 - away);
            let cost = away + met.as_ref().map_or(0.0, |met| danger.cost(met));
            if cost < best.0 {
                best = (cost, candidate, met.is_some_and(|met| !met.is_close));
            }
            tried += 1;
            if tried == TRIED {
                break;
            }
        }
        let (_, command, is_forced) = best;
        if command == wish {
            // Nothing is better: what was wished leaves, and there is nothing to tell unless it touches.
            let told = !met.is_close;
            return (wish, told.then_some(met.intervention(true)));
        }
        (command, Some(met.intervention(is_forced)))
    }

    /// Everybody who is followed.
    pub fn tracker(&self) -> &Tracker {
        &self.tracker
    }

    /// Forgets what was seen: the robot was set down elsewhere, or the `odom` frame began anew.
    pub fn forget(&mut self) {
        self.tracker.forget();
        self.movers.clear();
        self.hits.forget();
        self.walls.forget();
        self.kept.forget();
        self.patience.forget();
        self.people = People::new();
    }
}
