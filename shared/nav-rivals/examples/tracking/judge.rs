//! The tracker beside a driver, judged by the truth step by step.

use nav_core::geometry::{Point, Pose, Vector};
use nav_core::messages::{Header, LaserScan};
use nav_core::scan::beams::Beams;
use nav_core::task::Task;
use nav_core::tracker::{Track, Tracker};
use nav_env::episode_loop::{Answer, Commands};
use nav_env::messages::Messages;
use nav_env::robot::Driver;
use nav_sim::lidar::ray_disc_m;
use nav_sim::simulation::Simulation;
use std::collections::BTreeSet;
use std::convert::Infallible;
use std::time::Instant;

/// People farther away do not count, m.
const NEAR_M: f32 = 3.0;
/// A track follows somebody this near, m.
const FOLLOWS_M: f32 = 0.5;
/// Time to begin to follow somebody, s.
const IN_TIME_S: f32 = 0.5;
/// Who is out of view for this long comes into view anew, s.
const AWAY_S: f32 = 0.5;
/// Who walks at least as fast counts as walking, m/s.
const WALKS_MPS: f32 = 0.2;

/// What is counted for a family and a lidar.
#[derive(Default)]
pub(crate) struct Counts {
    pub(crate) seconds: f32,
    pub(crate) appearances: u32,
    pub(crate) in_time: u32,
    pub(crate) steps: u32,
    pub(crate) followed: u32,
    pub(crate) walking: u32,
    pub(crate) known_moving: u32,
    pub(crate) velocity_mps: Vec<f32>,
    pub(crate) position_m: Vec<f32>,
    pub(crate) switches: u32,
    pub(crate) false_movers: u32,
    pub(crate) false_seen: u32,
    pub(crate) update_ns: Vec<f32>,
}

/// Somebody's present appearance.
#[derive(Clone, Copy, Default)]
pub(crate) struct Appearance {
    seen_s: f32,
    unseen_s: f32,
    is_judged: bool,
    track: Option<u32>,
}

/// The truth about a person, in the `odom` frame.
struct Truth {
    position: Point,
    velocity: Vector,
    is_in_view: bool,
}

/// A driver, and the tracker that is judged beside it.
pub(crate) struct Judge<'a> {
    pub(crate) driver: Box<dyn Driver + Send>,
    pub(crate) task: Task,
    pub(crate) tracker: Box<Tracker>,
    pub(crate) beams: Box<Beams>,
    pub(crate) messages: Messages,
    pub(crate) seq: u64,
    pub(crate) appearances: Vec<Appearance>,
    pub(crate) false_ids: [BTreeSet<u32>; 2],
    pub(crate) counts: &'a mut Counts,
    pub(crate) verbose: bool,
}

impl Commands for Judge<'_> {
    type Error = Infallible;

    fn exchange(&mut self, simulation: &mut Simulation, goal_id: u32) -> Result<Answer, Infallible> {
        self.seq += 1;
        let header = Header { seq: self.seq, stamp_ns: self.seq * self.task.control_period_ns() };
        self.messages.measure(simulation, goal_id, header);
        let begun = Instant::now();
        self.beams.read(&self.messages.scan, f32::INFINITY);
        self.tracker.update(&self.beams, self.messages.odom.pose, header.stamp_ns);
        self.counts.update_ns.push(begun.elapsed().as_nanos() as f32);
        self.judge(simulation);
        self.driver.localise(simulation.map_from_odom());
        let (command, status) = self.driver.tick(header.stamp_ns, self.messages.inputs());
        Ok(Answer { command: command.twist(), state: status.state })
    }
}

impl Judge<'_> {
    fn judge(&mut self, simulation: &Simulation) {
        let period_s = self.task.control_period_s;
        let people = truths(simulation, &self.messages.scan, self.messages.odom.pose);
        self.appearances.resize(people.len(), Appearance::default());
        self.counts.seconds += period_s;
        let followers = followers(&people, self.tracker.tracks());
        for ((truth, appearance), follower) in people.iter().zip(&mut self.appearances).zip(followers) {
            if !truth.is_in_view {
                appearance.unseen_s += period_s;
                if appearance.unseen_s > AWAY_S {
                    *appearance = Appearance { unseen_s: appearance.unseen_s, ..Appearance::default() };
                }
                continue;
            }
            (appearance.seen_s, appearance.unseen_s) = (appearance.seen_s + period_s, 0.0);
            if appearance.seen_s > IN_TIME_S + 0.5 * period_s {
                if !appearance.is_judged {
                    appearance.is_judged = true;
                    self.counts.appearances += 1;
                    self.counts.in_time += u32::from(follower.is_some());
                }
                self.counts.steps += 1;
                self.counts.followed += u32::from(follower.is_some());
            }
            let Some(track) = follower else { continue };
            self.counts.switches += u32::from(appearance.track.is_some_and(|id| id != track.id));
            appearance.track = Some(track.id);
            if truth.velocity.norm() >= WALKS_MPS {
                self.counts.walking += 1;
                self.counts.known_moving += u32::from(track.is_moving());
                self.counts.velocity_mps.push((track.velocity - truth.velocity).norm());
                self.counts.position_m.push((track.position - truth.position).norm());
            }
        }
        for track in self.tracker.tracks().iter().filter(|track| track.is_moving()) {
            let nearest_m = people.iter().map(|truth| (truth.position - track.position).norm());
            if nearest_m.fold(f32::INFINITY, f32::min) > FOLLOWS_M {
                let is_new = self.false_ids[0].insert(track.id);
                self.counts.false_movers += u32::from(is_new);
                if self.verbose && is_new {
                    let pose = simulation.pose();
                    println!(
                        "false: {} step {} track {} robot ({:.2} {:.2} {:.2}) at {:.2} {:.2} v {:.2} {:.2} age {:.1} unseen {:.1}",
                        simulation.world().name,
                        simulation.steps(),
                        track.id,
                        pose.x_m,
                        pose.y_m,
                        pose.yaw_rad,
                        track.position.x - self.messages.odom.pose.x_m,
                        track.position.y - self.messages.odom.pose.y_m,
                        track.velocity.x,
                        track.velocity.y,
                        track.age_s,
                        track.unseen_s
                    );
                }
                if track.unseen_s <= 0.0 {
                    self.counts.false_seen += u32::from(self.false_ids[1].insert(track.id));
                }
            }
        }
    }
}

/// Everybody in the `odom` frame, and who is in view.
fn truths(simulation: &Simulation, scan: &LaserScan, odom_from_robot: Pose) -> Vec<Truth> {
    let map_from_robot = simulation.pose();
    let turn_rad = odom_from_robot.yaw_rad - map_from_robot.yaw_rad;
    let turn = Pose::new(0.0, 0.0, turn_rad);
    let people = simulation.people();
    let local: Vec<Point> =
        people.iter().map(|person| map_from_robot.local_from_parent(person.position)).collect();
    let mut hits = vec![0_u32; people.len()];
    for (beam, &range_m) in scan.ranges_m().iter().enumerate() {
        let (sin, cos) = libm::sincosf(scan.angle_min_rad + beam as f32 * scan.angle_increment_rad);
        let ranges =
            local.iter().zip(people).map(|(at, person)| ray_disc_m(cos, sin, at.coords, person.radius_m));
        let nearest = ranges.enumerate().min_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((index, person_m)) = nearest
            && (range_m - person_m).abs() < 0.15
        {
            hits[index] += 1;
        }
    }
    let each = people.iter().zip(&local).zip(hits);
    each.map(|((person, at), hits)| Truth {
        position: odom_from_robot.parent_from_local(*at),
        velocity: turn.parent_from_local(Point::from(person.velocity)).coords,
        is_in_view: hits >= 2 && at.coords.norm() <= NEAR_M,
    })
    .collect()
}

/// Who is followed by which track: the nearest pairs first, each track follows one.
fn followers<'a>(people: &[Truth], tracks: &'a [Track]) -> Vec<Option<&'a Track>> {
    let mut pairs: Vec<(f32, usize, usize)> = Vec::new();
    for (person, truth) in people.iter().enumerate() {
        for (index, track) in tracks.iter().enumerate() {
            let apart_m = (track.position - truth.position).norm();
            if apart_m <= FOLLOWS_M {
                pairs.push((apart_m, person, index));
            }
        }
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut found = vec![None; people.len()];
    let mut is_taken = vec![false; tracks.len()];
    for (_, person, index) in pairs {
        if found[person].is_none() && !is_taken[index] {
            found[person] = Some(&tracks[index]);
            is_taken[index] = true;
        }
    }
    found
}
