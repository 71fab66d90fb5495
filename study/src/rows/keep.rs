//! Tables as results keep them: compressed, without columns that no judgement needs, numbers to four figures.

use std::fs::File;
use std::io::{self, Write};
use std::path::Path;

use flate2::Compression;
use flate2::write::GzEncoder;
use nav_host::files::write_atomically;

use super::curve::RETURNS;
use super::{Gate, RunRow};
use crate::plan::Study;

/// Figures of a number.
const FIGURES: usize = 4;

/// Columns of evaluation rows that are left out: where a run lay, what follows from other columns, and times of ticks, which say
/// something of the machine only.
const LEFT_OUT: [&str; 6] = [
    "run",
    "path_efficiency_euclidean",
    "time_to_collision_min_s",
    "stood_at_end_s",
    "tick_mean_ns",
    "tick_max_ns",
];

/// Columns of rows of a run that left no policy.
const NO_POLICY: [&str; 15] = [
    "policy",
    "training_seed",
    "family",
    "split",
    "world_seed",
    "disturbance",
    "shield",
    "end",
    "hit_while_standing",
    "time_s",
    "spl",
    "path_efficiency",
    "smoothness",
    "clearance_min_m",
    "spin",
];

/// Writes the evaluation rows of a plain table compressed.
///
/// # Errors
/// A table that cannot be read, or a file that cannot be written.
pub fn episodes(from: &Path, to: &Path) -> io::Result<()> {
    table(from, to, |column| !LEFT_OUT.contains(&column))
}

/// Writes a learning curve compressed.
///
/// # Errors
/// As [`episodes`].
pub fn curve(from: &Path, to: &Path) -> io::Result<()> {
    table(from, to, |_| true)
}

/// Writes what a report needs of the scalars of training compressed.
///
/// # Errors
/// As [`episodes`].
pub fn scalars(from: &Path, to: &Path) -> io::Result<()> {
    table(from, to, |column| column == "step" || RETURNS.contains(&column))
}

fn table(from: &Path, to: &Path, is_kept: impl Fn(&str) -> bool) -> io::Result<()> {
    let mut reader = csv::Reader::from_reader(File::open(from)?);
    let columns = reader.headers()?.clone();
    let kept: Vec<usize> = (0..columns.len()).filter(|&index| is_kept(&columns[index])).collect();
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(kept.iter().map(|&index| &columns[index]))?;
    for record in reader.records() {
        let record = record?;
        writer.write_record(kept.iter().map(|&index| short(&record[index])))?;
    }
    write_compressed(to, writer)
}

/// A number with a fraction, to a few figures; anything else as it is.
fn short(field: &str) -> String {
    let number = field.contains('.').then(|| field.parse::<f64>().ok()).flatten();
    let Some(number) = number.filter(|number| number.is_finite()) else { return field.to_owned() };
    let rounded: f64 = format!("{number:.*e}", FIGURES - 1).parse().unwrap_or(number);
    rounded.to_string()
}

/// Writes rows of a run that left no policy: no success and no collision in every world, and nothing that was measured.
///
/// # Errors
/// A file that cannot be written.
pub fn no_policy(study: &Study, method: usize, seed: u64, gate: Gate, to: &Path) -> io::Result<()> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(NO_POLICY)?;
    let (name, seed, shield) = (study.methods[method].name.as_str(), seed.to_string(), gate.word());
    for family in &study.families {
        for world in 0..study.worlds {
            let world = world.to_string();
            let who = [name, &seed, family, &study.split, &world, &study.disturbance, shield];
            writer.write_record(who.into_iter().chain([
                "no_policy",
                "false",
                "0",
                "0",
                "",
                "0",
                "0",
                "0",
            ]))?;
        }
    }
    write_compressed(to, writer)
}

/// Writes the table of runs.
///
/// # Errors
/// A file that cannot be written.
pub fn runs(rows: &[RunRow], to: &Path) -> io::Result<()> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for row in rows {
        writer.serialize(row)?;
    }
    let text = finished(writer)?;
    write_atomically(to, |file| file.write_all(&text))
}

/// The same rows give the same bytes: no time stands in the file.
fn write_compressed(to: &Path, writer: csv::Writer<Vec<u8>>) -> io::Result<()> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
    encoder.write_all(&finished(writer)?)?;
    let bytes = encoder.finish()?;
    write_atomically(to, |file| file.write_all(&bytes))
}

fn finished(writer: csv::Writer<Vec<u8>>) -> io::Result<Vec<u8>> {
    writer.into_inner().map_err(|error| io::Error::other(error.to_string()))
}
