//! Fast marching on a raster.
//!
//! Cells wait in buckets an eighth of a cell wide (Yatziv, Bartesaghi and Sapiro 2006). A cell that improves
//! after it left its bucket goes back in, so the result is the solution of the discrete equation itself, not an
//! approximation that depends on the order of cells.

use super::raster::{Class, Raster};
use std::f32::consts::SQRT_2;

const BUCKETS_A_CELL: f32 = 8.0;
/// More than the spread of the seeds and one step need.
const BUCKETS: usize = 512;
/// Smaller improvements are rounding, m in a raster of cells of 0.1 m.
const ROUNDING_M: f32 = 1e-5;

/// The distance of every cell from the seeds (cell, distance in m) through free cells, m; infinite where there
/// is no way. Near cells take theirs from the free cells beside them.
pub(super) fn distances_m(raster: &Raster, seeds: &[(usize, f32)]) -> Vec<f32> {
    let per_m = BUCKETS_A_CELL / raster.cell_m;
    let bucket_of = |distance_m: f32| (distance_m * per_m) as usize;
    let mut distances_m = vec![f32::INFINITY; raster.len()];
    let mut buckets: Vec<Vec<u32>> = vec![Vec::new(); BUCKETS];
    for &(cell, distance_m) in seeds {
        distances_m[cell] = distance_m;
        buckets[bucket_of(distance_m) % BUCKETS].push(cell as u32);
    }
    let stride = raster.stride;
    let rounding_m = ROUNDING_M * (raster.cell_m / 0.1);
    let mut waiting = seeds.len();
    let mut current = 0;
    while waiting > 0 {
        let Some(cell) = buckets[current % BUCKETS].pop() else {
            current += 1;
            continue;
        };
        waiting -= 1;
        let cell = cell as usize;
        let from_m = distances_m[cell];
        if bucket_of(from_m) != current {
            continue;
        }
        // Each neighbour, and how far the two beside it at right angles to the step are in the array.
        for (next, across) in [(cell - 1, stride), (cell + 1, stride), (cell - stride, 1), (cell + stride, 1)]
        {
            let old_m = distances_m[next];
            if raster.class(next) != Class::Free || old_m <= from_m {
                continue;
            }
            let beside_m = distances_m[next - across].min(distances_m[next + across]);
            let distance_m = solved_m(from_m, beside_m, raster.cell_m);
            if distance_m < old_m - rounding_m {
                distances_m[next] = distance_m;
                buckets[bucket_of(distance_m) % BUCKETS].push(next as u32);
                waiting += 1;
            }
        }
    }
    spread_to_near_cells(raster, &mut distances_m);
    distances_m
}

/// The distance d of a cell from those of two neighbours at right angles: the solution of
/// (d - a)² + (d - b)² = step² that both can have caused, or one step from the nearer. `a` is finite.
fn solved_m(a: f32, b: f32, step_m: f32) -> f32 {
    let gap = (a - b).abs();
    let both_m = 0.5 * (a + b + (2.0 * step_m * step_m - gap * gap).max(0.0).sqrt());
    if gap < step_m { both_m } else { a.min(b) + step_m }
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
