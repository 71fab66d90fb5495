//! The table of PathBench's figures.

use super::grid::{DASH, Grid, hundredths};
use crate::analysis::Analysis;
use crate::plan::Study;

/// A method with a gate a row.
pub(super) fn grid(study: &Study, analysis: &Analysis) -> Grid {
    let note = "The figures of the paper's chosen tool, PathBench (Toma et al. 2021), of the same rows: plain means over the episodes of \
                all seeds and families. Of successes: path deviation (driven, less the shortest way of the footprint on the known \
                map; an episode ends at the rim of the goal, so it can be less than zero by the goal's radius), clearance (footprint \
                to anything, mean over steps), turning (change of heading for each metre driven). Of all: distance left (straight \
                line from the end to the goal). Of planners on a grid: search space (cells expanded, of all cells, a search) and \
                memory (grid and search). PathBench counts in cells, turns a move, and the memory of the whole program. A mean over a \
                method's own successes flatters one that solves only what is easy: the table world by world compares like with like.";
    let columns = [
        "method",
        "gate",
        "episodes",
        "success, %",
        "path deviation, m",
        "distance left, m",
        "clearance, m",
        "turning, rad/m",
        "search space, %",
        "memory, KiB",
    ];
    let mut grid = Grid::new("pathbench", "PathBench's figures", note, &columns);
    let number = |value: Option<f64>, digits: usize| match value {
        Some(value) => format!("{value:.digits$}"),
        None => DASH.to_owned(),
    };
    for own in &analysis.pathbench {
        let means = &own.means;
        grid.rows.push(vec![
            study.methods[own.method].label.clone(),
            own.gate.word().to_owned(),
            own.episodes.to_string(),
            hundredths(own.success),
            number(means.deviation_m, 2),
            number(means.left_m, 2),
            number(means.clearance_m, 2),
            number(means.turned_radpm, 2),
            means.search_share.map_or(DASH.to_owned(), hundredths),
            number(means.search_bytes.map(|bytes| bytes / 1024.0), 0),
        ]);
    }
    grid
}
