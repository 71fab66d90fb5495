//! Every policy in every world, on several threads; rows come in a fixed order whatever their number.

use anyhow::{Context, Result};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use nav_env::batch::in_order;
use nav_env::robot::{Driven, Driver, SimulatedRobot};
use nav_env::rows::EpisodeRow;
use nav_host::stop::Stop;
use nav_host::terminal::{Level, debug, says};
use nav_sim::drawing::{EpisodeTrace, svg_sheet, write_picture};
use std::sync::{Mutex, PoisonError};

use super::plan::{Episodes, Plan, ROWS};

/// A robot and its driver for each policy.
pub(super) type Fleet = Vec<(SimulatedRobot, Box<dyn Driver + Send>)>;

/// Drives what has no row yet, and appends each row as it comes.
///
/// # Errors
/// A policy whose files were changed, or rows that cannot be written; those before are kept.
pub fn drive(plan: &Plan, episodes: &mut Episodes, threads: usize, stop: &Stop) -> Result<()> {
    let bar = ProgressBar::new(plan.row_count() as u64).with_style(
        ProgressStyle::with_template("{bar:30} {pos}/{len} episodes, {eta} left")
            .context("the bar's template")?,
    );
    if !says(Level::Info) {
        bar.set_draw_target(ProgressDrawTarget::hidden());
    }
    let driven = episodes.rows.len();
    bar.inc(driven as u64);
    // Of the first world some policies may have driven already.
    let (first, begun) = (driven / plan.policies.len(), driven % plan.policies.len());
    let fleets = Fleets::new(plan, threads)?;
    let worker = || {
        let mut fleet = fleets.take();
        move |world: usize| {
            let skipped = if world == first { begun } else { 0 };
            drive_world(plan, &mut fleet, world, skipped)
        }
    };
    let Episodes { rows, file } = episodes;
    let result = in_order(
        first..plan.scenes.len(),
        threads,
        worker,
        || stop.signal().is_some(),
        |_, new| {
            for row in new {
                file.append(&row)?;
                debug(format_args!(
                    "{}: {}, seed {}: {:?}",
                    row.policy,
                    scene(&row),
                    row.world_seed,
                    row.end
                ));
                rows.push(row);
                bar.inc(1);
            }
            anyhow::Ok(())
        },
    );
    bar.finish_and_clear();
    result.with_context(|| {
        format!(
            "stopped after {} of {} episodes, which {}/{ROWS} keeps; mend it and go on with --resume",
            rows.len(),
            plan.row_count(),
            plan.out.display()
        )
    })
}

fn scene(row: &EpisodeRow) -> String {
    let family = row.family.map(|family| family.to_string());
    family.or_else(|| row.world_file.clone()).unwrap_or_default()
}

fn drive_world(plan: &Plan, fleet: &mut Fleet, world: usize, skipped: usize) -> Vec<EpisodeRow> {
    let place = plan.scenes.place(world);
    let policies = plan.policies.iter().zip(fleet).skip(skipped);
    let row = |(policy, (robot, driver)): (&_, &mut (SimulatedRobot, Box<dyn Driver + Send>))| {
        let driven = robot.drive(&mut **driver, &place, false);
        EpisodeRow::new(&plan.labels(policy, &place.scene, place.seed), &driven)
    };
    policies.map(row).collect()
}

/// A fleet for each thread, made before the threads, so that an error is a sentence.
pub(super) struct Fleets(Mutex<Vec<Fleet>>);

impl Fleets {
    pub(super) fn new(plan: &Plan, threads: usize) -> Result<Self> {
        let disturbance = plan.disturbance.disturbance(&plan.task.robot);
        let fleet = || -> Result<Fleet> {
            let robot = || {
                SimulatedRobot::new(&plan.task, &disturbance).with_limits(plan.limits).with_lidar(plan.lidar)
            };
            plan.policies
                .iter()
                .map(|policy| Ok((robot(), policy.driver(&plan.task, plan.shield_of(policy))?)))
                .collect()
        };
        Ok(Self(Mutex::new((0..threads).map(|_| fleet()).collect::<Result<_>>()?)))
    }

    pub(super) fn take(&self) -> Fleet {
        let fleet = self.0.lock().unwrap_or_else(PoisonError::into_inner).pop();
        fleet.expect("there is one for each thread")
    }
}

/// Drives the first worlds of each family once more and draws one sheet a policy.
///
/// # Errors
/// A picture that cannot be written.
pub fn draw(plan: &Plan, threads: usize) -> Result<()> {
    let worlds = plan.scenes.first(plan.pictures);
    if worlds.is_empty() {
        return Ok(());
    }
    let fleets = Fleets::new(plan, threads)?;
    let worker = || {
        let mut fleet = fleets.take();
        let worlds = &worlds;
        move |index: usize| {
            let place = plan.scenes.place(worlds[index]);
            let traced = |(robot, driver): &mut (SimulatedRobot, Box<dyn Driver + Send>)| {
                robot.drive(&mut **driver, &place, true)
            };
            fleet.iter_mut().map(traced).collect::<Vec<Driven>>()
        }
    };
    let mut traces: Vec<Vec<EpisodeTrace>> = plan.policies.iter().map(|_| Vec::new()).collect();
    in_order(
        0..worlds.len(),
        threads,
        worker,
        || false,
        |_, driven| {
            for (traces, driven) in traces.iter_mut().zip(driven) {
                traces.extend(driven.trace);
            }
            anyhow::Ok(())
        },
    )?;
    for (policy, traces) in plan.policies.iter().zip(&traces) {
        let sheet = svg_sheet(traces, 3);
        for path in plan.pictures_of(policy) {
            write_picture(&path, &sheet).with_context(|| format!("cannot draw {}", path.display()))?;
        }
    }
    Ok(())
}
