//! How a method is told from the others: colour, mark and dash, and the legend that says so.

use super::canvas::{Anchor, Canvas, text_width};
use crate::plan::Study;

/// Okabe and Ito (2008), without yellow, which is not seen on white.
const COLORS: [&str; 7] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000"];
const DASHES: [&str; 3] = ["", "7 3", "2 3"];
/// Height of a line of the legend, px.
const LINE_PX: f64 = 20.0;

/// The look of a method.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Look {
    /// Of marks and lines.
    pub(super) color: &'static str,
    mark: usize,
    dash: usize,
}

impl Look {
    /// Of the method with an index: colours first, then, from the eighth on, other dashes too.
    pub(super) fn of(method: usize) -> Self {
        let (round, color) = (method / COLORS.len(), method % COLORS.len());
        Self { color: COLORS[color], mark: (color + round) % 5, dash: round % DASHES.len() }
    }

    /// The attribute of a line.
    pub(super) fn dash(self) -> String {
        let dash = DASHES[self.dash];
        if dash.is_empty() { String::new() } else { format!(r#"stroke-dasharray="{dash}""#) }
    }

    /// A mark at a point.
    pub(super) fn mark(self, canvas: &mut Canvas, (x, y): (f64, f64), r: f64) {
        let Self { color, .. } = self;
        let outline = r##"stroke="#ffffff" stroke-width="0.8""##;
        canvas.shape(match self.mark {
            0 => format!(r#"<circle cx="{x:.1}" cy="{y:.1}" r="{r}" fill="{color}" {outline}/>"#),
            1 => polygon(&[(x - r, y - r), (x + r, y - r), (x + r, y + r), (x - r, y + r)], color, outline),
            2 => polygon(
                &[(x, y - 1.3 * r), (x + 1.2 * r, y + 0.9 * r), (x - 1.2 * r, y + 0.9 * r)],
                color,
                outline,
            ),
            3 => polygon(
                &[(x, y - 1.4 * r), (x + 1.4 * r, y), (x, y + 1.4 * r), (x - 1.4 * r, y)],
                color,
                outline,
            ),
            _ => polygon(
                &[(x, y + 1.3 * r), (x + 1.2 * r, y - 0.9 * r), (x - 1.2 * r, y - 0.9 * r)],
                color,
                outline,
            ),
        });
    }
}

fn polygon(points: &[(f64, f64)], color: &str, outline: &str) -> String {
    let points: Vec<String> = points.iter().map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
    format!(r#"<polygon points="{}" fill="{color}" {outline}/>"#, points.join(" "))
}

/// Where the methods stand in a legend that is `width` px wide: left edge and line of each.
fn places(study: &Study, methods: &[usize], width: f64) -> Vec<(f64, usize)> {
    let (mut x, mut line) = (0.0, 0);
    let mut places = Vec::new();
    for &method in methods {
        let own = 46.0 + text_width(&study.methods[method].label);
        if x > 0.0 && x + own > width {
            (x, line) = (0.0, line + 1);
        }
        places.push((x, line));
        x += own;
    }
    places
}

/// Height of a legend, px.
pub(super) fn legend_height(study: &Study, methods: &[usize], width: f64) -> f64 {
    let lines = places(study, methods, width).last().map_or(0, |(_, line)| line + 1);
    lines as f64 * LINE_PX
}

/// Draws the legend of these methods below `top`.
pub(super) fn legend(
    canvas: &mut Canvas,
    study: &Study,
    methods: &[usize],
    (left, top): (f64, f64),
    width: f64,
) {
    for (&method, (x, line)) in methods.iter().zip(places(study, methods, width)) {
        let (x, y) = (left + x, top + (line as f64 + 0.5) * LINE_PX);
        let look = Look::of(method);
        canvas.path(&[(x, y), (x + 24.0, y)], look.color, 2.0, &look.dash());
        look.mark(canvas, (x + 12.0, y), 4.0);
        canvas.text(&study.methods[method].label, (x + 30.0, y + 4.5), Anchor::Start);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_of_twenty_methods_look_alike() {
        let looks: Vec<Look> = (0..20).map(Look::of).collect();
        for (index, look) in looks.iter().enumerate() {
            assert!(!looks[..index].contains(look), "{index}");
        }
    }
}
