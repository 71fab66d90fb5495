//! Judges a study: a description, evaluation rows and learning curves in, statistics, figures and a report out. No torch, no
//! simulator: whoever has rows can judge them.
//!
//! Reading order:
//!
//! | module | holds |
//! |---|---|
//! | [`description`], [`plan`] | the study as it is typed (`study/paper.toml`), and as it is checked |
//! | [`jobs`] | what must be trained and evaluated before: command lines for whoever starts them |
//! | [`rows`], [`cells`] | the tables on disk, sorted by method, gate, family, seed and world |
//! | [`provenance`] | which commit and which machine |
//! | [`stats`] | the statistics, one file each |
//! | [`analysis`] | every number of the report |
//! | [`figures`] | the figures |
//! | [`report`] | the page, the tables and the files |
//!
//! Without the feature `report`, which draws, there are no `figures` and no `report`: what starts a study needs neither.
//!
//! ```no_run
//! use study::{plan::Study, report, rows};
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let study = Study::read("study/paper.toml".as_ref())?;
//! let tables = rows::read(&["results/study".into()])?;
//! let written = report::write(&study, &tables, &[], &report::Provenance::here(), "out/study".as_ref())?;
//! println!("{}", written.page.display());
//! # Ok(())
//! # }
//! ```

pub mod description;
pub mod plan;
pub mod jobs;
pub mod rows;
pub mod provenance;
pub mod cells;
pub mod stats;
pub mod analysis;
#[cfg(feature = "report")]
pub mod figures;
#[cfg(feature = "report")]
pub mod report;
