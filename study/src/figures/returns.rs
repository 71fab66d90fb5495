//! Return against success over training: where the one rises while the other falls, the reward pays for something else.

use super::axis::Axis;
use super::canvas::{Anchor, FAINT};
use super::learning::panels;
use super::look::Look;
use super::{Analysis, Figure};
use crate::analysis::curves::MethodCurves;
use crate::plan::Study;
use crate::rows::CurveRow;

/// The figure; none where no curve has a return.
pub(super) fn returns(study: &Study, analysis: &Analysis) -> Option<Figure> {
    let has_return = |curves: &&MethodCurves| points(curves).next().is_some();
    let curves: Vec<&MethodCurves> = analysis.curves.iter().filter(has_return).collect();
    let canvas = panels(study, &curves, |canvas, curves, [left, top, right, bottom]| {
        let reach = |(low, high): (f64, f64), (_, value): (&CurveRow, f64)| (low.min(value), high.max(value));
        let x = Axis::new(points(curves).fold((f64::INFINITY, f64::NEG_INFINITY), reach), (left, right));
        let y = Axis::new((0.0, 100.0), (bottom, top));
        x.draw_below(canvas, (top, bottom), 3);
        y.draw_left(canvas, (left, right), 4);
        canvas.text("return", (right, bottom + 34.0), Anchor::End).color = FAINT;
        if let Some(follows) = curves.return_follows_success {
            let text = format!("rank correlation {follows:+.2}");
            canvas.text(&text, (left, bottom + 34.0), Anchor::Start).color = FAINT;
        }
        let color = Look::of(curves.method).color;
        for seed in &curves.seeds {
            let paid: Vec<(&CurveRow, f64)> =
                seed.points.iter().filter_map(|point| Some((point, point.episode_return?))).collect();
            let at = |(point, paid): &(&CurveRow, f64)| (x.at(*paid), y.at(100.0 * point.success));
            let line: Vec<_> = paid.iter().map(at).collect();
            canvas.path(&line, color, 1.0, r#"stroke-opacity="0.25""#);
            let last = paid.last().map_or(1, |(point, _)| point.env_steps.max(1));
            for entry in &paid {
                let ((x, y), share) = (at(entry), entry.0.env_steps as f64 / last as f64);
                let opacity = 0.15 + 0.85 * share;
                canvas.shape(format!(
                    r#"<circle cx="{x:.1}" cy="{y:.1}" r="3" fill="{color}" fill-opacity="{opacity:.2}"/>"#
                ));
            }
        }
    })?;
    Some(Figure {
        name: "return-against-success",
        title: "Return against success over training",
        caption: "A point is a look at a seed under way, darker the later: success on validation worlds, %, over the mean return of \
                  an episode in the method's own reward. A reward that pays for what is wanted gives points that rise to the right; \
                  one whose return rises while success falls is misaligned."
            .to_owned(),
        canvas,
    })
}

fn points(curves: &MethodCurves) -> impl Iterator<Item = (&CurveRow, f64)> {
    let looks = curves.seeds.iter().flat_map(|seed| &seed.points);
    looks.filter_map(|point| Some((point, point.episode_return?)))
}
