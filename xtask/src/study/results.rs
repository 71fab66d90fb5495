//! The folder of results: rows as they come, compressed, and at the end the table of runs and the report.
//!
//! | in `--out` | |
//! |---|---|
//! | `index.html`, `*.csv`, `figures/` | the report |
//! | `rows/METHOD/seed-N/off.csv.gz`, `on.csv.gz` | every episode, without and with the safety gate |
//! | `rows/METHOD/seed-N/curve.csv.gz`, `scalars.csv.gz` | how the run learned |
//! | `rows/METHOD/config.toml` | every field of the configuration, of the first run |
//! | `rows/runs.csv` | what each run took and came to |

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::SystemTime;

use anyhow::{Context, Result};
use study::jobs::TrainingRun;
use study::plan::Study;
use study::rows::{Gate, RunRow, keep};

use crate::shell::{root, run_shown};
use crate::training::short;

/// The folder of results.
pub(super) struct Results<'a> {
    /// What is studied.
    pub study: &'a Study,
    /// The folder.
    pub out: &'a Path,
}

impl Results<'_> {
    fn rows(&self) -> PathBuf {
        self.out.join("rows")
    }

    /// A file of a method with a seed, in a folder that exists.
    fn file(&self, method: usize, seed: Option<u64>, name: &str) -> Result<PathBuf> {
        let folder = self.rows().join(self.study.folder(method, seed));
        fs::create_dir_all(&folder).with_context(|| format!("could not create {}", folder.display()))?;
        Ok(folder.join(name))
    }

    /// Keeps what a run tells of its training.
    ///
    /// # Errors
    /// Files that cannot be read or written.
    pub(super) fn keep_run(&self, run: &TrainingRun, folder: &Path) -> Result<()> {
        type Keep = fn(&Path, &Path) -> io::Result<()>;
        let tables: [(&str, Keep); 2] = [("curve.csv", keep::curve), ("scalars.csv", keep::scalars)];
        for (name, kept) in tables {
            if folder.join(name).is_file() {
                let to = self.file(run.method, Some(run.seed), &format!("{name}.gz"))?;
                anew(&folder.join(name), &to, kept)?;
            }
        }
        let (from, to) = (folder.join("config.toml"), self.file(run.method, None, "config.toml")?);
        if !to.exists() && from.is_file() {
            fs::copy(&from, &to).with_context(|| format!("could not write {}", to.display()))?;
        }
        Ok(())
    }

    /// Keeps the rows of an evaluation.
    ///
    /// # Errors
    /// Files that cannot be read or written.
    pub(super) fn keep_rows(&self, method: usize, seed: Option<u64>, gate: Gate, from: &Path) -> Result<()> {
        anew(from, &self.file(method, seed, &format!("{}.csv.gz", gate.word()))?, keep::episodes)
    }

    /// Keeps that a run left no policy.
    ///
    /// # Errors
    /// Files that cannot be written.
    pub(super) fn keep_no_policy(&self, method: usize, seed: u64, gate: Gate) -> Result<()> {
        let to = self.file(method, Some(seed), &format!("{}.csv.gz", gate.word()))?;
        keep::no_policy(self.study, method, seed, gate, &to)
            .with_context(|| format!("could not write {}", to.display()))
    }

    /// Writes the table of runs and the report.
    ///
    /// # Errors
    /// Runs that cannot be read, or a report that cannot be made.
    pub(super) fn report(&self, work: &Path, programs: &Path) -> Result<()> {
        let mut runs: Vec<RunRow> = Vec::new();
        for run in self.study.training_runs() {
            let path = work.join(&run.folder).join("trained.json");
            // Of a run that has not ended there is nothing to tell.
            let Ok(text) = fs::read_to_string(&path) else { continue };
            runs.push(
                serde_json::from_str(&text).with_context(|| format!("could not read {}", path.display()))?,
            );
        }
        let rows = self.rows();
        fs::create_dir_all(&rows).with_context(|| format!("could not create {}", rows.display()))?;
        let table = rows.join("runs.csv");
        if !runs.is_empty() {
            keep::runs(&runs, &table).with_context(|| format!("could not write {}", table.display()))?;
        }
        let mut report = Command::new(programs.join("study"));
        // Where these names hold, on every machine.
        report.current_dir(root());
        report.args(["report", "--study", &short(&self.study.path), "--rows", &short(&rows)]);
        run_shown(report.args(["--out", &short(self.out)]), "study report")
    }
}

/// Makes a file of another, unless it is newer.
fn anew(from: &Path, to: &Path, make: fn(&Path, &Path) -> io::Result<()>) -> Result<()> {
    let changed = |path: &Path| fs::metadata(path).and_then(|data| data.modified()).ok();
    let is_old = |made: SystemTime| changed(from).is_none_or(|changed| changed > made);
    if changed(to).is_none_or(is_old) {
        make(from, to).with_context(|| format!("could not make {} of {}", to.display(), from.display()))?;
    }
    Ok(())
}
