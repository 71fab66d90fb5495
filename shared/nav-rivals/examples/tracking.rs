//! How well the tracker follows people, against the simulation's truth.
//!
//! Rivals drive through validation worlds with lidars of several resolutions and usual disturbances, and after each step
//! the tracks are compared with where everybody truly is. One row of CSV for each family and lidar:
//!
//! | column | what it holds |
//! |---|---|
//! | `seconds` | simulated time |
//! | `appearances` | how often somebody within 3 m came into view (by two beams or more) for 0.5 s at least |
//! | `in_time` | share of those that are followed 0.5 s later |
//! | `followed` | share of the time from then on, while they are in view, in which a track lies within 0.5 m |
//! | `known_moving` | share of it in which those who walk (0.2 m/s or more) count as moving |
//! | `velocity_*`, `position_*` | error of the tracks of those who walk, m/s and m |
//! | `switches` | changes of the track that follows somebody, in 100 s of being followed |
//! | `false_movers` | tracks that move where nobody is within 0.5 m, in 100 s; `false_seen` without those that coast |
//! | `update_*_us` | time of reading a scan and updating the tracker |
//!
//! At last, on stderr, the time of an update with 32 tracks. Seconds are short where robots collide: rivals do not look
//! ahead.
//!
//! `cargo run --release -p nav-rivals --example tracking -- [worlds=20] [first=0] [families=crowd,maze] [beams=72,720]`;
//! `verbose=yes` says where each false mover was.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "an example prints")]

use nav_core::geometry::{Point, Pose, Vector};
use nav_core::messages::{Header, LaserScan};
use nav_core::scan::beams::Beams;
use nav_core::task::{Lidar, Task};
use nav_core::tracker::{Track, Tracker};
use nav_env::episode_loop::{Answer, Commands, drive_episode};
use nav_env::limits::Limits;
use nav_env::messages::Messages;
use nav_env::other_lidar::OtherLidar;
use nav_env::robot::Driver;
use nav_env::worlds::Place;
use nav_rivals::Rival;
use nav_sim::disturbance::Disturbance;
use nav_sim::families::{Family, Split};
use nav_sim::lidar::ray_disc_m;
use nav_sim::simulation::Simulation;
use std::collections::{BTreeMap, BTreeSet};
use std::convert::Infallible;
use std::ops::Range;
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
struct Counts {
    seconds: f32,
    appearances: u32,
    in_time: u32,
    steps: u32,
    followed: u32,
    walking: u32,
    known_moving: u32,
    velocity_mps: Vec<f32>,
    position_m: Vec<f32>,
    switches: u32,
    false_movers: u32,
    false_seen: u32,
    update_ns: Vec<f32>,
}

/// Somebody's present appearance.
#[derive(Clone, Copy, Default)]
struct Appearance {
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
struct Judge<'a> {
    driver: Box<dyn Driver + Send>,
    task: Task,
    tracker: Box<Tracker>,
    beams: Box<Beams>,
    messages: Messages,
    seq: u64,
    appearances: Vec<Appearance>,
    false_ids: [BTreeSet<u32>; 2],
    counts: &'a mut Counts,
    verbose: bool,
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

/// Time of an update, in a loop that does nothing else, with 32 people who walk round the robot in a ring: followed tracks
/// (median), and time (median and 99th percentile, us).
fn ring(beam_count: u32) -> (f32, f32, f32) {
    let lidar = Lidar { beam_count, range_max_m: 8.0, ..Lidar::default() };
    let task = Task { lidar, ..Task::default() };
    let (mut tracker, mut beams) = (Box::new(Tracker::new(&task)), Box::new(Beams::new()));
    let (mut tracks, mut update_ns) = (Vec::new(), Vec::new());
    for step in 1..=2000_u32 {
        let people = (0..32_u32).map(|person| {
            let (sin, cos) = libm::sincosf(person as f32 * 0.196_35 + step as f32 * 0.012);
            Vector::new(4.4 * cos, 4.4 * sin)
        });
        let people: Vec<Vector> = people.collect();
        let scan = LaserScan::of(&lidar, |angle_rad| {
            let (sin, cos) = libm::sincosf(angle_rad);
            let ranges = people.iter().map(|person| ray_disc_m(cos, sin, *person, 0.25));
            ranges.fold(f32::INFINITY, f32::min)
        });
        let begun = Instant::now();
        beams.read(&scan, f32::INFINITY);
        tracker.update(&beams, Pose::default(), u64::from(step) * 100_000_000);
        if step > 100 {
            update_ns.push(begun.elapsed().as_nanos() as f32);
            tracks.push(tracker.tracks().len() as f32);
        }
    }
    (quantile(&mut tracks, 0.5), quantile(&mut update_ns, 0.5) / 1e3, quantile(&mut update_ns, 0.99) / 1e3)
}

/// The value below which a share of the values lies.
fn quantile(values: &mut [f32], share: f32) -> f32 {
    values.sort_by(f32::total_cmp);
    let place = (share * values.len().saturating_sub(1) as f32) as usize;
    values.get(place).copied().unwrap_or(f32::NAN)
}

fn measured(family: Family, beams: u32, worlds: Range<u64>, verbose: bool) -> Counts {
    let lidar = OtherLidar { beam_count: beams, range_max_m: Task::default().lidar.range_max_m };
    let mut counts = Counts::default();
    for seed in worlds {
        let place = Place::generated(family, Split::Validation, seed, Task::default().robot.radius_m);
        let task = lidar.on(&Limits::default().task(&Task::default(), place.scene.episode_steps()));
        let rival = if seed % 2 == 0 { Rival::Astar } else { Rival::Reactive };
        let mut driver = rival.driver(&Task::default());
        driver.begin(&place);
        let mut simulation =
            Simulation::new(place.world.clone(), &task, &Disturbance::usual(), place.simulation_seed);
        let mut judge = Judge {
            driver,
            task,
            tracker: Box::new(Tracker::new(&task)),
            beams: Box::new(Beams::new()),
            messages: Messages::default(),
            seq: 0,
            appearances: Vec::new(),
            false_ids: Default::default(),
            counts: &mut counts,
            verbose,
        };
        let Ok(_) = drive_episode(&mut simulation, &place, 1, &mut judge, &mut ());
    }
    counts
}

fn print_row(family: Family, beams: u32, counts: &mut Counts) {
    let share = |part: u32, of: u32| f64::from(part) / f64::from(of);
    let mean = |values: &[f32]| values.iter().sum::<f32>() / values.len() as f32;
    let walked_s = counts.walking as f32 * 0.1;
    let (velocity_mps, position_m) = (&mut counts.velocity_mps, &mut counts.position_m);
    println!(
        "{family},{beams},{:.0},{},{:.3},{:.3},{:.3},{:.3},{:.3},{:.3},{:.3},{:.3},{:.2},{:.2},{:.2},{:.1},{:.1}",
        counts.seconds,
        counts.appearances,
        share(counts.in_time, counts.appearances),
        share(counts.followed, counts.steps),
        share(counts.known_moving, counts.walking),
        quantile(velocity_mps, 0.5),
        mean(velocity_mps),
        quantile(velocity_mps, 0.9),
        quantile(position_m, 0.5),
        quantile(position_m, 0.9),
        100.0 * counts.switches as f32 / walked_s,
        100.0 * counts.false_movers as f32 / counts.seconds,
        100.0 * counts.false_seen as f32 / counts.seconds,
        quantile(&mut counts.update_ns, 0.5) / 1e3,
        quantile(&mut counts.update_ns, 0.99) / 1e3,
    );
}

fn main() {
    let options: BTreeMap<String, String> = std::env::args()
        .skip(1)
        .filter_map(|argument| argument.split_once('=').map(|(key, value)| (key.into(), value.into())))
        .collect();
    let option = |key: &str, usual: &str| options.get(key).cloned().unwrap_or_else(|| usual.into());
    let number =
        |key: &str, usual: &str| option(key, usual).parse::<u64>().expect("worlds= and first= take numbers");
    let first = number("first", "0");
    let worlds = first..first + number("worlds", "20");
    let verbose = option("verbose", "no") == "yes";
    let families = option("families", "crowd,stream,rooms,maze,clutter,boxes");
    let beams = option("beams", "72,180,360,720");
    println!(
        "family,beams,seconds,appearances,in_time,followed,known_moving,velocity_median_mps,velocity_mean_mps,\
         velocity_p90_mps,position_median_m,position_p90_m,switches_100s,false_movers_100s,false_seen_100s,\
         update_median_us,update_p99_us"
    );
    let beams: Vec<u32> =
        beams.split(',').map(|beams| beams.parse().expect("beams= takes numbers")).collect();
    for &beams in &beams {
        for family in families.split(',') {
            let family: Family = family.parse().expect("families= takes names of families");
            print_row(family, beams, &mut measured(family, beams, worlds.clone(), verbose));
        }
    }
    eprintln!("ring of 32 people, nothing else to do: beams, tracks, update_median_us, update_p99_us");
    for &beams in &beams {
        let (tracks, median_us, p99_us) = ring(beams);
        eprintln!("{beams},{tracks:.0},{median_us:.1},{p99_us:.1}");
    }
}
