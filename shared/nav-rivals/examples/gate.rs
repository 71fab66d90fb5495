//! How long the safety gate takes in a tick: reading the scan, following people, and judging the wish.
//!
//! The reactive rival's wishes go through a gate in validation worlds, with usual disturbances, and what the gate lets
//! through is driven. One row of CSV for each family and lidar:
//!
//! | column | what it holds |
//! |---|---|
//! | `ticks` | how many were timed |
//! | `acts` | share of ticks in which another command left than was wished |
//! | `see_*_us` | reading a scan, following people, foreseeing them |
//! | `gate_*_us` | that, and judging the wish: all that a tick with the gate takes more than one without |
//!
//! `ring` is no family: 32 people walk in a ring round a robot that wishes to drive straight on, and nothing else happens.
//!
//! `cargo run --release -p nav-rivals --example gate -- [worlds=20] [first=0] [families=crowd,maze] [beams=72,720] [shape=box]`;
//! a `box` turns in the same circle as the default robot, and has its lidar in front.
#![allow(clippy::print_stdout, reason = "an example prints")]

mod support;

use nav_core::footprint::Footprint;
use nav_core::geometry::Pose;
use nav_core::messages::{Header, LaserScan};
use nav_core::sent::Sent;
use nav_core::shield::{Open, Shield};
use nav_core::task::{Lidar, Robot, ShieldMode, Task};
use nav_core::twist::Twist;
use nav_env::episode_loop::{Answer, Commands, drive_episode};
use nav_env::limits::Limits;
use nav_env::messages::Messages;
use nav_env::other_lidar::OtherLidar;
use nav_env::robot::Driver;
use nav_env::worlds::Place;
use nav_rivals::Rival;
use nav_sim::disturbance::Disturbance;
use nav_sim::families::{Family, Split};
use nav_sim::simulation::Simulation;
use std::collections::BTreeMap;
use std::convert::Infallible;
use std::time::Instant;
use support::{quantile, ring_of_walkers, task_among_walkers};

/// What was measured in a family.
#[derive(Default)]
struct Times {
    see_us: Vec<f32>,
    gate_us: Vec<f32>,
    acts: u32,
}

/// A driver without a gate, and the gate behind it.
struct Gated<'a> {
    driver: Box<dyn Driver + Send>,
    shield: Box<Shield>,
    task: Task,
    messages: Messages,
    seq: u64,
    sent: Sent,
    times: &'a mut Times,
}

impl Commands for Gated<'_> {
    type Error = Infallible;

    fn exchange(&mut self, simulation: &mut Simulation, goal_id: u32) -> Result<Answer, Infallible> {
        self.seq += 1;
        let header = Header { seq: self.seq, stamp_ns: self.seq * self.task.control_period_ns() };
        self.messages.measure(simulation, goal_id, header);
        self.driver.localise(simulation.map_from_odom());
        let (wish, status) = self.driver.tick(header.stamp_ns, self.messages.inputs());
        let command = self.times.of(
            &mut self.shield,
            &self.messages.scan,
            self.messages.odom.pose,
            wish.twist(),
            self.messages.odom.twist(),
            &self.sent,
        );
        let command = self.task.robot.ramped(self.sent.as_slice()[0], command, self.task.control_period_s);
        self.sent.push(command);
        Ok(Answer { command, state: status.state })
    }
}

impl Times {
    fn of(
        &mut self,
        shield: &mut Shield,
        scan: &LaserScan,
        pose: Pose,
        wish: Twist,
        measured: Twist,
        sent: &Sent,
    ) -> Twist {
        let begun = Instant::now();
        shield.see(scan, pose);
        let seen = begun.elapsed();
        let (command, _) = shield.filter(wish, measured, sent, Open { ahead: true, behind: true });
        self.gate_us.push(begun.elapsed().as_nanos() as f32 / 1e3);
        self.see_us.push(seen.as_nanos() as f32 / 1e3);
        self.acts += u32::from(command != wish);
        command
    }

    fn print(&mut self, family: &str, beams: u32) {
        let ticks = self.gate_us.len();
        println!(
            "{family},{beams},{ticks},{:.3},{:.1},{:.1},{:.1},{:.1},{:.1}",
            f64::from(self.acts) / ticks as f64,
            quantile(&mut self.see_us, 0.5),
            quantile(&mut self.see_us, 0.99),
            quantile(&mut self.gate_us, 0.5),
            quantile(&mut self.gate_us, 0.99),
            quantile(&mut self.gate_us, 0.999),
        );
    }
}

/// The default robot, or a box of its size.
fn robot(shape: &str) -> Task {
    let task = Task::default();
    match shape {
        "circle" => task,
        "box" => {
            let footprint = Footprint::Rectangle { front_m: 0.16, rear_m: 0.16, half_width_m: 0.12 };
            let lidar = Lidar { mount: Pose::new(0.14, 0.0, 0.0), ..task.lidar };
            Task { robot: Robot { footprint, ..task.robot }, lidar, ..task }
        }
        _ => panic!("shape= takes circle or box"),
    }
}

fn in_family(shape: &str, family: Family, beam_count: u32, worlds: std::ops::Range<u64>) -> Times {
    let lidar = OtherLidar { beam_count, range_max_m: Task::default().lidar.range_max_m };
    let ungated = Task { shield: ShieldMode::Off, ..robot(shape) };
    let mut times = Times::default();
    for seed in worlds {
        let place = Place::generated(family, Split::Validation, seed, &ungated.robot.footprint);
        let task = lidar.on(&Limits::default().task(&ungated, place.scene.episode_s(&ungated.robot)));
        let mut driver = Rival::Reactive.driver(&ungated);
        driver.begin(&place);
        let world = place.world.clone();
        let mut simulation = Simulation::new(world, &task, &Disturbance::usual(), place.simulation_seed);
        let mut gated = Gated {
            driver,
            shield: Box::new(Shield::new(&task)),
            task,
            messages: Messages::default(),
            seq: 0,
            sent: Sent::default(),
            times: &mut times,
        };
        let Ok(_) = drive_episode(&mut simulation, &place, 1, &mut gated, &mut ());
    }
    times
}

/// Walkers at 0.9 m/s.
fn in_a_ring(shape: &str, beam_count: u32) -> Times {
    let walkers = task_among_walkers(beam_count);
    let task = Task { robot: robot(shape).robot, ..walkers };
    let mut shield = Box::new(Shield::new(&task));
    let mut times = Times::default();
    for step in 1..=2000_u32 {
        let scan = LaserScan {
            header: Header { seq: step.into(), stamp_ns: u64::from(step) * 100_000_000 },
            ..ring_of_walkers(&task.lidar, step as f32 * 0.02)
        };
        let fast = Twist::new(task.robot.linear_max_mps, 0.0);
        times.of(&mut shield, &scan, Pose::default(), fast, fast, &Sent::of(&[fast]));
    }
    times
}

fn main() {
    let options: BTreeMap<String, String> = std::env::args()
        .skip(1)
        .filter_map(|argument| argument.split_once('=').map(|(key, value)| (key.into(), value.into())))
        .collect();
    let option = |key: &str, usual: &str| options.get(key).cloned().unwrap_or_else(|| usual.into());
    let number =
        |key: &str, usual: &str| option(key, usual).parse::<u64>().expect("worlds= and first= take numbers");
    let shape = option("shape", "circle");
    let first = number("first", "0");
    let worlds = first..first + number("worlds", "20");
    println!("family,beams,ticks,acts,see_median_us,see_p99_us,gate_median_us,gate_p99_us,gate_p999_us");
    for beams in option("beams", "72,720").split(',') {
        let beams = beams.parse().expect("beams= takes numbers");
        for family in option("families", "ring,crowd,stream,corridor,doorway,rooms,maze,clutter").split(',') {
            let mut times = match family {
                "ring" => in_a_ring(&shape, beams),
                _ => in_family(
                    &shape,
                    family.parse().expect("families= takes names of families"),
                    beams,
                    worlds.clone(),
                ),
            };
            times.print(family, beams);
        }
    }
}
