//! Performance profiles: a panel for each gate.

use super::axis::Axis;
use super::by_family::{heading, intervals};
use super::canvas::{Anchor, Canvas, FAINT};
use super::look::{Look, legend, legend_height};
use super::{Analysis, Figure};
use crate::analysis::overall::{Overall, thresholds};
use crate::plan::Study;

const PANEL_PX: (f64, f64) = (400.0, 280.0);
const GAP_PX: f64 = 60.0;

/// The profiles.
pub(super) fn profiles(study: &Study, analysis: &Analysis) -> Option<Figure> {
    let overall = &analysis.overall;
    let is_there = |method: &usize| overall.iter().any(|own| own.method == *method);
    let methods: Vec<usize> = study.shown().into_iter().filter(is_there).collect();
    if methods.is_empty() {
        return None;
    }
    let width = 10.0 + study.gates.len() as f64 * (PANEL_PX.0 + GAP_PX);
    let top = legend_height(study, &methods, width - 20.0) + 40.0;
    let bottom = top + PANEL_PX.1;
    let mut canvas = Canvas::new(width, bottom + 46.0);
    legend(&mut canvas, study, &methods, (10.0, 6.0), width - 20.0);
    for (index, &gate) in study.gates.iter().enumerate() {
        let left = 50.0 + index as f64 * (PANEL_PX.0 + GAP_PX);
        let x = Axis::new((0.0, 100.0), (left, left + PANEL_PX.0));
        let y = Axis::new((0.0, 100.0), (bottom, top));
        x.draw_below(&mut canvas, (top, bottom), 5);
        y.draw_left(&mut canvas, (left, left + PANEL_PX.0), 5);
        canvas.text(&heading(gate), (left, top - 10.0), Anchor::Start).is_bold = true;
        let below = (left + PANEL_PX.0 / 2.0, bottom + 36.0);
        canvas.text("success, %", below, Anchor::Middle).color = FAINT;
        for own in overall.iter().filter(|own| own.gate == gate && methods.contains(&own.method)) {
            draw(&mut canvas, own, &x, &y);
        }
    }
    let side = canvas.text("share of scores above, %", (14.0, top + PANEL_PX.1 / 2.0), Anchor::Middle);
    side.is_upright = true;
    side.color = FAINT;
    Some(Figure {
        name: "performance-profiles",
        title: "Performance profiles",
        caption: format!(
            "Share of all scores (a training seed on a family) above each success rate; higher is better. Bands, not lines: {}.",
            intervals(study).replace("lines are ", "")
        ),
        canvas,
    })
}

fn draw(canvas: &mut Canvas, own: &Overall, x: &Axis, y: &Axis) {
    let look = Look::of(own.method);
    let at = |threshold: f64, share: f64| (x.at(100.0 * threshold), y.at(100.0 * share));
    let pairs = || thresholds().into_iter().zip(&own.profile);
    let line: Vec<_> = pairs().map(|(threshold, share)| at(threshold, share.value)).collect();
    let upper = pairs().map(|(threshold, share)| at(threshold, share.interval.high));
    let mut lower: Vec<_> = pairs().map(|(threshold, share)| at(threshold, share.interval.low)).collect();
    lower.reverse();
    canvas.area(&upper.chain(lower).collect::<Vec<_>>(), look.color, 0.12);
    canvas.path(&line, look.color, 2.0, &look.dash());
    // A mark of its own on the line, elsewhere for each method.
    let place = (7 + 11 * own.method) % line.len().max(1);
    if let Some(&point) = line.get(place) {
        look.mark(canvas, point, 4.0);
    }
}
