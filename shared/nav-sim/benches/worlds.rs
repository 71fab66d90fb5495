//! Isolates what an episode costs before its first step, on one core: the world of a family with its path check,
//! and the distance field of its goal alone.
//!
//! Each sample takes another seed. Run with `cargo bench -p nav-sim --bench worlds`, or with a family's name to
//! see only that one.

use divan::{Bencher, black_box};
use nav_core::footprint::Footprint;
use nav_sim::families::{DESIGN_RADIUS_M, Family, Split, generate, generate_with_field};
use nav_sim::geodesic::GeodesicField;
use std::sync::atomic::{AtomicU64, Ordering};

fn main() {
    divan::main();
}

#[divan::bench(args = Family::ALL)]
fn world_with_field(bencher: Bencher<'_, '_>, family: Family) {
    let seed = AtomicU64::new(0);
    let next = || seed.fetch_add(1, Ordering::Relaxed);
    bencher.bench(|| generate_with_field(family, Split::Train, next(), &Footprint::circle(DESIGN_RADIUS_M)));
}

#[divan::bench(args = Family::ALL)]
fn field(bencher: Bencher<'_, '_>, family: Family) {
    let seed = AtomicU64::new(0);
    bencher
        .with_inputs(|| generate(family, Split::Train, seed.fetch_add(1, Ordering::Relaxed)))
        .bench_values(|world| GeodesicField::new(black_box(&world), &Footprint::circle(DESIGN_RADIUS_M)));
}
