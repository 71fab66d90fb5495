//! Episodes in a row, from the first scan to the report.

use anyhow::{Context, Result};
use nav_core::twist::Twist;
use nav_env::episode_loop::{Onlooker, drive_episode};
use nav_env::seen::seen;
use nav_env::worlds::{Place, Scene};
use nav_host::exit::Exit;
use nav_host::stop::{Second, Stop};
use nav_host::terminal::{debug, inform, say};
use nav_sim::drawing::Seen;
use nav_sim::simulation::Simulation;

use crate::cli::Pace;
use crate::follow::Follow;
use crate::link::{Link, LinkError};
use crate::picture::Picture;
use crate::plan::Plan;
use crate::report::{EpisodeReport, Report, Summary, Trajectory};
use crate::view::View;

/// Drives all episodes of a plan. What was driven before an error or a signal is reported all the same.
pub(crate) fn run(plan: &Plan) -> Result<Exit> {
    let stop = Stop::listen(Second::EndsAtOnce).context("signals cannot be taken over")?;
    let mut link = Link::open(plan, stop)?;
    let mut view = plan.show_map.then(View::default);
    let mut episodes = Vec::new();
    inform(format_args!(
        "simulator: robot `{}`, {} episodes, waiting for the runtime",
        plan.robot, plan.episodes
    ));
    let driven = drive_all(plan, &mut link, &mut view, &mut episodes);
    let (ended, result) = match driven {
        Ok(()) => ("complete".to_owned(), Ok(Exit::Done)),
        Err(error) => match error.downcast_ref() {
            Some(LinkError::Stopped(signal)) => (signal.to_string(), Ok(Exit::Stopped(*signal))),
            _ => (format!("{error:#}"), Err(error)),
        },
    };
    let summary = Summary::of(&episodes, plan.episodes, link.late_periods());
    say(summary.line());
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

fn drive_all(
    plan: &Plan,
    link: &mut Link,
    view: &mut Option<View>,
    episodes: &mut Vec<EpisodeReport>,
) -> Result<()> {
    debug_task(plan);
    link.wait_for_runtime()?;
    debug("the runtime is there");
    let first_goal_id = link.first_goal_id();
    let mut simulation: Option<Simulation> = None;
    for index in 0..plan.episodes {
        let seed = plan.seed + u64::from(index);
        let place = plan.source.place(index, seed, &plan.task)?;
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
        debug_place(&place, seed);
        link.restart();
        let goal_id = first_goal_id.wrapping_add(index);
        let report = drive(plan, link, simulation, &place, goal_id, view)?;
        episodes.push(report);
    }
    Ok(())
}

/// What a driver's author can compare with what a robot of his own sends.
fn debug_task(plan: &Plan) {
    let lidar = &plan.task.lidar;
    debug(format_args!(
        "every {:.0} ms odom, goal and a scan of {} beams over {:.0} degrees to {} m; shared files in {}",
        1e3 * plan.task.control_period_s,
        lidar.beam_count,
        lidar.field_of_view_rad.to_degrees(),
        lidar.range_max_m,
        plan.ipc.root().display()
    ));
}

fn debug_place(place: &Place, seed: u64) {
    let (start, goal) = (&place.world.start, &place.world.goal);
    debug(format_args!(
        "{}, seed {seed}: from {:.2}, {:.2} m, yaw {:.2} rad, to {:.2}, {:.2} m; the shortest way is {:.1} m",
        place.world.name,
        start.x_m,
        start.y_m,
        start.yaw_rad,
        goal.x,
        goal.y,
        place.geodesic_m().unwrap_or(f32::NAN)
    ));
}

/// Whatever looks on while an episode is driven.
struct Onlookers<'a> {
    goal_id: u32,
    trajectory: Trajectory,
    picture: Option<Picture>,
    view: &'a mut Option<View>,
    follow: Follow,
    /// Of the newest scan, for whoever draws.
    seen: Option<Seen>,
}

impl Onlooker<Link> for Onlookers<'_> {
    fn commanded(&mut self, simulation: &Simulation, link: &Link) {
        if self.picture.is_none() && self.view.is_none() {
            return;
        }
        self.follow.take(link.messages());
        let (status, command) = (link.status(), link.command().twist());
        let seen = Seen {
            wish: Twist::new(status.wish_linear_mps, status.wish_angular_radps),
            command,
            ..seen(simulation, link.messages(), self.follow.tracks())
        };
        if let Some(picture) = &mut self.picture {
            picture.step(simulation, Some(seen.clone()));
            picture.note(status, self.goal_id);
        }
        self.seen = Some(seen);
    }

    fn driven(&mut self, simulation: &Simulation, link: &Link) {
        self.trajectory.push(simulation.pose());
        if let (Some(view), Some(seen)) = (&mut self.view, &self.seen) {
            view.show(simulation, seen, link.command().faults, simulation.outcome().is_over());
        }
    }
}

/// One episode to its end.
fn drive(
    plan: &Plan,
    link: &mut Link,
    simulation: &mut Simulation,
    place: &Place,
    goal_id: u32,
    view: &mut Option<View>,
) -> Result<EpisodeReport> {
    if let Some(view) = view {
        view.begin(simulation);
    }
    let mut onlookers = Onlookers {
        goal_id,
        trajectory: Trajectory::new(simulation.pose(), plan.with_poses),
        picture: plan.draw.as_ref().map(|_| Picture::new(&plan.task, place)),
        view,
        follow: Follow::new(&plan.task),
        seen: None,
    };
    let metrics = drive_episode(simulation, place, goal_id, link, &mut onlookers)?;
    let Onlookers { trajectory, picture, .. } = onlookers;
    let (trajectory_hash, poses) = trajectory.finish();
    let report = EpisodeReport {
        world: place.world.name.clone(),
        world_file: match &place.scene {
            Scene::File(name) => Some(name.to_string()),
            Scene::Family(..) => None,
        },
        seed: place.seed,
        goal_id,
        metrics,
        stale_steps: link.driver().stale_steps(),
        trajectory_hash,
        poses,
    };
    inform(report.line());
    if let (Some(mut picture), Some(folder)) = (picture, &plan.draw) {
        picture.step(simulation, None);
        picture.write(folder, &report)?;
    }
    Ok(report)
}
