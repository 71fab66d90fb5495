//! What a run tells while it goes on: scalars for TensorBoard and for scripts, and a progress bar.
//!
//! | file | holds |
//! |---|---|
//! | [`tensorboard`] | an event file that TensorBoard opens |
//! | [`csv`] | the same scalars as a table |
//! | [`progress`] | a bar on a terminal, a line now and then elsewhere |

pub mod tensorboard;
pub mod csv;
pub mod progress;

use std::fs::File;
use std::io::{self, Seek, SeekFrom, Write};
use std::path::Path;

pub use csv::CsvLog;
pub use progress::{Progress, Status};
pub use tensorboard::EventFile;

/// Scalars of a run, written to `scalars.csv` and to a TensorBoard event file in the same folder.
#[derive(Debug)]
pub struct ScalarLog {
    csv: CsvLog,
    events: EventFile,
}

impl ScalarLog {
    /// Opens both in `folder`, which must exist, for a run that starts or resumes after `step` (0 for a new
    /// one): what an interrupted run logged later than that is dropped, since it will be logged again.
    ///
    /// # Errors
    /// When a file cannot be made or read, or `scalars.csv` is none of ours.
    pub fn open(folder: &Path, step: u64) -> io::Result<Self> {
        let csv = CsvLog::open(&folder.join("scalars.csv"), step)?;
        Ok(Self { csv, events: EventFile::create(folder, step)? })
    }

    /// Writes one row; names in the style of `td3/q_mean`. Both files are flushed to the system, so that they
    /// can be watched.
    ///
    /// # Errors
    /// When a file cannot be written, for example because the disk is full. The row is then missing from it,
    /// the file is whole, and the next row is tried afresh: a run need not end for it.
    pub fn write(&mut self, step: u64, scalars: &[(&str, f64)]) -> io::Result<()> {
        let table = self.csv.write(step, scalars);
        let events = self.events.write(step, scalars);
        table.and(events)
    }
}

/// A file that grows by whole records: a record that fails half-way is cut off before the next one.
#[derive(Debug)]
struct RecordFile {
    file: File,
    length: u64,
}

impl RecordFile {
    fn new(mut file: File) -> io::Result<Self> {
        let length = file.seek(SeekFrom::End(0))?;
        Ok(Self { file, length })
    }

    fn append(&mut self, record: &[u8]) -> io::Result<()> {
        if self.file.stream_position()? != self.length {
            self.file.set_len(self.length)?;
            self.file.seek(SeekFrom::Start(self.length))?;
        }
        self.file.write_all(record)?;
        self.length += record.len() as u64;
        Ok(())
    }
}
