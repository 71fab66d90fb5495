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

#[path = "tracking/judge.rs"]
mod judge;
#[path = "tracking/ring.rs"]
mod ring;
mod support;

use judge::{Counts, Judge};
use nav_core::scan::beams::Beams;
use nav_core::task::Task;
use nav_core::tracker::Tracker;
use nav_env::episode_loop::drive_episode;
use nav_env::limits::Limits;
use nav_env::messages::Messages;
use nav_env::other_lidar::OtherLidar;
use nav_env::worlds::Place;
use nav_rivals::Rival;
use nav_sim::disturbance::Disturbance;
use nav_sim::families::{Family, Split};
use nav_sim::simulation::Simulation;
use ring::ring;
use std::collections::BTreeMap;
use std::ops::Range;
use support::quantile;

fn measured(family: Family, beams: u32, worlds: Range<u64>, verbose: bool) -> Counts {
    let lidar = OtherLidar { beam_count: beams, range_max_m: Task::default().lidar.range_max_m };
    let mut counts = Counts::default();
    for seed in worlds {
        let place = Place::generated(family, Split::Validation, seed, &Task::default().robot.footprint);
        let task = lidar
            .on(&Limits::default().task(&Task::default(), place.scene.episode_s(&Task::default().robot)));
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
