//! The tables that a study is judged by, as they lie on disk: plain CSV (`.csv`) or compressed (`.csv.gz`), anywhere below the
//! folders that are named. What a table is, its columns say:
//!
//! | table | columns | written by |
//! |---|---|---|
//! | evaluation rows | `policy`, `world_seed`, `end` and the others of [`EpisodeRow`] | `trainer evaluate` (`episodes.csv`) |
//! | learning curves | `step`, `hybrid`, `FAMILY/success` and so on, in a file `METHOD/seed-N/curve.csv` | `trainer train` |
//! | scalars of training | `step`, `low/return`, `high/return`; read beside a learning curve | `trainer train` (`scalars.csv`) |
//! | runs | `method`, `training_seed`, `outcome` and the others of [`RunRow`] | `cargo xtask study` |
//!
//! Further columns do no harm. Other tables are named in the report and not read.
//!
//! | file | holds |
//! |---|---|
//! | [`curve`] | learning curves as the trainer writes them |
//! | [`keep`] | tables as results keep them |

pub mod curve;
pub mod keep;

pub use curve::CurveRow;

use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::{Path, PathBuf};

/// The safety gate between policy and base.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Gate {
    /// Commands reach the base as they are.
    Off,
    /// Commands pass the gate.
    On,
}

impl Gate {
    /// As on command lines and in rows.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Off => "off",
            Self::On => "on",
        }
    }
}

/// How an episode ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum End {
    /// The goal was reached.
    Success,
    /// The robot hit something, or was hit.
    Collision,
    /// Time ran out.
    Timeout,
    /// Time ran out while the robot stood where it wrongly believed the goal to be.
    BelievedArrived,
    /// Nothing drove: the training run left no policy.
    NoPolicy,
}

/// One episode: the columns of `trainer evaluate` that are judged.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct EpisodeRow {
    /// The method's name.
    pub policy: String,
    /// Of a learned one.
    pub training_seed: Option<u64>,
    /// Missing in a world that was read from a file.
    pub family: Option<String>,
    /// Missing in a world that was read from a file.
    pub split: Option<String>,
    /// Of the world, within family and split.
    pub world_seed: u64,
    /// How the robot differed from a perfect one.
    pub disturbance: String,
    /// The lidar, where it was not the trained one.
    #[serde(default)]
    pub lidar: Option<String>,
    /// The safety gate; missing where the writer did not know.
    #[serde(default)]
    pub shield: Option<Gate>,
    /// How it ended.
    pub end: End,
    /// Whether the robot stood when it was hit.
    pub hit_while_standing: bool,
    /// Duration, s.
    pub time_s: f64,
    /// Success weighted by path length; missing without a shortest way.
    pub spl: Option<f64>,
    /// Shortest way over path length; of successes.
    pub path_efficiency: Option<f64>,
    /// The paper's smoothness, 0 to 1.
    pub smoothness: f64,
    /// Smallest clearance, m.
    pub clearance_min_m: f64,
    /// Share of steps that were spin.
    pub spin: f64,
    /// Steps taken.
    #[serde(default)]
    pub steps: Option<u32>,
    /// Driven, m.
    #[serde(default)]
    pub path_m: Option<f64>,
    /// Shortest way on the known map, m.
    #[serde(default)]
    pub geodesic_m: Option<f64>,
    /// Mean clearance, m.
    #[serde(default)]
    pub clearance_mean_m: Option<f64>,
    /// Straight line from where the robot ended to the goal, m; missing in older rows, as what follows.
    #[serde(default)]
    pub distance_left_m: Option<f64>,
    /// Searches of a planner.
    #[serde(default)]
    pub searches: Option<u32>,
    /// Nodes that they expanded, all together.
    #[serde(default)]
    pub search_expanded: Option<f64>,
    /// Nodes that a search can expand.
    #[serde(default)]
    pub search_cells: Option<f64>,
    /// Memory of map and search, bytes.
    #[serde(default)]
    pub search_bytes: Option<f64>,
}

/// How a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// It passed the trainer's gate.
    Passed,
    /// It missed the trainer's gate; what was trained is kept.
    Missed,
    /// It ended without a policy, or was stopped as collapsed.
    Failed,
}

impl Outcome {
    /// In a word.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Passed => "passed",
            Self::Missed => "missed its gate",
            Self::Failed => "failed",
        }
    }
}

/// What a training run took and came to.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
pub struct RunRow {
    /// The method's name.
    pub method: String,
    /// Its seed.
    pub training_seed: u64,
    /// How it ended.
    pub outcome: Outcome,
    /// Wall time of training, s.
    #[serde(default)]
    pub train_s: Option<f64>,
    /// Environment steps, all stages together.
    #[serde(default)]
    pub env_steps: Option<u64>,
    /// Updates, all stages together.
    #[serde(default)]
    pub updates: Option<u64>,
    /// The trainer's commit.
    #[serde(default)]
    pub commit: Option<String>,
    /// Where it ran.
    #[serde(default)]
    pub machine: Option<String>,
    /// The command.
    #[serde(default)]
    pub command: Option<String>,
    /// What else is to be told, as why it failed.
    #[serde(default)]
    pub note: Option<String>,
}

/// Everything found below some folders.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tables {
    /// Evaluation rows, each with the index of its file in `files`.
    pub episodes: Vec<(usize, EpisodeRow)>,
    /// Learning curves.
    pub curves: Vec<CurveRow>,
    /// Runs.
    pub runs: Vec<RunRow>,
    /// Files of the above, with their counts of rows.
    pub files: Vec<(PathBuf, usize)>,
    /// Tables of other columns.
    pub unread: Vec<PathBuf>,
}

/// Why tables were not read.
#[derive(Debug, thiserror::Error)]
pub enum TablesError {
    /// The file system refused, or a compressed file is damaged.
    #[error("cannot read {}: {source}", path.display())]
    File {
        /// File or folder.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// A line does not fit its header.
    #[error("{}: {problem}; if it was cut short, go on with its evaluation (--resume), else remove it", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// What is wrong, and where.
        problem: String,
    },
    /// Nothing to judge.
    #[error("there are no evaluation rows below {}: name a folder with the episodes.csv of `trainer evaluate`", .0.display())]
    Empty(PathBuf),
}

/// Reads every table below `folders`, in the order of their names.
///
/// # Errors
/// A folder or file that cannot be read, a line that does not fit its header, or a folder without evaluation rows.
pub fn read(folders: &[PathBuf]) -> Result<Tables, TablesError> {
    let mut tables = Tables::default();
    for folder in folders {
        let before = tables.episodes.len();
        for path in tables_below(folder)? {
            tables.add(&path)?;
        }
        if tables.episodes.len() == before {
            return Err(TablesError::Empty(folder.clone()));
        }
    }
    Ok(tables)
}

impl Tables {
    fn add(&mut self, path: &Path) -> Result<(), TablesError> {
        let format =
            |error: csv::Error| TablesError::Format { path: path.to_owned(), problem: error.to_string() };
        let mut reader = csv::Reader::from_reader(open(path)?);
        let columns = reader.headers().map_err(format)?.clone();
        let has = |names: &[&str]| names.iter().all(|name| columns.iter().any(|column| column == *name));
        let count = if has(&["policy", "world_seed", "end"]) {
            let file = self.files.len();
            let rows: Result<Vec<EpisodeRow>, _> = reader.deserialize().collect();
            let rows = rows.map_err(format)?;
            let count = rows.len();
            self.episodes.extend(rows.into_iter().map(|row| (file, row)));
            count
        } else if has(&curve::COLUMNS)
            && let Some(run) = curve::Run::of(path)
        {
            append(&mut self.curves, curve::read(&run, reader, &columns)?)
        } else if has(&["step"]) {
            // Of a run, read with its curve.
            return Ok(());
        } else if has(&["method", "training_seed", "outcome"]) {
            let rows: Result<Vec<RunRow>, _> = reader.deserialize().collect();
            append(&mut self.runs, rows.map_err(format)?)
        } else {
            self.unread.push(path.to_owned());
            return Ok(());
        };
        self.files.push((path.to_owned(), count));
        Ok(())
    }
}

/// A table, plain or compressed.
type Table = Box<dyn Read>;

fn append<T>(to: &mut Vec<T>, mut rows: Vec<T>) -> usize {
    let count = rows.len();
    to.append(&mut rows);
    count
}

fn open(path: &Path) -> Result<Table, TablesError> {
    let file = File::open(path).map_err(|source| TablesError::File { path: path.to_owned(), source })?;
    let buffered = BufReader::new(file);
    let is_compressed = path.extension().is_some_and(|extension| extension == "gz");
    Ok(if is_compressed { Box::new(flate2::read::MultiGzDecoder::new(buffered)) } else { Box::new(buffered) })
}

/// The tables in a folder and in those within it, by name.
fn tables_below(folder: &Path) -> Result<Vec<PathBuf>, TablesError> {
    let failed = |source| TablesError::File { path: folder.to_owned(), source };
    let entries: io::Result<Vec<_>> = std::fs::read_dir(folder).map_err(failed)?.collect();
    let mut paths: Vec<PathBuf> = entries.map_err(failed)?.iter().map(std::fs::DirEntry::path).collect();
    paths.sort();
    let mut found = Vec::new();
    for path in paths {
        if path.is_dir() {
            found.append(&mut tables_below(&path)?);
        } else if path.to_str().is_some_and(|name| name.ends_with(".csv") || name.ends_with(".csv.gz")) {
            found.push(path);
        }
    }
    Ok(found)
}
