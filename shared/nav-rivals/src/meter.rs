//! Counts what a search over the cells of a grid takes, from outside: it is told of every cell that the search expands.
//!
//! It keeps the least cost of every cell that was reached, as the search itself does, and so knows when a cell enters the
//! frontier (once more at a lower cost, as in [`pathfinding`], which leaves the dearer entry where it is).

use nav_env::searched::Searched;

use crate::grid::Cell;

/// What the search keeps of a cell that it reached: hash, cell, the cell that it was reached from, and its cost.
const REACHED_BYTES: usize = size_of::<(usize, Cell, usize, u32)>();
/// What it keeps of an entry of the frontier: two costs and the cell's index.
const FRONTIER_BYTES: usize = size_of::<(u32, u32, usize)>();

/// Counts.
pub(crate) struct Meter {
    /// Least cost of the cells that were reached; `u32::MAX` of others.
    costs: Vec<u32>,
    reached: usize,
    expanded: usize,
    /// Entries of the frontier that were ever made, those that were never taken off it among them.
    entered: usize,
    frontier_max: usize,
}

impl Meter {
    /// Before a search from a cell (its index) of so many.
    pub(crate) fn new(cells: usize, start: usize) -> Self {
        let mut costs = vec![u32::MAX; cells];
        let reached = costs.get_mut(start).map_or(0, |cost| {
            *cost = 0;
            1
        });
        Self { costs, reached, expanded: 0, entered: 1, frontier_max: 1 }
    }

    /// A cell is expanded: the indices of its neighbours, each with the cost of the step to it.
    pub(crate) fn expand(&mut self, cell: usize, neighbours: impl Iterator<Item = (usize, u32)>) {
        self.expanded += 1;
        let Some(&here) = self.costs.get(cell) else { return };
        for (neighbour, step) in neighbours {
            let (cost, known) = (here + step, &mut self.costs[neighbour]);
            if cost < *known {
                self.reached += usize::from(*known == u32::MAX);
                *known = cost;
                self.entered += 1;
            }
        }
        self.frontier_max = self.frontier_max.max(self.entered - self.expanded);
    }

    /// What the search took, on a map of so many bytes.
    pub(crate) fn searched(&self, map_bytes: usize) -> Searched {
        let bytes = map_bytes + self.reached * REACHED_BYTES + self.frontier_max * FRONTIER_BYTES;
        Searched {
            searches: 1,
            expanded: self.expanded as u64,
            cells: self.costs.len() as u64,
            bytes: bytes as u64,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_reached_once_and_enter_the_frontier_at_every_lower_cost() {
        let mut meter = Meter::new(4, 0);
        meter.expand(0, [(1, 10), (2, 30)].into_iter());
        meter.expand(1, [(0, 10), (2, 5)].into_iter());
        meter.expand(2, [(0, 30), (1, 5)].into_iter());
        let bytes = 100 + 3 * REACHED_BYTES + 2 * FRONTIER_BYTES;
        let expected = Searched { searches: 1, expanded: 3, cells: 4, bytes: bytes as u64 };
        assert_eq!(meter.searched(100), expected);
    }
}
