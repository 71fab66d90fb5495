//! Each seed's scores, for whoever judges them otherwise.

use super::grid::Grid;
use crate::analysis::Analysis;
use crate::plan::Study;

/// A row a seed, family and gate.
pub(super) fn grid(study: &Study, analysis: &Analysis) -> Grid {
    let columns = ["method", "training_seed", "gate", "family", "worlds", "success", "collision"];
    let mut grid = Grid::new("scores", "Scores of every seed", "", &columns);
    for (success, collision) in analysis.success.iter().zip(&analysis.collision) {
        let entry = &study.methods[success.method];
        for (index, (solved, hit)) in success.scores.iter().zip(&collision.scores).enumerate() {
            let seed = success.seeds.get(index).copied().flatten();
            grid.rows.push(vec![
                entry.name.clone(),
                seed.map_or(String::new(), |seed| seed.to_string()),
                success.gate.word().to_owned(),
                success.family.clone(),
                success.worlds.to_string(),
                solved.to_string(),
                hit.to_string(),
            ]);
        }
    }
    grid
}
