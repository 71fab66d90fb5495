//! The figures: SVG with text for the page and as a file, PNG with letters as strokes, so that neither needs a font of its own.
//!
//! Methods differ in colour *and* in mark or dash, and the colours are Okabe and Ito's, which people with any colour vision tell
//! apart.

mod canvas;
mod axis;
mod look;
mod by_family;
mod differences;
mod learning;
mod profiles;
mod returns;

use crate::analysis::Analysis;
use crate::plan::Study;
use canvas::Canvas;

pub use canvas::Letters;
pub(crate) use canvas::escaped;

/// A figure.
#[derive(Clone, Debug)]
pub struct Figure {
    /// Name of its files and of its place in the page.
    pub name: &'static str,
    /// Headline.
    pub title: &'static str,
    /// What is seen, in a sentence or two.
    pub caption: String,
    canvas: Canvas,
}

impl Figure {
    /// As an SVG document.
    pub fn svg(&self, letters: Letters) -> String {
        self.canvas.svg(self.title, letters)
    }
}

/// Every figure that there are numbers for, in the order of the report.
pub fn figures(study: &Study, analysis: &Analysis) -> Vec<Figure> {
    let figures = [
        differences::primaries(study, analysis),
        by_family::success(study, analysis),
        by_family::collision(study, analysis),
        differences::non_inferiority(study, analysis),
        profiles::profiles(study, analysis),
        learning::success(study, analysis),
        learning::collision(study, analysis),
        returns::returns(study, analysis),
    ];
    figures.into_iter().flatten().collect()
}
