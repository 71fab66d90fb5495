//! A drawing: shapes are SVG at once, text stays text until it is known for whom.

use nav_picture::lettering::{Style, write_text};
use std::fmt::Write;

pub(super) use nav_picture::lettering::Anchor;

/// Of all text but grey notes.
pub(super) const INK: &str = "#1a1a1a";
/// Notes, axes.
pub(super) const FAINT: &str = "#5a5a5a";
/// Lines of a grid.
pub(super) const GRID: &str = "#e2e2e2";
/// Height of text, px.
pub(super) const TEXT_PX: f64 = 13.0;
/// Mean width of a letter over the height of text: a little more than any common font needs.
const LETTER_WIDTH: f64 = 0.56;
/// Height of a capital over the height of text.
const CAPITAL: f64 = 0.72;

/// How text is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Letters {
    /// As text, in the reader's font.
    Font,
    /// As strokes, for a PNG.
    Strokes,
}

/// A drawing of a size, px.
#[derive(Clone, Debug)]
pub(super) struct Canvas {
    width: f64,
    height: f64,
    marks: Vec<Mark>,
}

#[derive(Clone, Debug)]
enum Mark {
    Shape(String),
    Text(Text),
}

/// A line of text; its baseline begins, is centred, or ends at the point.
#[derive(Clone, Debug)]
pub(super) struct Text {
    pub(super) at: (f64, f64),
    pub(super) anchor: Anchor,
    pub(super) size: f64,
    pub(super) color: &'static str,
    pub(super) is_bold: bool,
    pub(super) is_upright: bool,
    pub(super) text: String,
}

impl Canvas {
    /// An empty drawing.
    pub(super) fn new(width: f64, height: f64) -> Self {
        Self { width, height, marks: Vec::new() }
    }

    /// Adds an element of SVG.
    pub(super) fn shape(&mut self, element: String) {
        self.marks.push(Mark::Shape(element));
    }

    /// A straight line.
    pub(super) fn line(&mut self, from: (f64, f64), to: (f64, f64), color: &str, width: f64) {
        let ((x1, y1), (x2, y2)) = (from, to);
        self.shape(format!(
            r#"<line x1="{x1:.1}" y1="{y1:.1}" x2="{x2:.1}" y2="{y2:.1}" stroke="{color}" stroke-width="{width}"/>"#
        ));
    }

    /// A line through points; `extra` holds further attributes.
    pub(super) fn path(&mut self, points: &[(f64, f64)], color: &str, width: f64, extra: &str) {
        if points.is_empty() {
            return;
        }
        let data = path_data(points);
        self.shape(format!(
            r#"<path d="{data}" fill="none" stroke="{color}" stroke-width="{width}" stroke-linejoin="round" {extra}/>"#
        ));
    }

    /// A filled band without an outline.
    pub(super) fn area(&mut self, points: &[(f64, f64)], color: &str, opacity: f64) {
        if points.is_empty() {
            return;
        }
        let data = path_data(points);
        self.shape(format!(r#"<path d="{data} Z" fill="{color}" fill-opacity="{opacity}"/>"#));
    }

    /// A line of text.
    pub(super) fn text(&mut self, text: &str, at: (f64, f64), anchor: Anchor) -> &mut Text {
        self.marks.push(Mark::Text(Text {
            at,
            anchor,
            size: TEXT_PX,
            color: INK,
            is_bold: false,
            is_upright: false,
            text: text.to_owned(),
        }));
        let Some(Mark::Text(text)) = self.marks.last_mut() else { unreachable!("it was just put there") };
        text
    }

    /// As an SVG document that is called `title`.
    pub(super) fn svg(&self, title: &str, letters: Letters) -> String {
        let (width, height) = (self.width.ceil(), self.height.ceil());
        let title = escaped(title);
        let mut svg = format!(
            r##"<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}" role="img" font-family="system-ui, 'DejaVu Sans', Helvetica, Arial, sans-serif">
<title>{title}</title>
<rect width="{width}" height="{height}" fill="#ffffff"/>
"##
        );
        for mark in &self.marks {
            match (mark, letters) {
                (Mark::Shape(shape), _) => svg.push_str(shape),
                (Mark::Text(text), Letters::Font) => text.as_text(&mut svg),
                (Mark::Text(text), Letters::Strokes) => text.as_strokes(&mut svg),
            }
            svg.push('\n');
        }
        svg.push_str("</svg>\n");
        svg
    }
}

impl Text {
    fn as_text(&self, svg: &mut String) {
        let (x, y) = self.at;
        let anchor = match self.anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        let weight = if self.is_bold { r#" font-weight="600""# } else { "" };
        let turn = if self.is_upright {
            format!(r#" transform="rotate(-90 {x:.1} {y:.1})""#)
        } else {
            String::new()
        };
        write!(
            svg,
            r#"<text x="{x:.1}" y="{y:.1}" text-anchor="{anchor}" font-size="{}" fill="{}"{weight}{turn}>{}</text>"#,
            self.size,
            self.color,
            escaped(&self.text)
        )
        .expect("a string takes everything");
    }

    fn as_strokes(&self, svg: &mut String) {
        let at = (self.at.0 as f32, self.at.1 as f32);
        let style = Style {
            height: (self.size * CAPITAL) as f32,
            width_max: f32::INFINITY,
            color: self.color,
            weight: if self.is_bold { 1.1 } else { 0.8 },
        };
        if self.is_upright {
            write!(svg, r#"<g transform="rotate(-90 {:.1} {:.1})">"#, at.0, at.1)
                .expect("a string takes everything");
        }
        write_text(svg, &self.text, at, self.anchor, &style);
        if self.is_upright {
            svg.push_str("</g>");
        }
    }
}

fn path_data(points: &[(f64, f64)]) -> String {
    let mut data = String::new();
    for (index, (x, y)) in points.iter().enumerate() {
        let command = if index == 0 { 'M' } else { 'L' };
        write!(data, "{command}{x:.1} {y:.1} ").expect("a string takes everything");
    }
    data.trim_end().to_owned()
}

/// Width that text of the usual height takes up at most, px.
pub(super) fn text_width(text: &str) -> f64 {
    text.chars().count() as f64 * LETTER_WIDTH * TEXT_PX
}

/// For the inside of an element or an attribute.
pub(crate) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
