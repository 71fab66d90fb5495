//! A folder of checkpoints.

use nav_host::files::write_atomically;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::format::{Checkpoint, Contents};
use super::load_error::LoadError;

/// How many of the newest are kept.
const KEPT: usize = 3;
const PREFIX: &str = "step-";
const SUFFIX: &str = ".ckpt";

/// Why a checkpoint was not written. The ones before it are as they were: training can go on and try again.
#[derive(Debug, thiserror::Error)]
#[error("checkpoint {} was not written; earlier ones are untouched: free space or fix the folder", path.display())]
pub struct SaveError {
    /// The file that was to be written.
    pub path: PathBuf,
    /// What the file system said.
    pub source: io::Error,
}

/// The checkpoints of one run.
#[derive(Debug, Clone)]
pub struct CheckpointStore {
    folder: PathBuf,
}

/// What [`CheckpointStore::load_newest_valid`] found.
#[derive(Debug)]
pub struct Newest {
    /// The newest checkpoint that is whole; nothing when there is none.
    pub checkpoint: Option<Checkpoint>,
    /// Newer ones that are not, and why.
    pub skipped: Vec<LoadError>,
}

impl CheckpointStore {
    /// The checkpoints in `folder`, which is made if it is not there. Half-written ones are removed.
    ///
    /// # Errors
    /// When the folder cannot be made.
    pub fn open(folder: &Path) -> io::Result<Self> {
        fs::create_dir_all(folder)?;
        // What a killed process was writing; only one process writes here at a time.
        for entry in fs::read_dir(folder)?.flatten() {
            let name = entry.file_name();
            let name = name.to_string_lossy();
            if name.starts_with('.') && name.ends_with(".tmp") {
                fs::remove_file(entry.path())?;
            }
        }
        Ok(Self { folder: folder.to_owned() })
    }

    /// Writes a checkpoint and removes those older than the newest three. Saving a step again replaces it.
    ///
    /// Later steps, torn or left over from before a roll-back, are of a future that did not happen: they go
    /// too.
    ///
    /// # Errors
    /// When it could not be written, for example because the disk is full; nothing else has changed then.
    pub fn save(&self, step: u64, contents: &Contents<'_>) -> Result<PathBuf, SaveError> {
        let path = self.folder.join(format!("{PREFIX}{step:012}{SUFFIX}"));
        write_atomically(&path, |file| contents.write_to(step, file))
            .map_err(|source| SaveError { path: path.clone(), source })?;
        let mut kept = 0;
        for (other, path) in self.newest_first() {
            kept += usize::from(other <= step);
            if other > step || kept > KEPT {
                // One too many is no reason to stop.
                let _ = fs::remove_file(path);
            }
        }
        Ok(path)
    }

    /// The newest checkpoint that is whole, passing over torn and damaged ones.
    pub fn load_newest_valid(&self) -> Newest {
        let mut skipped = Vec::new();
        for (_, path) in self.newest_first() {
            match Checkpoint::load(&path) {
                Ok(checkpoint) => return Newest { checkpoint: Some(checkpoint), skipped },
                Err(error) => skipped.push(error),
            }
        }
        Newest { checkpoint: None, skipped }
    }

    /// Files by step, the newest first.
    fn newest_first(&self) -> Vec<(u64, PathBuf)> {
        let Ok(entries) = fs::read_dir(&self.folder) else { return Vec::new() };
        let mut steps: Vec<(u64, PathBuf)> = entries
            .filter_map(|entry| {
                let entry = entry.ok()?;
                let name = entry.file_name();
                let step = name.to_str()?.strip_prefix(PREFIX)?.strip_suffix(SUFFIX)?.parse().ok()?;
                Some((step, entry.path()))
            })
            .collect();
        steps.sort_unstable_by_key(|(step, _)| std::cmp::Reverse(*step));
        steps
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;

    fn store() -> (tempfile::TempDir, CheckpointStore) {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let store = CheckpointStore::open(&folder.path().join("checkpoints")).expect("a store");
        (folder, store)
    }

    fn save(store: &CheckpointStore, step: u64, floats: &[f32]) -> PathBuf {
        let mut contents = Contents::new();
        contents.value("counters", &BTreeMap::from([("updates".to_owned(), step * 10)])).expect("a map");
        contents.floats("replay", floats);
        contents.floats("empty", &[]);
        store.save(step, &contents).expect("the disk has room")
    }

    fn steps(store: &CheckpointStore) -> Vec<u64> {
        store.newest_first().iter().map(|(_, path)| Checkpoint::load(path).expect("whole").step()).collect()
    }

    #[test]
    fn what_was_saved_comes_back() {
        let (_folder, store) = store();
        assert!(store.load_newest_valid().checkpoint.is_none());
        let floats: Vec<f32> =
            (0..100_000).map(|bits| f32::from_bits(bits * 40_009)).chain([f32::NAN, -0.0]).collect();
        save(&store, 7, &floats);
        let mut checkpoint = store.load_newest_valid().checkpoint.expect("there is one");
        assert_eq!(checkpoint.step(), 7);
        let counters: BTreeMap<String, u64> = checkpoint.value("counters").expect("it was saved");
        assert_eq!(counters["updates"], 70);
        let bits = |values: &[f32]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&checkpoint.take_floats("replay").expect("it was saved")), bits(&floats));
        assert!(checkpoint.take_floats("empty").expect("it was saved").is_empty());
        let missing = checkpoint.value::<u64>("weights").expect_err("it was not saved");
        assert!(missing.to_string().contains("weights"), "{missing}");
    }

    #[test]
    fn the_newest_three_stay_and_half_written_ones_go() {
        let (folder, store) = store();
        (1..=5).for_each(|step| drop(save(&store, step, &[0.0])));
        assert_eq!(steps(&store), [5, 4, 3]);
        let half = folder.path().join("checkpoints/.step-000000000006.ckpt.tmp");
        fs::write(&half, b"half").expect("the disk has room");
        CheckpointStore::open(half.parent().expect("a folder")).expect("a store");
        assert!(!half.exists());
        assert_eq!(steps(&store), [5, 4, 3]);
    }

    #[test]
    fn a_roll_back_ends_the_future_that_it_leaves() {
        let (_folder, store) = store();
        [10, 20, 30, 40].iter().for_each(|step| drop(save(&store, *step, &[0.0])));
        save(&store, 25, &[0.0]);
        assert_eq!(steps(&store), [25, 20]);
    }

    #[test]
    fn torn_damaged_and_foreign_files_are_passed_over() {
        let (_folder, store) = store();
        save(&store, 1, &[1.0; 1000]);
        let damage = |step, change: &dyn Fn(&mut Vec<u8>)| {
            let path = save(&store, step, &[2.0; 1000]);
            let mut bytes = fs::read(&path).expect("it was written");
            change(&mut bytes);
            fs::write(&path, bytes).expect("the disk has room");
            Checkpoint::load(&path).expect_err("it is damaged")
        };
        assert!(matches!(damage(2, &|bytes| bytes.truncate(3000)), LoadError::Torn { .. }));
        assert!(matches!(damage(2, &|bytes| bytes.push(0)), LoadError::Torn { .. }));
        assert!(matches!(damage(2, &Vec::clear), LoadError::NotACheckpoint { .. }));
        assert!(matches!(damage(2, &|bytes| bytes.truncate(20)), LoadError::Torn { .. }));
        assert!(matches!(damage(2, &|bytes| bytes[8] = 9), LoadError::Version { found: 9, .. }));
        assert!(matches!(damage(3, &|bytes| bytes[2000] ^= 1), LoadError::Checksum { .. }));
        let newest = store.load_newest_valid();
        assert_eq!(newest.checkpoint.expect("the first is whole").step(), 1);
        assert_eq!(newest.skipped.len(), 2);
    }

    #[test]
    fn no_flipped_bit_goes_unnoticed() {
        let (_folder, store) = store();
        let path = save(&store, 1, &[1.0, 2.0]);
        let bytes = fs::read(&path).expect("it was written");
        for index in 0..bytes.len() {
            let mut damaged = bytes.clone();
            damaged[index] ^= 0x10;
            fs::write(&path, damaged).expect("the disk has room");
            assert!(Checkpoint::load(&path).is_err(), "byte {index}");
        }
    }

    #[test]
    fn a_refused_write_is_an_error_and_the_next_one_works() {
        let (_folder, store) = store();
        save(&store, 1, &[1.0]);
        let obstacle = store.folder.join("step-000000000002.ckpt");
        fs::create_dir(&obstacle).expect("a folder where the file should go");
        let mut contents = Contents::new();
        contents.floats("replay", &[2.0]);
        let error = store.save(2, &contents).expect_err("the path is taken");
        assert!(error.to_string().contains("step-000000000002"), "{error}");
        fs::remove_dir(&obstacle).expect("it is empty");
        assert_eq!(steps(&store), [1]);
        store.save(2, &contents).expect("the path is free");
        assert_eq!(steps(&store), [2, 1]);
    }
}
