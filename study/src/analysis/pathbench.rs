//! The figures of PathBench (Toma et al. 2021, *PathBench: A Benchmarking Platform for Classical and Learned Path Planning
//! Algorithms*), the tool that the source paper chose, of the same evaluation rows.
//!
//! What each is there was read in its code (`src/algorithms/basic_testing.py`, `src/analyzer/analyzer.py`, commit 101e676 of 2021):
//! an agent that moves from cell to cell of a grid, one move after the other. Ours are of a robot that drives, so units differ:
//!
//! | figure | PathBench | here | over |
//! |---|---|---|---|
//! | path deviation | moved, less the length of its own A*'s path: cells | driven, less the shortest way of the footprint on the known map: m. Less than zero by the goal's radius at the most, at whose rim an episode ends | successes |
//! | distance left | straight line from the last cell to the goal's: cells | straight line from where the robot ended to the goal: m | all |
//! | clearance | from the cell to the nearest wall's, mean over moves: cells; 0 on a map without walls | from the footprint to the nearest thing or person, mean over steps: m | successes |
//! | smoothness | change of direction, mean over moves: rad a move, each direction as its angle to the x axis in [0, π], so that a turn from +a to -a counts as none | change of heading, wrapped: rad a metre, which does not depend on the control period | successes |
//! | search space | cells visited and entries of the frontier (a cell may have several) over all cells | cells expanded over all cells, mean over the searches of an episode | planners |
//! | memory | peak of all that the program allocates meanwhile, its maps and pictures among it: kB | grid and search, by their data: KiB | planners |
//!
//! A method's mean over its own successes says nothing of the worlds that it failed in: [`super::paired`] compares like with like.

use crate::cells::{Cells, Episode};
use crate::plan::Study;
use crate::rows::{End, EpisodeRow, Gate};
use crate::stats::mean;
use std::f64::consts::FRAC_PI_2;

/// What an episode has to tell; nothing of a column that its row does not have.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Figures {
    /// Driven, less the shortest way, m; of a success.
    pub deviation_m: Option<f64>,
    /// From where it ended to the goal, m.
    pub left_m: Option<f64>,
    /// Mean clearance, m; of a success.
    pub clearance_m: Option<f64>,
    /// Turned for each metre driven, rad/m; of a success.
    pub turned_radpm: Option<f64>,
    /// Share of a grid's cells that a search expanded; of a planner.
    pub search_share: Option<f64>,
    /// Memory of map and search, bytes; of a planner.
    pub search_bytes: Option<f64>,
}

impl Figures {
    /// Of a row.
    pub fn of(row: &EpisodeRow) -> Self {
        let is_success = row.end == End::Success;
        let driven_m = row.path_m.filter(|&path_m| is_success && path_m > 0.0);
        // A step's smoothness is 1 - turn / 90 degrees, and no robot turns by more than 90 degrees in a step.
        let turned_rad = row.steps.map(|steps| (1.0 - row.smoothness) * FRAC_PI_2 * f64::from(steps));
        let cells = row.searches.zip(row.search_cells).map(|(searches, cells)| f64::from(searches) * cells);
        let share = row.search_expanded.zip(cells).map(|(expanded, cells)| expanded / cells);
        Self {
            deviation_m: driven_m.zip(row.geodesic_m).map(|(driven_m, least_m)| driven_m - least_m),
            left_m: row.distance_left_m,
            clearance_m: row.clearance_mean_m.filter(|_| is_success),
            turned_radpm: turned_rad.zip(driven_m).map(|(turned_rad, driven_m)| turned_rad / driven_m),
            search_share: share.filter(|share| share.is_finite()),
            search_bytes: row.search_bytes,
        }
    }
}

/// A method with a gate, over all families.
#[derive(Clone, Debug, PartialEq)]
pub struct MethodFigures {
    /// Index of the method.
    pub method: usize,
    /// With which gate.
    pub gate: Gate,
    /// Episodes, of all seeds and families.
    pub episodes: usize,
    /// Share that reached the goal.
    pub success: f64,
    /// Means over the episodes that have them.
    pub means: Figures,
}

/// Every method and gate that has rows.
pub fn methods(study: &Study, cells: &Cells) -> Vec<MethodFigures> {
    let with_gate =
        |method| study.gates.iter().filter_map(move |&gate| of_method(study, cells, method, gate));
    (0..study.methods.len()).flat_map(with_gate).collect()
}

fn of_method(study: &Study, cells: &Cells, method: usize, gate: Gate) -> Option<MethodFigures> {
    let runs = study.families.iter().filter_map(|family| cells.runs(method, gate, family));
    let episodes: Vec<&Episode> = runs.flat_map(|runs| runs.values()).flat_map(|run| run.values()).collect();
    let mean_of = |figure: fn(&Figures) -> Option<f64>| {
        mean(&episodes.iter().filter_map(|episode| figure(&episode.pathbench)).collect::<Vec<_>>())
    };
    let successes = episodes.iter().filter(|episode| episode.end == End::Success).count();
    (!episodes.is_empty()).then(|| MethodFigures {
        method,
        gate,
        episodes: episodes.len(),
        success: successes as f64 / episodes.len() as f64,
        means: Figures {
            deviation_m: mean_of(|figures| figures.deviation_m),
            left_m: mean_of(|figures| figures.left_m),
            clearance_m: mean_of(|figures| figures.clearance_m),
            turned_radpm: mean_of(|figures| figures.turned_radpm),
            search_share: mean_of(|figures| figures.search_share),
            search_bytes: mean_of(|figures| figures.search_bytes),
        },
    })
}
