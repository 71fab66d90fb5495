//! Success and collision of each method on each family, with intervals: a panel for each gate.

use super::axis::Axis;
use super::canvas::{Anchor, Canvas, FAINT, GRID, text_width};
use super::look::{Look, legend, legend_height};
use super::{Analysis, Figure};
use crate::analysis::estimate::CellEstimate;
use crate::plan::Study;
use crate::rows::Gate;

const PANEL_PX: f64 = 400.0;
const GAP_PX: f64 = 34.0;
/// Height of a method's line within a family, px.
const LINE_PX: f64 = 12.0;

/// Success by family.
pub(super) fn success(study: &Study, analysis: &Analysis) -> Option<Figure> {
    Some(Figure {
        name: "success-by-family",
        title: "Success by family",
        caption: format!(
            "Share of worlds whose goal was reached in time, %: interquartile mean over training seeds, {}.",
            intervals(study)
        ),
        canvas: draw(study, &analysis.success, Some(100.0), "success, %")?,
    })
}

/// Collisions by family.
pub(super) fn collision(study: &Study, analysis: &Analysis) -> Option<Figure> {
    Some(Figure {
        name: "collision-by-family",
        title: "Collisions by family",
        caption: format!(
            "Share of worlds with a collision, those while the robot stood among them, %: interquartile mean over training seeds, {}.",
            intervals(study)
        ),
        canvas: draw(study, &analysis.collision, None, "collision, %")?,
    })
}

/// What the lines of all figures are.
pub(super) fn intervals(study: &Study) -> String {
    format!("lines are {:.0} % intervals over new seeds and new worlds", 100.0 * study.bootstrap.coverage)
}

/// Draws shares up to `most` percent, or to the highest that there is.
fn draw(study: &Study, cells: &[CellEstimate], most: Option<f64>, label: &str) -> Option<Canvas> {
    let is_there = |method: &usize| cells.iter().any(|cell| cell.method == *method);
    let methods: Vec<usize> = study.shown().into_iter().filter(is_there).collect();
    if methods.is_empty() {
        return None;
    }
    let has_rows = |family: &&String| cells.iter().any(|cell| cell.family == **family);
    let families: Vec<&String> = study.families.iter().filter(has_rows).collect();
    let left = families.iter().map(|family| text_width(family)).fold(40.0, f64::max) + 16.0;
    let band = methods.len() as f64 * LINE_PX + 14.0;
    let width = left + study.gates.len() as f64 * (PANEL_PX + GAP_PX);
    let top = legend_height(study, &methods, width - 20.0) + 40.0;
    let bottom = top + families.len() as f64 * band;
    let mut canvas = Canvas::new(width, bottom + 46.0);
    legend(&mut canvas, study, &methods, (10.0, 6.0), width - 20.0);
    let shown = cells.iter().filter(|cell| methods.contains(&cell.method));
    let highest = shown.map(|cell| 100.0 * cell.estimate.interval.high).fold(1.0, f64::max);
    let most = most.unwrap_or(highest);
    for (index, &gate) in study.gates.iter().enumerate() {
        let start = left + index as f64 * (PANEL_PX + GAP_PX);
        let axis = Axis::new((0.0, most), (start, start + PANEL_PX));
        axis.draw_below(&mut canvas, (top, bottom), 5);
        canvas.text(&heading(gate), (start, top - 10.0), Anchor::Start).is_bold = true;
        canvas.text(label, (start + PANEL_PX / 2.0, bottom + 36.0), Anchor::Middle).color = FAINT;
        for (row, family) in families.iter().enumerate() {
            let above = top + row as f64 * band;
            canvas.line((start, above), (start + PANEL_PX, above), GRID, 1.0);
            for (line, &method) in methods.iter().enumerate() {
                let own =
                    |cell: &&CellEstimate| (cell.method, cell.gate, &cell.family) == (method, gate, *family);
                if let Some(cell) = cells.iter().find(own) {
                    mark(&mut canvas, &axis, cell, above + 7.0 + (line as f64 + 0.5) * LINE_PX);
                }
            }
        }
    }
    for (row, family) in families.iter().enumerate() {
        let middle = top + (row as f64 + 0.5) * band;
        canvas.text(family, (left - 10.0, middle + 4.5), Anchor::End);
    }
    Some(canvas)
}

fn mark(canvas: &mut Canvas, axis: &Axis, cell: &CellEstimate, y: f64) {
    let look = Look::of(cell.method);
    let at = |share: f64| axis.at(100.0 * share);
    let interval = cell.estimate.interval;
    canvas.line((at(interval.low), y), (at(interval.high), y), look.color, 2.0);
    look.mark(canvas, (at(cell.estimate.value), y), 4.0);
}

/// Over a panel.
pub(super) fn heading(gate: Gate) -> String {
    match gate {
        Gate::Off => "without the safety gate".to_owned(),
        Gate::On => "with the safety gate".to_owned(),
    }
}
