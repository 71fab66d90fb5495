//! Differences with their intervals: a line a question. What is better lies to the right of zero whatever is measured.

use super::axis::Axis;
use super::by_family::intervals;
use super::canvas::{Anchor, Canvas, FAINT, text_width};
use super::{Analysis, Figure};
use crate::analysis::contrast::{Answer, Found};
use crate::plan::{Contrast, Study};
use crate::stats::Interval;

const PANEL_PX: f64 = 520.0;
const LINE_PX: f64 = 20.0;
const BETTER: &str = "#0072b2";
const WORSE: &str = "#d55e00";
const OPEN: &str = "#5a5a5a";

/// The primary questions.
pub(super) fn primaries(study: &Study, analysis: &Analysis) -> Option<Figure> {
    Some(Figure {
        name: "primary-differences",
        title: "The primary comparisons, drawn",
        caption: format!(
            "Difference of interquartile means, points of a hundred, turned so that right of zero is better; {}. Blue triangle: \
             better; orange triangle, pointing down: worse; grey disc: the interval holds zero.",
            intervals(study)
        ),
        canvas: draw(study, &analysis.primaries)?,
    })
}

/// Where a method must not be worse.
pub(super) fn non_inferiority(study: &Study, analysis: &Analysis) -> Option<Figure> {
    Some(Figure {
        name: "non-inferiority-differences",
        title: "Not worse than the margin",
        caption: format!(
            "As above, on the families where nothing is to be lost; the dashed line is the margin, and an interval to the right of \
             it is not worse; {}.",
            intervals(study)
        ),
        canvas: draw(study, &analysis.non_inferiority)?,
    })
}

/// Value and interval in points, turned so that more is better.
fn points(contrast: &Contrast, found: &Found) -> (f64, Interval) {
    let sign = if contrast.metric.more_is_better() { 100.0 } else { -100.0 };
    let ends = [found.difference.interval.low * sign, found.difference.interval.high * sign];
    (found.difference.value * sign, Interval { low: ends[0].min(ends[1]), high: ends[0].max(ends[1]) })
}

/// Questions of the same two methods, metric and gate stand together.
fn group(study: &Study, contrast: &Contrast) -> String {
    format!(
        "{}: {} against {}, gate {}",
        contrast.metric.words(),
        study.methods[contrast.method].label,
        study.methods[contrast.against].label,
        contrast.gate.word()
    )
}

fn draw(study: &Study, answers: &[Answer]) -> Option<Canvas> {
    let found: Vec<(&Contrast, &Found)> =
        answers.iter().filter_map(|answer| Some((&answer.contrast, answer.found.as_ref()?))).collect();
    if found.is_empty() {
        return None;
    }
    let mut reach: (f64, f64) = (-5.0, 5.0);
    for (contrast, found) in &found {
        let (_, interval) = points(contrast, found);
        reach = (reach.0.min(interval.low), reach.1.max(interval.high));
    }
    let groups: Vec<String> = found.iter().map(|(contrast, _)| group(study, contrast)).collect();
    let heads = 1 + groups.windows(2).filter(|pair| pair[0] != pair[1]).count();
    let left = study.families.iter().map(|family| text_width(family)).fold(40.0, f64::max) + 16.0;
    let (top, lines) = (10.0, found.len() as f64 + 1.4 * heads as f64);
    let bottom = top + lines * LINE_PX;
    let width =
        (left + PANEL_PX + 190.0).max(groups.iter().map(|group| text_width(group)).fold(0.0, f64::max));
    let mut canvas = Canvas::new(width, bottom + 46.0);
    let axis = Axis::new(reach, (left, left + PANEL_PX));
    axis.draw_below(&mut canvas, (top, bottom), 6);
    canvas.line((axis.at(0.0), top), (axis.at(0.0), bottom), FAINT, 1.5);
    let mut y = top;
    for (index, (contrast, found)) in found.iter().enumerate() {
        if index == 0 || groups[index] != groups[index - 1] {
            y += 1.4 * LINE_PX;
            canvas.text(&groups[index], (10.0, y - 6.0), Anchor::Start).is_bold = true;
        }
        y += LINE_PX;
        draw_line(&mut canvas, &axis, contrast, found, y - LINE_PX / 2.0);
        canvas.text(&contrast.family, (left - 10.0, y - LINE_PX / 2.0 + 4.5), Anchor::End);
    }
    let below = (left + PANEL_PX / 2.0, bottom + 36.0);
    canvas.text("difference, points; better to the right", below, Anchor::Middle).color = FAINT;
    Some(canvas)
}

fn draw_line(canvas: &mut Canvas, axis: &Axis, contrast: &Contrast, found: &Found, y: f64) {
    let (value, interval) = points(contrast, found);
    let (color, shape): (_, f64) = match interval {
        Interval { low, .. } if low > 0.0 => (BETTER, -1.0),
        Interval { high, .. } if high < 0.0 => (WORSE, 1.0),
        _ => (OPEN, 0.0),
    };
    if contrast.margin > 0.0 {
        let x = axis.at(-100.0 * contrast.margin);
        let ends = [(x, y - LINE_PX / 2.0), (x, y + LINE_PX / 2.0)];
        canvas.path(&ends, FAINT, 1.0, r#"stroke-dasharray="3 2""#);
    }
    canvas.line((axis.at(interval.low), y), (axis.at(interval.high), y), color, 2.0);
    let x = axis.at(value);
    canvas.shape(if shape.abs() > 0.0 {
        let (tip, base) = (y + shape * 6.0, y - shape * 4.5);
        format!(
            r#"<polygon points="{x:.1},{tip:.1} {:.1},{base:.1} {:.1},{base:.1}" fill="{color}"/>"#,
            x - 5.5,
            x + 5.5
        )
    } else {
        format!(r#"<circle cx="{x:.1}" cy="{y:.1}" r="4.5" fill="{color}"/>"#)
    });
    let [value, low, high] = [value, interval.low, interval.high].map(signed);
    let text = format!("{value} [{low}, {high}]");
    canvas.text(&text, (axis.at(f64::INFINITY) + 10.0, y + 4.5), Anchor::Start).color = FAINT;
}

/// Points with their sign; what rounds to zero has none.
fn signed(points: f64) -> String {
    let text = format!("{points:+.1}");
    if text.ends_with("0.0") && text.len() == 4 { "0.0".to_owned() } else { text }
}
