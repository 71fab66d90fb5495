//! Pictures of episodes: SVG written here, PNG through resvg. No fonts are needed.
//!
//! | mark | meaning |
//! |---|---|
//! | dark lines, grey shapes | walls, discs and polygons |
//! | line from pale to dark blue | the robot's way, coloured by time |
//! | outline with a tick, filled outline | the robot at its start, and where the picture ends |
//! | green ring | the goal and the radius within which it counts as reached |
//! | violet dots and thin lines | subgoals, joined to where they were chosen |
//! | violet square | the decision to wait |
//! | orange discs, lines and arrows | people where the picture ends, their ways, and where they walk in the next second |
//! | dashed rings and arrows | whom the safety gate believes to move, and how |
//! | thick and dashed line at the robot | where its last command and its last wish lead in a second |
//!
//! [`svg_strips`] draws the last seconds of episodes moment by moment, with what the robot saw and did; the foot of its
//! sheets says what its marks mean.

mod episode;
mod moment;
mod strip;
mod canvas;

pub use nav_picture::file::{DrawError, write_picture};

use crate::people::PersonState;
use crate::simulation::Simulation;
use crate::world::World;
use canvas::Panel;
use nav_core::footprint::Footprint;
use nav_core::geometry::{Point, Pose};
use nav_core::metrics::EpisodeEnd;
use nav_core::shield::Intervention;
use nav_core::task::Task;
use nav_core::twist::Twist;
use std::fmt::Write;
use std::sync::Arc;

/// Everything a picture of one episode shows. With no steps it shows the world alone.
#[derive(Clone, Debug)]
pub struct EpisodeTrace {
    /// The world.
    pub world: Arc<World>,
    /// The robot's footprint.
    pub footprint: Footprint,
    /// The goal counts as reached at this distance, m.
    pub goal_radius_m: f32,
    /// Written above the picture.
    pub title: String,
    /// Time from one step to the next, s.
    pub period_s: f32,
    /// Where everybody was, one entry a step.
    pub steps: Vec<TraceStep>,
    /// What the high level chose.
    pub decisions: Vec<Decision>,
    /// How it ended, if it has: success in green, collision in red, timeout in grey.
    pub end: Option<EpisodeEnd>,
    /// Whether it ended in a collision while the robot stood.
    pub hit_while_standing: bool,
}

/// Where everybody was at one step, in the world frame.
#[derive(Clone, Debug)]
pub struct TraceStep {
    /// The robot.
    pub pose: Pose,
    /// The people, in the order of the world.
    pub people: Vec<PersonState>,
    /// What the robot made of it, where that is known.
    pub seen: Option<Seen>,
}

impl EpisodeTrace {
    /// Of an episode that begins.
    pub fn begin(world: &Arc<World>, task: &Task) -> Self {
        Self {
            world: world.clone(),
            footprint: task.robot.footprint,
            goal_radius_m: task.goal_radius_m,
            title: world.name.clone(),
            period_s: task.control_period_s,
            steps: Vec::new(),
            decisions: Vec::new(),
            end: None,
            hit_while_standing: false,
        }
    }
}

impl TraceStep {
    /// The present moment of a simulation.
    pub fn of(simulation: &Simulation, seen: Option<Seen>) -> Self {
        Self { pose: simulation.pose(), people: simulation.people().to_vec(), seen }
    }
}

/// What a robot saw and did at a step, in the world frame.
#[derive(Clone, Debug)]
pub struct Seen {
    /// What the scan hit, m.
    pub hits: Vec<Point>,
    /// Everybody whom the safety gate follows, moving or standing.
    pub tracks: Vec<PersonState>,
    /// What was wished.
    pub wish: Twist,
    /// What left for the base.
    pub command: Twist,
    /// What the safety gate says about the wish.
    pub intervention: Option<Intervention>,
}

/// One choice of the high level.
#[derive(Clone, Copy, Debug)]
pub struct Decision {
    /// Index of the step at which it was made.
    pub step: usize,
    /// What was chosen, in the world frame, m.
    pub subgoal: Point,
    /// Index of the action, as in [`nav_core::task`].
    pub action: u32,
}

/// Width of a picture of one episode, px.
const PICTURE_PX: f32 = 680.0;
/// Width of an episode on a sheet, px.
const TILE_PX: f32 = 360.0;

/// A picture of one episode, as an SVG document.
pub fn svg(trace: &EpisodeTrace) -> String {
    let panel = episode::panel(trace, PICTURE_PX);
    document(panel.width, panel.height, &titled(&trace.title, &panel.body))
}

/// Pictures of several episodes in rows of `columns` (at least one), as an SVG document.
pub fn svg_sheet(traces: &[EpisodeTrace], columns: usize) -> String {
    let columns = columns.clamp(1, traces.len().max(1));
    let panels: Vec<Panel> = traces.iter().map(|trace| episode::panel(trace, TILE_PX)).collect();
    let mut body = String::new();
    let mut top = 0.0;
    for (panels, traces) in panels.chunks(columns).zip(traces.chunks(columns)) {
        for (column, (panel, trace)) in panels.iter().zip(traces).enumerate() {
            let left = column as f32 * TILE_PX;
            let tile = titled(&trace.title, &panel.body);
            writeln!(body, r#"<g transform="translate({left:.0} {top:.0})">{tile}</g>"#)
                .expect("a string takes everything");
        }
        top += panels.iter().map(|panel| panel.height).fold(0.0, f32::max);
    }
    document(columns as f32 * TILE_PX, top, &body)
}

/// The last seconds of several episodes, a strip of moments for each and a legend below, as an SVG document.
pub fn svg_strips(traces: &[EpisodeTrace]) -> String {
    let strips = traces.iter().enumerate().map(|(index, trace)| {
        let panel = strip::panel(trace, index);
        Panel { body: titled(&trace.title, &panel.body), ..panel }
    });
    let mut body = String::new();
    let mut top = 0.0;
    for panel in strips.chain([strip::legend()]) {
        writeln!(body, r#"<g transform="translate(0 {top:.0})">{}</g>"#, panel.body)
            .expect("a string takes everything");
        top += panel.height;
    }
    document(strip::STRIP_PX, top, &body)
}

/// The title is drawn as strokes; this keeps it readable for search and screen readers.
fn titled(title: &str, body: &str) -> String {
    let title = title.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
    format!("<title>{title}</title>\n{body}")
}

fn document(width: f32, height: f32, body: &str) -> String {
    let (width, height) = (width.max(1.0).ceil(), height.max(1.0).ceil());
    format!(
        r##"<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}">
<rect width="{width}" height="{height}" fill="#ffffff"/>
{body}</svg>
"##
    )
}

#[cfg(test)]
mod tests;
