//! Episodes in a row, from the first scan to the report.

use anyhow::Result;
use nav_core::metrics::{EpisodeEnd, EpisodeRecorder, StepTruth};
use nav_sim::simulation::{Outcome, Simulation};
use std::io::Write as _;

use crate::cli::Pace;
use crate::link::{Link, LinkError};
use crate::picture::Picture;
use crate::plan::Plan;
use crate::report::{EpisodeReport, Report, RunEnd, Summary, Trajectory};
use crate::signals::Interrupt;
use crate::view::View;
use crate::worlds::Place;

/// Drives all episodes of a plan. What was driven before an error or Ctrl-C is reported all the same.
pub(crate) fn run(plan: &Plan) -> Result<RunEnd> {
    let interrupt = Interrupt::install()?;
    let mut link = Link::open(plan, interrupt)?;
    let mut view = plan.show_map.then(View::default);
    let mut episodes = Vec::new();
    say(&format!("simulator: robot `{}`, {} episodes, waiting for the runtime", plan.robot, plan.episodes));
    let driven = drive_all(plan, &mut link, &mut view, &mut episodes);
    let (ended, result) = match driven {
        Ok(()) => ("complete".to_owned(), Ok(RunEnd::Complete)),
        Err(error) if matches!(error.downcast_ref(), Some(LinkError::Interrupted)) => {
            ("interrupted".to_owned(), Ok(RunEnd::Interrupted))
        }
        Err(error) => (format!("{error:#}"), Err(error)),
    };
    let summary = Summary::of(&episodes, plan.episodes, link.late_periods());
    say(&summary.line());
    if let Some(path) = &plan.report {
        let report = Report {
            simulator_version: env!("CARGO_PKG_VERSION"),
            robot: plan.robot.as_str(),
            pace: if plan.pace == Pace::Lockstep { "lockstep" } else { "realtime" },
            ended,
            task: &plan.task,
            summary,
            episodes: &episodes,
        };
        if let Err(error) = report.write(path) {
            // Why the drive ended matters more than a report that could not be written.
            return result.and(Err(error));
        }
    }
    result
}

/// Tells a person who may have closed the terminal; the episodes go on without them.
fn say(text: &str) {
    let _ = writeln!(std::io::stdout(), "{text}");
}

fn drive_all(
    plan: &Plan,
    link: &mut Link,
    view: &mut Option<View>,
    episodes: &mut Vec<EpisodeReport>,
) -> Result<()> {
    link.wait_for_runtime()?;
    let first_goal_id = link.first_goal_id();
    let mut simulation: Option<Simulation> = None;
    for index in 0..plan.episodes {
        let seed = plan.seed + u64::from(index);
        let place = plan.source.place(seed, &plan.task)?;
        let simulation = match &mut simulation {
            Some(simulation) => {
                simulation.reset(place.world.clone(), place.simulation_seed);
                simulation
            }
            none => none.insert(Simulation::new(
                place.world.clone(),
                &plan.task,
                &plan.disturbance,
                place.simulation_seed,
            )),
        };
        link.restart();
        let mut picture = plan.draw.as_ref().map(|_| Picture::new(&plan.task, &place));
        let report = drive(
            plan,
            link,
            simulation,
            &place,
            (seed, first_goal_id.wrapping_add(index)),
            &mut picture,
            view,
        )?;
        say(&report.line());
        if let (Some(picture), Some(folder)) = (picture, &plan.draw) {
            picture.write(folder, &report)?;
        }
        episodes.push(report);
    }
    Ok(())
}

/// One episode to its end; `names` are its seed and goal id.
fn drive(
    plan: &Plan,
    link: &mut Link,
    simulation: &mut Simulation,
    place: &Place,
    names: (u64, u32),
    picture: &mut Option<Picture>,
    view: &mut Option<View>,
) -> Result<EpisodeReport> {
    let (seed, goal_id) = names;
    let mut recorder = EpisodeRecorder::new(simulation.pose(), plan.task.control_period_s);
    let mut trajectory = Trajectory::new(simulation.pose(), plan.with_poses);
    if let Some(view) = view {
        view.begin(simulation);
    }
    let outcome = loop {
        if let Some(picture) = picture {
            picture.step(simulation);
        }
        let target = link.exchange(simulation, goal_id)?;
        if let Some(picture) = picture {
            picture.note(link.status()?, goal_id);
        }
        let outcome = simulation.step(target);
        recorder.step(&StepTruth {
            pose: simulation.pose(),
            linear_mps: simulation.velocity().linear_mps,
            clearance_m: simulation.clearance_m(),
            time_to_collision_s: simulation.time_to_collision_s(),
        });
        trajectory.push(simulation.pose());
        if let Some(view) = view {
            view.show(simulation, link.command(), outcome.is_over());
        }
        if outcome.is_over() {
            break outcome;
        }
    };
    if let Some(picture) = picture {
        picture.step(simulation);
    }
    let end = match outcome {
        Outcome::Reached => EpisodeEnd::Success,
        Outcome::Collided => EpisodeEnd::Collision,
        Outcome::TimedOut | Outcome::Running => EpisodeEnd::Timeout,
    };
    let metrics = recorder.finish(end, simulation.hit_while_standing(), place.geodesic_m, place.euclidean_m);
    let (trajectory_hash, poses) = trajectory.finish();
    Ok(EpisodeReport {
        world: place.world.name.clone(),
        seed,
        goal_id,
        metrics,
        stale_steps: link.driver().stale_steps(),
        trajectory_hash,
        poses,
    })
}
