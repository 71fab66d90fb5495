//! Evaluation rows: one flat row an episode, written and read as CSV.
//!
//! A row is appended and handed to the system as soon as its episode has ended, so that whatever ends the program
//! (a signal, a full disk) leaves a file of whole rows, but for a last line that was cut short: [`RowFile::resume`]
//! drops it.

use nav_core::metrics::EpisodeEnd;
use nav_core::task::ShieldMode;
use nav_sim::disturbance::DisturbanceName;
use nav_sim::families::{Family, Split};
use serde::{Deserialize, Serialize};
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use crate::other_lidar::OtherLidar;
use crate::robot::Driven;
use crate::worlds::Scene;

/// One episode. What a column is missing for is empty.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EpisodeRow {
    /// What the policy is called in tables.
    pub policy: String,
    /// The seed that the policy was trained with; of a learned one.
    pub training_seed: Option<u64>,
    /// The folder of the model or run, or the name of the rival.
    pub run: String,
    /// The family, of a generated world.
    pub family: Option<Family>,
    /// The file's name, of a world that was read.
    pub world_file: Option<String>,
    /// The split, of a generated world.
    pub split: Option<Split>,
    /// The world's seed within family and split; of a world that was read, that of the simulation.
    pub world_seed: u64,
    /// How the robot differed from a perfect one.
    pub disturbance: DisturbanceName,
    /// The lidar, where it was not the trained one.
    #[serde(default)]
    pub lidar: Option<OtherLidar>,
    /// The safety gate; absent where the row's writer does not know.
    #[serde(default)]
    pub shield: Option<ShieldMode>,
    /// How it ended.
    pub end: EpisodeEnd,
    /// See [`nav_core::metrics::EpisodeMetrics::hit_while_standing`].
    pub hit_while_standing: bool,
    /// Steps taken.
    pub steps: u32,
    /// Duration, s.
    pub time_s: f32,
    /// Driven, m.
    pub path_m: f32,
    /// Shortest way on the known map, m; missing where the map has none.
    pub geodesic_m: Option<f32>,
    /// Straight line from start to goal, m.
    pub euclidean_m: f32,
    /// Success weighted by path length; missing without a shortest way.
    pub spl: Option<f32>,
    /// Shortest way over path length; of successes.
    pub path_efficiency: Option<f32>,
    /// Straight line over path length; of successes.
    pub path_efficiency_euclidean: Option<f32>,
    /// See [`nav_core::metrics`], as for the columns below.
    pub smoothness: f32,
    /// Log-dimensionless jerk.
    pub log_jerk: Option<f32>,
    /// Smallest clearance, m.
    pub clearance_min_m: f32,
    /// Mean clearance, m.
    pub clearance_mean_m: f32,
    /// Smallest time to collision, s.
    pub time_to_collision_min_s: Option<f32>,
    /// For how long the robot had stood when the episode ended, s.
    pub stood_at_end_s: f32,
    /// Share of steps that were spin.
    pub spin: f32,
    /// Mean time of a tick, ns.
    pub tick_mean_ns: u64,
    /// Longest tick, ns.
    pub tick_max_ns: u64,
    /// Straight line from where the robot ended to the goal, m; as the columns below, missing in older tables.
    #[serde(default)]
    pub distance_left_m: Option<f32>,
    /// See [`crate::searched::Searched`], as for the columns below; missing of what does not plan on a grid.
    #[serde(default)]
    pub searches: Option<u32>,
    /// Nodes expanded in all of them.
    #[serde(default)]
    pub search_expanded: Option<u64>,
    /// Nodes that a search can expand.
    #[serde(default)]
    pub search_cells: Option<u64>,
    /// Memory of map and search at the most, bytes.
    #[serde(default)]
    pub search_bytes: Option<u64>,
}

/// Who drove where: the columns that are known before an episode.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Labels<'a> {
    /// See [`EpisodeRow::policy`].
    pub policy: &'a str,
    /// See [`EpisodeRow::training_seed`].
    pub training_seed: Option<u64>,
    /// See [`EpisodeRow::run`].
    pub run: &'a str,
    /// The scene.
    pub scene: &'a Scene,
    /// See [`EpisodeRow::world_seed`].
    pub world_seed: u64,
    /// See [`EpisodeRow::disturbance`].
    pub disturbance: DisturbanceName,
    /// See [`EpisodeRow::lidar`].
    pub lidar: Option<OtherLidar>,
    /// See [`EpisodeRow::shield`].
    pub shield: Option<ShieldMode>,
}

impl EpisodeRow {
    /// The row of an episode.
    pub fn new(labels: &Labels<'_>, driven: &Driven) -> Self {
        let (family, split, world_file) = match labels.scene {
            Scene::Family(family, split) => (Some(*family), Some(*split), None),
            Scene::File(name) => (None, None, Some(name.to_string())),
        };
        let m = &driven.metrics;
        Self {
            policy: labels.policy.to_owned(),
            training_seed: labels.training_seed,
            run: labels.run.to_owned(),
            family,
            world_file,
            split,
            world_seed: labels.world_seed,
            disturbance: labels.disturbance,
            lidar: labels.lidar,
            shield: labels.shield,
            end: m.end,
            hit_while_standing: m.hit_while_standing,
            steps: m.steps,
            time_s: m.time_s,
            path_m: m.path_m,
            geodesic_m: m.geodesic_m,
            euclidean_m: m.euclidean_m,
            spl: m.spl,
            path_efficiency: m.path_efficiency,
            path_efficiency_euclidean: m.path_efficiency_euclidean,
            smoothness: m.smoothness,
            log_jerk: m.log_jerk,
            clearance_min_m: m.clearance_min_m,
            clearance_mean_m: m.clearance_mean_m,
            time_to_collision_min_s: m.time_to_collision_min_s,
            stood_at_end_s: m.stood_at_end_s,
            spin: m.spin,
            tick_mean_ns: driven.tick_mean_ns,
            tick_max_ns: driven.tick_max_ns,
            distance_left_m: Some(m.distance_left_m),
            searches: driven.searched.map(|searched| searched.searches),
            search_expanded: driven.searched.map(|searched| searched.expanded),
            search_cells: driven.searched.map(|searched| searched.cells),
            search_bytes: driven.searched.map(|searched| searched.bytes),
        }
    }

    /// Whether the row is of an episode with these labels.
    pub fn is_of(&self, labels: &Labels<'_>) -> bool {
        let is_of_scene = match labels.scene {
            Scene::Family(family, split) => self.family == Some(*family) && self.split == Some(*split),
            Scene::File(name) => self.world_file.as_deref() == Some(&**name),
        };
        is_of_scene
            && self.policy == labels.policy
            && self.training_seed == labels.training_seed
            && self.run == labels.run
            && self.world_seed == labels.world_seed
            && (self.disturbance, self.lidar, self.shield)
                == (labels.disturbance, labels.lidar, labels.shield)
    }
}

/// Why rows were not read or written.
#[derive(Debug, thiserror::Error)]
pub enum RowsError {
    /// Somebody else writes it.
    #[error("another process is writing {}: wait for it, stop it, or write elsewhere", path.display())]
    Busy {
        /// The file.
        path: PathBuf,
    },
    /// The file system refused.
    #[error("cannot {action} {}", path.display())]
    File {
        /// What was tried.
        action: &'static str,
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// A line is no row of this version.
    #[error("{} is no table of episodes of this version: {problem}", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// What is wrong, and in which line.
        problem: String,
    },
}

/// Reads all rows of a file.
///
/// # Errors
/// A file that cannot be read, or a line that is no row.
pub fn read_rows(path: &Path) -> Result<Vec<EpisodeRow>, RowsError> {
    let text = std::fs::read(path).map_err(file_error("read", path))?;
    parse(path, &text)
}

fn parse(path: &Path, text: &[u8]) -> Result<Vec<EpisodeRow>, RowsError> {
    let rows: Result<Vec<EpisodeRow>, csv::Error> = csv::Reader::from_reader(text).deserialize().collect();
    rows.map_err(|error| RowsError::Format { path: path.to_owned(), problem: error.to_string() })
}

/// A row as a line of a file, after its header or not.
fn written(path: &Path, row: &EpisodeRow, with_header: bool) -> Result<Vec<u8>, RowsError> {
    let mut writer = csv::WriterBuilder::new().has_headers(with_header).from_writer(Vec::new());
    let line = writer
        .serialize(row)
        .map_err(|error| error.to_string())
        .and_then(|()| writer.into_inner().map_err(|error| error.to_string()));
    line.map_err(|problem| RowsError::Format { path: path.to_owned(), problem })
}

fn file_error(action: &'static str, path: &Path) -> impl FnOnce(io::Error) -> RowsError {
    let path = path.to_owned();
    move |source| RowsError::File { action, path, source }
}

/// Opens a file for reading and writing and locks it.
fn open(path: &Path) -> Result<File, RowsError> {
    let mut options = OpenOptions::new();
    let file = options.read(true).write(true).create(true).truncate(false).open(path);
    let file = file.map_err(file_error("write", path))?;
    match file.try_lock() {
        Ok(()) => Ok(file),
        Err(TryLockError::WouldBlock) => Err(RowsError::Busy { path: path.to_owned() }),
        Err(TryLockError::Error(error)) => Err(file_error("lock", path)(error)),
    }
}

/// A file of rows under way; no other process writes it as long as this lives.
#[derive(Debug)]
pub struct RowFile {
    path: PathBuf,
    file: File,
    /// Length of what is whole, bytes.
    length: u64,
}

impl RowFile {
    /// An empty file, in place of one that may be there.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn create(path: &Path) -> Result<Self, RowsError> {
        let mut created = Self { path: path.to_owned(), file: open(path)?, length: 0 };
        created.cut().map_err(file_error("write", path))?;
        Ok(created)
    }

    /// A file to go on with, and the rows that it holds; a last line that was cut short is dropped. Without a file,
    /// a new one.
    ///
    /// # Errors
    /// A file that cannot be read or written, or that holds something else: also rows of fewer columns than this version's.
    pub fn resume(path: &Path) -> Result<(Self, Vec<EpisodeRow>), RowsError> {
        let mut file = open(path)?;
        let mut text = Vec::new();
        file.read_to_end(&mut text).map_err(file_error("read", path))?;
        let whole = text.iter().rposition(|&byte| byte == b'\n').map_or(0, |end| end + 1);
        let rows = parse(path, &text[..whole])?;
        if let Some(row) = rows.first() {
            let columns = |text: &[u8]| text.split(|&byte| byte == b'\n').next().map(<[u8]>::to_vec);
            if columns(&text) != columns(&written(path, row, true)?) {
                let problem =
                    "it can be read, but has fewer columns than a row that is added: write elsewhere";
                return Err(RowsError::Format { path: path.to_owned(), problem: problem.to_owned() });
            }
        }
        // A header without rows is written again with the first.
        let length = if rows.is_empty() { 0 } else { whole as u64 };
        let mut resumed = Self { path: path.to_owned(), file, length };
        resumed.cut().map_err(file_error("write", path))?;
        Ok((resumed, rows))
    }

    /// Appends a row; the first brings the header.
    ///
    /// # Errors
    /// A file that cannot be written; the rows before stay whole.
    pub fn append(&mut self, row: &EpisodeRow) -> Result<(), RowsError> {
        let line = written(&self.path, row, self.length == 0)?;
        if let Err(source) = self.file.write_all(&line) {
            // Half a row helps nobody. If even that fails, whoever resumes drops it.
            let _ = self.cut();
            return Err(file_error("write", &self.path)(source));
        }
        self.length += line.len() as u64;
        Ok(())
    }

    fn cut(&mut self) -> io::Result<()> {
        self.file.set_len(self.length)?;
        self.file.seek(SeekFrom::Start(self.length)).map(|_| ())
    }
}
