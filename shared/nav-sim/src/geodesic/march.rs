//! Fast marching on a raster.
//!
//! Cells wait in buckets a quarter of a cell wide (Yatziv, Bartesaghi and Sapiro 2006). A cell that improves
//! after it left its bucket goes back in, so the result is the solution of the discrete equation itself, not an
//! approximation that depends on the order of cells.

use super::raster::{Class, Raster};
use std::f32::consts::SQRT_2;

const BUCKETS_A_CELL: f32 = 4.0;
/// More than the spread of the seeds and one step need; a power of two.
const BUCKETS: usize = 256;

/// The distance of every cell from the seeds (cell, distance in m) through free cells, m; infinite where there
/// is no way. Near cells take theirs from the free cells beside them.
pub(super) fn distances_m(raster: &Raster, seeds: &[(usize, f32)]) -> Vec<f32> {
    let cell_m = raster.cell_m;
    let mut distances_m = vec![f32::INFINITY; raster.len()];
    let bucket_of = |distance_m: f32| (distance_m * (BUCKETS_A_CELL / cell_m)) as usize;
    let mut buckets: Vec<Vec<u32>> = vec![Vec::new(); BUCKETS];
    let mut waiting = 0_usize;
    for &(cell, distance_m) in seeds {
        distances_m[cell] = distance_m;
        buckets[bucket_of(distance_m) % BUCKETS].push(cell as u32);
        waiting += 1;
    }
    let mut current = 0;
    while waiting > 0 {
        let Some(cell) = buckets[current % BUCKETS].pop() else {
            current += 1;
            continue;
        };
        waiting -= 1;
        let cell = cell as usize;
        if bucket_of(distances_m[cell]) != current {
            continue;
        }
        let from_m = distances_m[cell];
        for (next, sides) in raster.neighbours(cell) {
            let old_m = distances_m[next];
            if old_m <= from_m || !raster.is_free_step(next, sides) {
                continue;
            }
            let distance_m = solved_m(raster, &distances_m, cell, next);
            if distance_m < old_m - 1e-5 {
                distances_m[next] = distance_m;
                buckets[bucket_of(distance_m) % BUCKETS].push(next as u32);
                waiting += 1;
            }
        }
    }
    spread_to_near_cells(raster, &mut distances_m);
    distances_m
}

/// The solution of |∇d| = 1 at `next` from its neighbour `cell` and the two at right angles to it: upright
/// where `cell` lies beside, above or below, diagonal where it lies across a corner.
fn solved_m(raster: &Raster, distances_m: &[f32], cell: usize, next: usize) -> f32 {
    let stride = raster.stride;
    let crosswise = |a: usize, b: usize, step_m: f32| {
        stencil_m(distances_m[cell], distances_m[a].min(distances_m[b]), step_m)
    };
    match cell.abs_diff(next) {
        1 => crosswise(next - stride, next + stride, raster.cell_m),
        gap if gap == stride => crosswise(next - 1, next + 1, raster.cell_m),
        gap => {
            // The other diagonal of the same square of neighbours, each end only if no corner is cut.
            let aside = if gap == stride + 1 { stride - 1 } else { stride + 1 };
            let end_m = |to: usize, sides: [usize; 2]| {
                if raster.is_free_step(to, sides) { distances_m[to] } else { f32::INFINITY }
            };
            let (over, under) = (next + aside, next - aside);
            let row_end = |row: usize| if aside == stride + 1 { row + 1 } else { row - 1 };
            let over_m = end_m(over, [next + stride, row_end(next)]);
            let under_m = end_m(under, [next - stride, 2 * next - row_end(next)]);
            stencil_m(distances_m[cell], over_m.min(under_m), SQRT_2 * raster.cell_m)
        }
    }
}

/// The larger root of (d - a)² + (d - b)² = step², or one step from the nearer neighbour alone.
fn stencil_m(a: f32, b: f32, step_m: f32) -> f32 {
    let gap = (a - b).abs();
    // Two infinities have no difference, and then there is no solution either.
    if gap < step_m { 0.5 * (a + b + (2.0 * step_m * step_m - gap * gap).sqrt()) } else { a.min(b) + step_m }
}

fn spread_to_near_cells(raster: &Raster, distances_m: &mut [f32]) {
    let mut waiting: Vec<usize> =
        (0..raster.len()).filter(|&cell| raster.class(cell) == Class::Near).collect();
    let mut found = Vec::new();
    for _ in 0..raster.near_layers() {
        waiting.retain(|&cell| {
            let best_m = raster
                .neighbours(cell)
                .into_iter()
                .map(|(next, sides)| {
                    let step_m = if sides[0] == sides[1] { raster.cell_m } else { SQRT_2 * raster.cell_m };
                    distances_m[next] + step_m
                })
                .fold(f32::INFINITY, f32::min);
            if best_m.is_finite() {
                found.push((cell, best_m));
            }
            best_m.is_infinite()
        });
        for (cell, distance_m) in found.drain(..) {
            distances_m[cell] = distance_m;
        }
    }
}
