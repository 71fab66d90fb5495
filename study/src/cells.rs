//! Rows sorted into cells: a method with a gate on a family, a row a seed, a column a world. Nothing is dropped silently:
//! what is left out and what is missing are told.

use std::collections::BTreeMap;
use std::path::PathBuf;

use crate::analysis::pathbench::Figures;
use crate::description::Metric;
use crate::plan::Study;
use crate::rows::{End, EpisodeRow, Gate};
use crate::stats::bootstrap::Table;

/// A method's runs on a family: by training seed (none of a classical method), then by world.
pub type Runs = BTreeMap<Option<u64>, BTreeMap<u64, Episode>>;

/// What is judged of an episode.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Episode {
    /// How it ended.
    pub end: End,
    /// Whether the robot stood when it was hit.
    pub hit_while_standing: bool,
    /// Duration, s.
    pub time_s: f64,
    /// Success weighted by path length.
    pub spl: Option<f64>,
    /// Shortest way over path length; of successes.
    pub path_efficiency: Option<f64>,
    /// The paper's smoothness.
    pub smoothness: f64,
    /// Smallest clearance, m.
    pub clearance_min_m: f64,
    /// Share of steps that were spin.
    pub spin: f64,
    /// What PathBench would say.
    pub pathbench: Figures,
    /// Index of the file that it is from.
    file: usize,
}

/// All cells of a study.
#[derive(Clone, Debug, Default)]
pub struct Cells {
    cells: BTreeMap<(usize, Gate, String), Runs>,
    /// Rows that are not of this study, by reason.
    pub left_out: BTreeMap<String, usize>,
    /// What the study names and nobody drove.
    pub gaps: Vec<Gap>,
}

/// What is missing of a cell.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Gap {
    /// Index of the method.
    pub method: usize,
    /// With which gate.
    pub gate: Gate,
    /// Where.
    pub family: String,
    /// What.
    pub what: String,
}

/// An episode that is there twice: which of the two counts cannot be known.
#[derive(Debug, thiserror::Error)]
#[error("{policy} drove world {world} of {family} twice, in {first} and {second}: keep one of the files")]
pub struct TwiceError {
    policy: String,
    family: String,
    world: u64,
    first: String,
    second: String,
}

impl Cells {
    /// Sorts rows, each with the index of its file in `files`.
    ///
    /// # Errors
    /// An episode that is there twice.
    pub fn sort(
        study: &Study,
        rows: &[(usize, EpisodeRow)],
        files: &[(PathBuf, usize)],
    ) -> Result<Self, TwiceError> {
        let mut sorted = Self::default();
        for (file, row) in rows {
            let (method, gate, family) = match place(study, row) {
                Ok(place) => place,
                Err(reason) => {
                    *sorted.left_out.entry(reason).or_default() += 1;
                    continue;
                }
            };
            let runs = sorted.cells.entry((method, gate, family.to_owned())).or_default();
            let worlds = runs.entry(row.training_seed).or_default();
            if let Some(first) = worlds.insert(row.world_seed, episode(row, *file)) {
                let name = |file: usize| files[file].0.display().to_string();
                return Err(TwiceError {
                    policy: row.policy.clone(),
                    family: family.to_owned(),
                    world: row.world_seed,
                    first: name(first.file),
                    second: name(*file),
                });
            }
        }
        sorted.gaps = gaps(study, &sorted);
        Ok(sorted)
    }

    /// The runs of a cell, if there are any.
    pub fn runs(&self, method: usize, gate: Gate, family: &str) -> Option<&Runs> {
        self.cells.get(&(method, gate, family.to_owned()))
    }

    /// Whether all that the study names of a cell is there.
    pub fn is_whole(&self, method: usize, gate: Gate, family: &str) -> bool {
        !self.gaps.iter().any(|gap| (gap.method, gap.gate, gap.family.as_str()) == (method, gate, family))
    }
}

fn episode(row: &EpisodeRow, file: usize) -> Episode {
    Episode {
        end: row.end,
        hit_while_standing: row.hit_while_standing,
        time_s: row.time_s,
        spl: row.spl,
        path_efficiency: row.path_efficiency,
        smoothness: row.smoothness,
        clearance_min_m: row.clearance_min_m,
        spin: row.spin,
        pathbench: Figures::of(row),
        file,
    }
}

/// Where a row belongs, or why it does not.
fn place<'a>(study: &Study, row: &'a EpisodeRow) -> Result<(usize, Gate, &'a str), String> {
    let method = study.method(&row.policy).ok_or_else(|| format!("policy {}, no method here", row.policy))?;
    let Some(family) = row.family.as_deref() else { return Err("worlds read from files".to_owned()) };
    if !study.families.iter().any(|known| known == family) {
        return Err(format!("family {family}, not in the study"));
    }
    let split = row.split.as_deref().unwrap_or("none");
    if split != study.split {
        return Err(format!("split {split}, not {}", study.split));
    }
    if row.disturbance != study.disturbance {
        return Err(format!("disturbance {}, not {}", row.disturbance, study.disturbance));
    }
    if let Some(lidar) = &row.lidar {
        return Err(format!("another lidar ({lidar})"));
    }
    let gate = row.shield.ok_or_else(|| "safety gate not known".to_owned())?;
    if !study.gates.contains(&gate) {
        return Err(format!("safety gate {}, not in the study", gate.word()));
    }
    if row.world_seed >= study.worlds {
        return Err(format!("worlds from {} on", study.worlds));
    }
    if !study.methods[method].row_seeds().contains(&row.training_seed) {
        let seed = row.training_seed.map_or("none".to_owned(), |seed| seed.to_string());
        return Err(format!("training seed {seed} of {}, not in the study", row.policy));
    }
    Ok((method, gate, family))
}

fn gaps(study: &Study, cells: &Cells) -> Vec<Gap> {
    let mut gaps = Vec::new();
    for (method, entry) in study.methods.iter().enumerate() {
        for &gate in &study.gates {
            for family in &study.families {
                if let Some(what) = gap(study, cells.runs(method, gate, family), &entry.row_seeds()) {
                    gaps.push(Gap { method, gate, family: family.clone(), what });
                }
            }
        }
    }
    gaps
}

fn gap(study: &Study, runs: Option<&Runs>, seeds: &[Option<u64>]) -> Option<String> {
    let Some(runs) = runs else { return Some("no rows".to_owned()) };
    let name = |seed: &Option<u64>| seed.map_or("rows".to_owned(), |seed| format!("seed {seed}"));
    let missing: Vec<String> = seeds.iter().filter(|seed| !runs.contains_key(*seed)).map(name).collect();
    let cut = runs.iter().filter(|(_, worlds)| (worlds.len() as u64) < study.worlds);
    let cut: Vec<String> = cut
        .map(|(seed, worlds)| format!("{} has {} of {} worlds", name(seed), worlds.len(), study.worlds))
        .collect();
    let missing = (!missing.is_empty()).then(|| format!("no {}", missing.join(", ")));
    let parts: Vec<String> = missing.into_iter().chain(cut).collect();
    (!parts.is_empty()).then(|| parts.join("; "))
}

/// Worlds that every run of all these drove, ascending.
pub fn shared_worlds(cells: &[&Runs]) -> Vec<u64> {
    let mut runs = cells.iter().flat_map(|runs| runs.values());
    let Some(first) = runs.next() else { return Vec::new() };
    let others: Vec<_> = runs.collect();
    first.keys().copied().filter(|world| others.iter().all(|run| run.contains_key(world))).collect()
}

/// A metric of runs on worlds that all of them drove.
pub fn table(runs: &Runs, worlds: &[u64], metric: Metric) -> Table {
    let row = |run: &BTreeMap<u64, Episode>| {
        worlds.iter().filter_map(|world| run.get(world)).map(|row| metric.of(row)).collect()
    };
    Table::new(runs.values().map(row).collect())
}

impl Metric {
    /// What an episode counts, 0 to 1.
    pub fn of(self, row: &Episode) -> f64 {
        let count = |is: bool| if is { 1.0 } else { 0.0 };
        match self {
            Self::Success => count(row.end == End::Success),
            Self::Collision => count(row.end == End::Collision),
            Self::HitWhileStanding => count(row.hit_while_standing),
            Self::Spin => row.spin,
            // Of a failure, and of a success whose shortest way is not known.
            Self::Spl => row.spl.unwrap_or(0.0),
        }
    }
}
