//! Scalars as a table: one row a step, one column a name, empty where a row has no such scalar.

use nav_host::files::write_atomically;
use std::fs::{self, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::RecordFile;

/// Name of the first column.
const STEP: &str = "step";

/// A table being written.
#[derive(Debug)]
pub struct CsvLog {
    path: PathBuf,
    /// Without the step.
    columns: Vec<String>,
    records: RecordFile,
}

impl CsvLog {
    /// Opens or makes the table. Rows later than `step`, and a last row that was cut short, are dropped: a
    /// resumed run writes them again.
    ///
    /// # Errors
    /// When the file cannot be read or written, or is not a table of ours.
    pub fn open(path: &Path, step: u64) -> io::Result<Self> {
        let text = match fs::read_to_string(path) {
            Ok(text) => text,
            Err(error) if error.kind() == io::ErrorKind::NotFound => String::new(),
            Err(error) => return Err(error),
        };
        let mut lines = text.lines();
        let header = lines.next().unwrap_or(STEP);
        let mut columns = header.split(',').map(str::to_owned);
        if columns.next().as_deref() != Some(STEP) {
            let message = format!("{} is not a table of scalars: move it away", path.display());
            return Err(io::Error::new(io::ErrorKind::InvalidData, message));
        }
        let columns: Vec<_> = columns.collect();
        let whole = |line: &&str| {
            let row_step = line.split(',').next().and_then(|value| value.parse::<u64>().ok());
            row_step.is_some_and(|row| row <= step) && line.split(',').count() == columns.len() + 1
        };
        // A row without its line break was cut short, even where its fields look whole.
        let complete = &text[..text.rfind('\n').map_or(0, |end| end + 1)];
        let rows: Vec<_> = complete.lines().skip(1).filter(whole).map(str::to_owned).collect();
        let records = rewrite(path, &columns, &rows, 0)?;
        Ok(Self { path: path.to_owned(), columns, records })
    }

    /// Appends a row. A name seen for the first time becomes a new last column.
    ///
    /// # Errors
    /// When the file cannot be written; the rows before stay as they are.
    pub fn write(&mut self, step: u64, scalars: &[(&str, f64)]) -> io::Result<()> {
        self.add_columns(scalars)?;
        let mut line = step.to_string();
        for column in &self.columns {
            line.push(',');
            if let Some((_, value)) = scalars.iter().find(|(name, _)| name == column) {
                line.push_str(&value.to_string());
            }
        }
        line.push('\n');
        self.records.append(line.as_bytes())
    }

    fn add_columns(&mut self, scalars: &[(&str, f64)]) -> io::Result<()> {
        let known = |name: &str| self.columns.iter().any(|column| column == name);
        let new: Vec<_> = scalars.iter().filter(|(name, _)| !known(name)).map(|(name, _)| name).collect();
        if new.is_empty() {
            return Ok(());
        }
        if let Some(name) = new.iter().find(|name| name.contains([',', '"', '\n', '\r'])) {
            let message = format!("`{name}` cannot be the name of a column");
            return Err(io::Error::new(io::ErrorKind::InvalidInput, message));
        }
        let text = fs::read_to_string(&self.path)?;
        let whole = &text[..(self.records.length as usize).min(text.len())];
        let rows: Vec<_> = whole.lines().skip(1).map(str::to_owned).collect();
        let columns: Vec<_> =
            self.columns.iter().cloned().chain(new.iter().map(|name| name.to_string())).collect();
        self.records = rewrite(&self.path, &columns, &rows, new.len())?;
        self.columns = columns;
        Ok(())
    }
}

/// Replaces the file by a header and rows, each with some empty fields more, and opens it for appending.
fn rewrite(path: &Path, columns: &[String], rows: &[String], empty: usize) -> io::Result<RecordFile> {
    write_atomically(path, |file| {
        file.write_all(STEP.as_bytes())?;
        for column in columns {
            write!(file, ",{column}")?;
        }
        writeln!(file)?;
        for row in rows {
            writeln!(file, "{row}{}", ",".repeat(empty))?;
        }
        Ok(())
    })?;
    RecordFile::new(OpenOptions::new().write(true).open(path)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> (tempfile::TempDir, PathBuf) {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("scalars.csv");
        (folder, path)
    }

    fn text(path: &Path) -> String {
        fs::read_to_string(path).expect("the table")
    }

    #[test]
    fn one_header_and_columns_as_they_come() {
        let (_folder, path) = table();
        let mut log = CsvLog::open(&path, 0).expect("a new table");
        log.write(1, &[("td3/q_mean", 0.5), ("success", 1.0)]).expect("a row");
        log.write(2, &[("success", 0.25)]).expect("a row");
        log.write(3, &[("dqn/loss", f64::NAN), ("success", -1e-9)]).expect("a row");
        let expected = "step,td3/q_mean,success,dqn/loss\n1,0.5,1,\n2,,0.25,\n3,,-0.000000001,NaN\n";
        assert_eq!(text(&path), expected);
        assert!(log.write(4, &[("a,b", 1.0)]).is_err());
        assert_eq!(text(&path), expected);
    }

    #[test]
    fn resuming_drops_what_comes_after_the_checkpoint() {
        let (_folder, path) = table();
        let mut log = CsvLog::open(&path, 0).expect("a new table");
        (1..=5).for_each(|step| log.write(step * 10, &[("x", step as f64)]).expect("a row"));
        drop(log);
        let mut torn = text(&path);
        torn.truncate(torn.len() - 1);
        fs::write(&path, &torn).expect("the disk has room");
        let mut log = CsvLog::open(&path, 50).expect("the same table");
        assert_eq!(text(&path), "step,x\n10,1\n20,2\n30,3\n40,4\n");
        log.write(50, &[("x", 5.5)]).expect("a row");
        drop(log);
        let mut log = CsvLog::open(&path, 30).expect("the same table");
        log.write(40, &[("x", 9.0)]).expect("a row");
        assert_eq!(text(&path), "step,x\n10,1\n20,2\n30,3\n40,9\n");
    }

    #[test]
    fn a_row_that_fails_half_way_is_cut_off_before_the_next() {
        let (_folder, path) = table();
        let mut log = CsvLog::open(&path, 0).expect("a new table");
        log.write(1, &[("x", 1.0)]).expect("a row");
        log.records.file.write_all(b"2,0.12").expect("what a full disk leaves");
        log.write(2, &[("x", 2.0)]).expect("a row");
        assert_eq!(text(&path), "step,x\n1,1\n2,2\n");
    }

    #[test]
    fn another_file_is_refused() {
        let (_folder, path) = table();
        fs::write(&path, "name,age\n").expect("the disk has room");
        let error = CsvLog::open(&path, 0).expect_err("not ours");
        assert!(error.to_string().contains("scalars.csv"), "{error}");
        assert_eq!(text(&path), "name,age\n");
    }
}
