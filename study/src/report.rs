//! The report: one page that works offline, the figures as SVG and PNG, the tables as CSV.
//!
//! | file | holds |
//! |---|---|
//! | `index.html` | everything, figures inside; no script, nothing from elsewhere |
//! | `figures/NAME.svg`, `.png` | each figure |
//! | `headline.csv`, `methods.csv`, … | each table of the page |
//! | `scores.csv` | each seed's success and collision on each family, with each gate |

mod grid;
mod page;
mod tables;
mod pathbench;
mod scores;
mod summary;
pub mod gallery;

pub use crate::provenance::Provenance;

use std::io;
use std::path::{Path, PathBuf};

use crate::analysis::Analysis;
use crate::cells::{Cells, TwiceError};
use crate::figures::{Figure, Letters, figures};
use crate::plan::Study;
use crate::rows::Tables;
use gallery::Picture;
use grid::Grid;
use nav_picture::file::{DrawError, write_picture};

/// What was written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Written {
    /// The page.
    pub page: PathBuf,
    /// Every file, the page among them.
    pub files: Vec<PathBuf>,
    /// What the study names and nobody drove; empty of a whole study.
    pub gaps: usize,
}

/// Why there is no report.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// An episode is there twice.
    #[error(transparent)]
    Twice(#[from] TwiceError),
    /// No row is of a method, family and gate of the study.
    #[error("no row is of this study: {0}")]
    Nothing(String),
    /// A figure was not written.
    #[error(transparent)]
    Picture(#[from] DrawError),
    /// A file was not written.
    #[error("cannot write {}: {source}", path.display())]
    File {
        /// File or folder.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
}

/// Judges `tables` by `study` and writes the report, with a gallery of `pictures`, into the folder `out`.
///
/// # Errors
/// Rows that contradict each other, none at all, or files that cannot be written.
pub fn write(
    study: &Study,
    tables: &Tables,
    pictures: &[Picture],
    provenance: &Provenance,
    out: &Path,
) -> Result<Written, ReportError> {
    let cells = Cells::sort(study, &tables.episodes, &tables.files)?;
    let analysis = Analysis::of(study, &cells, tables);
    if analysis.success.is_empty() {
        let reasons = cells.left_out.iter().map(|(reason, count)| format!("{count} of {reason}"));
        return Err(ReportError::Nothing(reasons.collect::<Vec<_>>().join("; ")));
    }
    let figures = figures(study, &analysis);
    let mut writer = Writer { out, files: Vec::new() };
    for figure in &figures {
        writer.figure(figure)?;
    }
    let content = page::Content {
        study,
        tables,
        cells: &cells,
        analysis: &analysis,
        figures: &figures,
        pictures,
        provenance,
    };
    let grids = content.grids();
    for grid in &grids {
        writer.grid(grid)?;
    }
    writer.grid(&scores::grid(study, &analysis))?;
    writer.text("index.html", &content.html(&grids))?;
    Ok(Written { page: out.join("index.html"), files: writer.files, gaps: cells.gaps.len() })
}

struct Writer<'a> {
    out: &'a Path,
    files: Vec<PathBuf>,
}

impl Writer<'_> {
    fn figure(&mut self, figure: &Figure) -> Result<(), ReportError> {
        let folder = self.out.join("figures");
        std::fs::create_dir_all(&folder)
            .map_err(|source| ReportError::File { path: folder.clone(), source })?;
        for (extension, letters) in [("svg", Letters::Font), ("png", Letters::Strokes)] {
            let path = folder.join(figure.name).with_extension(extension);
            write_picture(&path, &figure.svg(letters))?;
            self.files.push(path);
        }
        Ok(())
    }

    fn grid(&mut self, grid: &Grid) -> Result<(), ReportError> {
        let name = format!("{}.csv", grid.name);
        let text = grid.csv().map_err(|source| ReportError::File { path: self.out.join(&name), source })?;
        self.text(&name, &text)
    }

    fn text(&mut self, name: &str, text: &str) -> Result<(), ReportError> {
        let path = self.out.join(name);
        nav_host::files::check_writable(&path)
            .and_then(|()| nav_host::files::replace(&path, text))
            .map_err(|source| ReportError::File { path: path.clone(), source })?;
        self.files.push(path);
        Ok(())
    }
}
