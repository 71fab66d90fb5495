//! Learning curves as the trainer writes them (`curve.points` of its configuration): method and seed are those of the folder,
//! figures are means over the families of validation worlds, and returns come from the scalars beside the curve.

use std::path::Path;

use super::{Table, TablesError, open};

/// What tells a curve from other tables of a run.
pub(super) const COLUMNS: [&str; 2] = ["step", "hybrid"];
/// The scalars beside a curve, as the trainer writes them or as results keep them.
const SCALARS: [&str; 2] = ["scalars.csv", "scalars.csv.gz"];
/// Columns of scalars: mean return of recent attempts of the low level, and of recent episodes of the high level.
pub(super) const RETURNS: [&str; 2] = ["low/return", "high/return"];

/// One look at a run under way, on validation worlds.
#[derive(Clone, Debug, PartialEq)]
pub struct CurveRow {
    /// The method's name.
    pub method: String,
    /// Its seed.
    pub training_seed: u64,
    /// Environment steps so far, all stages together.
    pub env_steps: u64,
    /// Share of validation worlds solved, mean over families.
    pub success: f64,
    /// Share that ended in a collision, mean over families.
    pub collision: f64,
    /// Mean return of recent training episodes, in the method's own reward: of the level that decides where to go. None while
    /// a low level is trained for another level above it, and where nothing was logged.
    pub episode_return: Option<f64>,
    /// Mean share of steps that were spin.
    pub spin: Option<f64>,
}

/// Whose curve a file is.
pub(super) struct Run<'a> {
    path: &'a Path,
    method: &'a str,
    seed: u64,
}

impl<'a> Run<'a> {
    /// Of a file `METHOD/seed-N/NAME`.
    pub(super) fn of(path: &'a Path) -> Option<Self> {
        let folder = path.parent()?;
        let seed = folder.file_name()?.to_str()?.strip_prefix("seed-")?.parse().ok()?;
        let method = folder.parent()?.file_name()?.to_str()?;
        Some(Self { path, method, seed })
    }
}

/// The looks of a curve whose columns are known.
pub(super) fn read(
    run: &Run<'_>,
    mut reader: csv::Reader<Table>,
    columns: &csv::StringRecord,
) -> Result<Vec<CurveRow>, TablesError> {
    let wrong = |problem: String| TablesError::Format { path: run.path.to_owned(), problem };
    let mut rows = Vec::new();
    for (index, record) in reader.records().enumerate() {
        let look = Look { columns, record: &record.map_err(|error| wrong(error.to_string()))? };
        let missing = |name: &str| wrong(format!("row {} has no {name}", index + 1));
        let [step, is_hybrid] = COLUMNS.map(|name| look.of(name).ok_or_else(|| missing(name)));
        let row = CurveRow {
            method: run.method.to_owned(),
            training_seed: run.seed,
            env_steps: step? as u64,
            success: look.mean("success").ok_or_else(|| missing("FAMILY/success"))?,
            collision: look.mean("collision").ok_or_else(|| missing("FAMILY/collision"))?,
            episode_return: None,
            spin: look.mean("spin"),
        };
        rows.push((is_hybrid? > 0.0, row));
    }
    // What a low level is paid for on the way to subgoals is not the return of an episode.
    let has_levels = rows.iter().any(|(is_hybrid, _)| *is_hybrid);
    let returns = Returns::beside(run.path)?;
    let with_return = |(is_hybrid, row): (bool, CurveRow)| {
        let deciding = if is_hybrid { Some(1) } else { (!has_levels).then_some(0) };
        CurveRow { episode_return: deciding.and_then(|level| returns.at(level, row.env_steps)), ..row }
    };
    Ok(rows.into_iter().map(with_return).collect())
}

/// A row with its columns' names.
struct Look<'a> {
    columns: &'a csv::StringRecord,
    record: &'a csv::StringRecord,
}

impl Look<'_> {
    fn of(&self, name: &str) -> Option<f64> {
        let value = self.columns.iter().position(|column| column == name).and_then(|at| self.record.get(at));
        value.and_then(|value| value.parse().ok())
    }

    /// Over the families that have it.
    fn mean(&self, name: &str) -> Option<f64> {
        let fields = self.columns.iter().zip(self.record);
        let own = fields.filter(|(column, _)| column.rsplit_once('/').is_some_and(|(_, last)| last == name));
        crate::stats::mean(&own.filter_map(|(_, value)| value.parse().ok()).collect::<Vec<f64>>())
    }
}

/// Returns over steps, by level: low, high.
#[derive(Default)]
struct Returns([Vec<(u64, f64)>; 2]);

impl Returns {
    fn beside(curve: &Path) -> Result<Self, TablesError> {
        let found = SCALARS.map(|name| curve.with_file_name(name)).into_iter().find(|path| path.is_file());
        let Some(path) = found else { return Ok(Self::default()) };
        let failed =
            |error: csv::Error| TablesError::Format { path: path.clone(), problem: error.to_string() };
        let mut reader = csv::Reader::from_reader(open(&path)?);
        let columns = reader.headers().map_err(failed)?.clone();
        let mut returns = Self::default();
        for record in reader.records() {
            let look = Look { columns: &columns, record: &record.map_err(failed)? };
            let Some(step) = look.of(COLUMNS[0]) else { continue };
            for (level, name) in returns.0.iter_mut().zip(RETURNS) {
                level.extend(
                    look.of(name).filter(|value| value.is_finite()).map(|value| (step as u64, value)),
                );
            }
        }
        Ok(returns)
    }

    /// The newest of a level at a step.
    fn at(&self, level: usize, step: u64) -> Option<f64> {
        self.0[level].iter().rfind(|(logged, _)| *logged <= step).map(|(_, value)| *value)
    }
}
