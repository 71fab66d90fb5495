//! From cells to walls.

use crate::world::Segment;
use nav_core::geometry::Point;

/// The open cells that a walker from cell `first` can reach, step by step along the axes.
pub(super) fn reached(columns: usize, first: usize, open: &[bool]) -> Vec<bool> {
    let mut reached = vec![false; open.len()];
    let mut waiting = vec![first];
    reached[first] = open[first];
    while let Some(cell) = waiting.pop() {
        let column = cell % columns;
        let left = (column > 0).then(|| cell - 1);
        let right = (column + 1 < columns).then_some(cell + 1);
        let below = cell.checked_sub(columns);
        let above = Some(cell + columns).filter(|&above| above < open.len());
        for next in [left, right, below, above].into_iter().flatten() {
            if open[next] && !reached[next] {
                reached[next] = true;
                waiting.push(next);
            }
        }
    }
    reached
}

/// The walls round a set of cells, as few and long as straight lines allow. `place` maps a grid corner (column,
/// row) to the world.
pub(super) fn walls(columns: usize, inside: &[bool], place: impl Fn(usize, usize) -> Point) -> Vec<Segment> {
    let rows = inside.len() / columns;
    // Beyond the map there is nothing.
    let is_inside = |column: Option<usize>, row: Option<usize>| match (column, row) {
        (Some(column), Some(row)) if column < columns && row < rows => inside[row * columns + column],
        _ => false,
    };
    let mut walls = Vec::new();
    for line in 0..=rows {
        let side = |along: usize| {
            let (below, above) =
                (is_inside(Some(along), line.checked_sub(1)), is_inside(Some(along), Some(line)));
            (below != above).then_some(above)
        };
        for (from, to) in runs(columns, side) {
            walls.push(Segment { a: place(from, line), b: place(to, line) });
        }
    }
    for line in 0..=columns {
        let side = |along: usize| {
            let (left, right) =
                (is_inside(line.checked_sub(1), Some(along)), is_inside(Some(line), Some(along)));
            (left != right).then_some(right)
        };
        for (from, to) in runs(rows, side) {
            walls.push(Segment { a: place(line, from), b: place(line, to) });
        }
    }
    walls
}

/// The longest runs of places with the same side.
fn runs(count: usize, side: impl Fn(usize) -> Option<bool>) -> Vec<(usize, usize)> {
    let mut runs = Vec::new();
    let mut open: Option<(usize, bool)> = None;
    for along in 0..=count {
        let here = if along < count { side(along) } else { None };
        if open.map(|(_, side)| side) != here {
            if let Some((from, _)) = open {
                runs.push((from, along));
            }
            open = here.map(|side| (along, side));
        }
    }
    runs
}
