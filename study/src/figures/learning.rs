//! Learning curves: a panel a method, a thin line a seed, a thick one for their interquartile mean.

use super::axis::Axis;
use super::canvas::{Anchor, Canvas, FAINT};
use super::look::Look;
use super::{Analysis, Figure};
use crate::analysis::curves::{MethodCurves, Middle};
use crate::plan::Study;
use crate::rows::CurveRow;

const COLUMNS: usize = 3;
const PANEL_PX: (f64, f64) = (250.0, 170.0);
/// Left of and above a panel, px.
const MARGIN_PX: (f64, f64) = (46.0, 34.0);
const BELOW_PX: f64 = 44.0;

/// Success over training.
pub(super) fn success(study: &Study, analysis: &Analysis) -> Option<Figure> {
    Some(Figure {
        name: "learning-success",
        title: "Success over training",
        caption: "Success on validation worlds, %, over environment steps, millions. A thin line is a training seed, the thick one \
                  their interquartile mean."
            .to_owned(),
        canvas: draw(study, &analysis.curves, Some(100.0), |point| point.success, |middle| middle.success)?,
    })
}

/// Collisions over training.
pub(super) fn collision(study: &Study, analysis: &Analysis) -> Option<Figure> {
    Some(Figure {
        name: "learning-collision",
        title: "Collisions over training",
        caption: "Collisions on validation worlds, %, over environment steps, millions. Lines as above."
            .to_owned(),
        canvas: draw(study, &analysis.curves, None, |point| point.collision, |middle| middle.collision)?,
    })
}

/// Where the panels of methods lie: `draw` is given the canvas, the method's curves, and the corners of its panel.
pub(super) fn panels(
    study: &Study,
    curves: &[&MethodCurves],
    mut draw: impl FnMut(&mut Canvas, &MethodCurves, [f64; 4]),
) -> Option<Canvas> {
    if curves.is_empty() {
        return None;
    }
    let cell = (PANEL_PX.0 + MARGIN_PX.0 + 14.0, PANEL_PX.1 + MARGIN_PX.1 + BELOW_PX);
    let rows = curves.len().div_ceil(COLUMNS);
    let mut canvas = Canvas::new(COLUMNS.min(curves.len()) as f64 * cell.0, rows as f64 * cell.1);
    for (index, curves) in curves.iter().enumerate() {
        let left = (index % COLUMNS) as f64 * cell.0 + MARGIN_PX.0;
        let top = (index / COLUMNS) as f64 * cell.1 + MARGIN_PX.1;
        let label = &study.methods[curves.method].label;
        canvas.text(label, (left, top - 10.0), Anchor::Start).is_bold = true;
        draw(&mut canvas, curves, [left, top, left + PANEL_PX.0, top + PANEL_PX.1]);
    }
    Some(canvas)
}

/// Draws what is read from a look and from the interquartile means, up to `most` percent, or to the highest that there is.
fn draw(
    study: &Study,
    curves: &[MethodCurves],
    most: Option<f64>,
    of_point: fn(&CurveRow) -> f64,
    of_middle: fn(&Middle) -> f64,
) -> Option<Canvas> {
    let points = || curves.iter().flat_map(|curves| &curves.seeds).flat_map(|seed| &seed.points);
    let steps_max = points().map(|point| point.env_steps as f64 / 1e6).fold(0.0, f64::max);
    let highest = points().map(|point| 100.0 * of_point(point)).fold(1.0, f64::max);
    let most = most.unwrap_or(highest);
    panels(study, &curves.iter().collect::<Vec<_>>(), |canvas, curves, [left, top, right, bottom]| {
        let x = Axis::new((0.0, steps_max), (left, right));
        let y = Axis::new((0.0, most), (bottom, top));
        x.draw_below(canvas, (top, bottom), 4);
        y.draw_left(canvas, (left, right), 4);
        canvas.text("steps, millions", (right, bottom + 34.0), Anchor::End).color = FAINT;
        let color = Look::of(curves.method).color;
        let at = |steps: u64, share: f64| (x.at(steps as f64 / 1e6), y.at(100.0 * share));
        for seed in &curves.seeds {
            let line: Vec<_> = seed.points.iter().map(|point| at(point.env_steps, of_point(point))).collect();
            canvas.path(&line, color, 1.0, r#"stroke-opacity="0.45""#);
        }
        let line: Vec<_> = curves.iqm.iter().map(|middle| at(middle.env_steps, of_middle(middle))).collect();
        canvas.path(&line, color, 3.0, "");
    })
}
