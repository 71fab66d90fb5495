//! A picture of an episode: where the robot went, and which subgoals the runtime said it drove to.

use anyhow::{Context, Result};
use nav_core::geometry::Point;
use nav_core::messages::{RunState, Status};
use nav_core::metrics::EpisodeEnd;
use nav_core::task::Task;
use nav_env::worlds::Place;
use nav_sim::drawing::{Decision, EpisodeTrace, Seen, TraceStep, svg, svg_strips, write_picture};
use nav_sim::simulation::Simulation;
use std::path::Path;

use crate::report::EpisodeReport;

/// Collects an episode, then draws it.
#[derive(Debug)]
pub(crate) struct Picture {
    trace: EpisodeTrace,
    last_subgoal: Option<(u32, u32, u32)>,
}

impl Picture {
    /// Before the first step.
    pub(crate) fn new(task: &Task, place: &Place) -> Self {
        Self { trace: EpisodeTrace::begin(&place.world, task), last_subgoal: None }
    }

    /// Adds the present moment.
    pub(crate) fn step(&mut self, simulation: &Simulation, seen: Option<Seen>) {
        self.trace.steps.push(TraceStep::of(simulation, seen));
    }

    /// Adds a decision if the runtime says that it drives to another subgoal than before.
    pub(crate) fn note(&mut self, status: &Status, goal_id: u32) {
        let subgoal = (status.subgoal_action, status.subgoal_x_m.to_bits(), status.subgoal_y_m.to_bits());
        let drives = status.goal_id == goal_id && status.state == RunState::Driving as u32;
        if drives && self.last_subgoal != Some(subgoal) {
            self.last_subgoal = Some(subgoal);
            self.trace.decisions.push(Decision {
                step: self.trace.steps.len().saturating_sub(1),
                subgoal: Point::new(status.subgoal_x_m, status.subgoal_y_m),
                action: status.subgoal_action,
            });
        }
    }

    /// Draws `<world>-<seed>.svg` into a folder, and of a collision `<world>-<seed>-collision.svg`.
    pub(crate) fn write(mut self, folder: &Path, report: &EpisodeReport) -> Result<()> {
        (self.trace.end, self.trace.hit_while_standing) =
            (Some(report.metrics.end), report.metrics.hit_while_standing);
        let name: String = report
            .world
            .chars()
            .map(|c| if c.is_ascii_alphanumeric() || c == '_' { c } else { '-' })
            .collect();
        let path = |end: &str| folder.join(format!("{name}-{}{end}.svg", report.seed));
        write_picture(&path(""), &svg(&self.trace)).context("--draw")?;
        if report.metrics.end == EpisodeEnd::Collision {
            write_picture(&path("-collision"), &svg_strips(&[self.trace])).context("--draw")?;
        }
        Ok(())
    }
}
