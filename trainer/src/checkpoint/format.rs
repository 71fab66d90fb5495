//! The bytes of a checkpoint file.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufReader, Read, Write};
use std::path::{Path, PathBuf};

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::load_error::LoadError;

const MAGIC: [u8; 8] = *b"HNAVCKPT";
/// Rises whenever anything that a checkpoint or a policy keeps changes its shape.
pub(super) const VERSION: u32 = 7;
/// Magic, version, number of sections, step, length of the body.
const HEADER_BYTES: u64 = 8 + 4 + 4 + 8 + 8;
/// The CRC-32 at the end.
const TRAILER_BYTES: u64 = 4;
/// Values converted at a time when a slice of `f32` is written or read.
const CHUNK: usize = 16 * 1024;

enum Data<'a> {
    Value(Vec<u8>),
    Floats(&'a [f32]),
}

/// What is to be saved, section by section. Float slices are borrowed until they are written.
#[derive(Default)]
pub struct Contents<'a> {
    sections: Vec<(&'a str, Data<'a>)>,
}

impl<'a> Contents<'a> {
    /// Nothing yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a value.
    ///
    /// # Errors
    /// When the value cannot be serialised, which is a mistake in its type (a sequence of unknown length).
    pub fn value(&mut self, name: &'a str, value: &impl Serialize) -> Result<(), postcard::Error> {
        self.sections.push((name, Data::Value(postcard::to_stdvec(value)?)));
        Ok(())
    }

    /// Adds a slice of numbers, written as they are.
    pub fn floats(&mut self, name: &'a str, values: &'a [f32]) {
        self.sections.push((name, Data::Floats(values)));
    }

    /// Writes the whole file.
    pub fn write_to(&self, step: u64, file: &mut impl Write) -> io::Result<()> {
        let mut out = Checked { inner: file, crc: crc32fast::Hasher::new() };
        let body: u64 = self.sections.iter().map(|(name, data)| section_bytes(name, data)).sum();
        out.write_all(&MAGIC)?;
        out.write_all(&VERSION.to_le_bytes())?;
        out.write_all(&(self.sections.len() as u32).to_le_bytes())?;
        out.write_all(&step.to_le_bytes())?;
        out.write_all(&body.to_le_bytes())?;
        for (name, data) in &self.sections {
            let (kind, length) = match data {
                Data::Value(bytes) => (0, bytes.len()),
                Data::Floats(values) => (1, size_of_val(*values)),
            };
            out.write_all(&[kind])?;
            out.write_all(&(name.len() as u32).to_le_bytes())?;
            out.write_all(name.as_bytes())?;
            out.write_all(&(length as u64).to_le_bytes())?;
            match data {
                Data::Value(bytes) => out.write_all(bytes)?,
                Data::Floats(values) => write_floats(&mut out, values)?,
            }
        }
        let crc = out.crc.finalize();
        file.write_all(&crc.to_le_bytes())
    }
}

fn section_bytes(name: &str, data: &Data<'_>) -> u64 {
    let length = match data {
        Data::Value(bytes) => bytes.len(),
        Data::Floats(values) => size_of_val(*values),
    };
    (1 + 4 + name.len() + 8 + length) as u64
}

fn write_floats(out: &mut impl Write, values: &[f32]) -> io::Result<()> {
    let mut bytes = vec![0; 4 * CHUNK];
    for chunk in values.chunks(CHUNK) {
        let bytes = &mut bytes[..size_of_val(chunk)];
        for (bytes, value) in bytes.as_chunks_mut().0.iter_mut().zip(chunk) {
            *bytes = value.to_le_bytes();
        }
        out.write_all(bytes)?;
    }
    Ok(())
}

/// Sums up what passes through.
struct Checked<'a, T> {
    inner: &'a mut T,
    crc: crc32fast::Hasher,
}

impl<T: Write> Write for Checked<'_, T> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.inner.write(bytes)?;
        self.crc.update(&bytes[..written]);
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.inner.flush()
    }
}

impl<T: Read> Read for Checked<'_, T> {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        let read = self.inner.read(bytes)?;
        self.crc.update(&bytes[..read]);
        Ok(read)
    }
}

/// A checkpoint in memory, whole and checked.
#[derive(Debug)]
pub struct Checkpoint {
    path: PathBuf,
    step: u64,
    values: BTreeMap<String, Vec<u8>>,
    floats: BTreeMap<String, Vec<f32>>,
}

impl Checkpoint {
    /// Reads and checks a file.
    ///
    /// # Errors
    /// When it cannot be read, is no checkpoint, or is not whole.
    pub fn load(path: &Path) -> Result<Self, LoadError> {
        let io = |source| LoadError::Io { path: path.to_owned(), source };
        let file = File::open(path).map_err(io)?;
        let found = file.metadata().map_err(io)?.len();
        let mut file = BufReader::with_capacity(1 << 20, file);
        let mut input = Checked { inner: &mut file, crc: crc32fast::Hasher::new() };
        let not_ours = || LoadError::NotACheckpoint { path: path.to_owned() };
        if array(&mut input).map_err(|_| not_ours())? != MAGIC {
            return Err(not_ours());
        }
        let torn = |expected| LoadError::Torn { path: path.to_owned(), found, expected };
        if found < HEADER_BYTES + TRAILER_BYTES {
            return Err(torn(HEADER_BYTES + TRAILER_BYTES));
        }
        let version = u32::from_le_bytes(array(&mut input).map_err(io)?);
        if version != VERSION {
            return Err(LoadError::Version { path: path.to_owned(), found: version });
        }
        let sections = u32::from_le_bytes(array(&mut input).map_err(io)?);
        let step = u64::from_le_bytes(array(&mut input).map_err(io)?);
        let body = u64::from_le_bytes(array(&mut input).map_err(io)?);
        let expected = body.saturating_add(HEADER_BYTES + TRAILER_BYTES);
        if expected != found {
            return Err(torn(expected));
        }
        let damaged = || LoadError::Checksum { path: path.to_owned() };
        let mut checkpoint =
            Self { path: path.to_owned(), step, values: BTreeMap::new(), floats: BTreeMap::new() };
        let mut left = body;
        for _ in 0..sections {
            checkpoint.read_section(&mut input, &mut left).map_err(io)?.ok_or_else(damaged)?;
        }
        let crc = input.crc.finalize();
        let matches = left == 0 && crc == u32::from_le_bytes(array(&mut file).map_err(io)?);
        if matches { Ok(checkpoint) } else { Err(damaged()) }
    }

    /// Reads one section of at most `left` bytes; nothing when its lengths make no sense.
    fn read_section(&mut self, input: &mut impl Read, left: &mut u64) -> io::Result<Option<()>> {
        let mut take = |length: u64| {
            let fits = length <= *left;
            *left -= if fits { length } else { 0 };
            fits
        };
        if !take(1 + 4) {
            return Ok(None);
        }
        let [kind] = array(input)?;
        let name_length = u32::from_le_bytes(array(input)?);
        if !take(u64::from(name_length)) {
            return Ok(None);
        }
        let mut name = vec![0; name_length as usize];
        input.read_exact(&mut name)?;
        if !take(8) {
            return Ok(None);
        }
        let length = u64::from_le_bytes(array(input)?);
        let Ok(name) = String::from_utf8(name) else { return Ok(None) };
        if !take(length) {
            return Ok(None);
        }
        let length = length as usize;
        match kind {
            0 => {
                let mut bytes = vec![0; length];
                input.read_exact(&mut bytes)?;
                self.values.insert(name, bytes);
            }
            1 if length.is_multiple_of(4) => {
                self.floats.insert(name, read_floats(input, length / 4)?);
            }
            _ => return Ok(None),
        }
        Ok(Some(()))
    }

    /// The step it was saved at.
    pub fn step(&self) -> u64 {
        self.step
    }

    /// The file it came from.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Whether there is a value of that name.
    pub fn has(&self, name: &str) -> bool {
        self.values.contains_key(name)
    }

    /// A value.
    ///
    /// # Errors
    /// When there is none of that name, or it is of another type.
    pub fn value<T: DeserializeOwned>(&self, name: &str) -> Result<T, LoadError> {
        let bytes = self.values.get(name).ok_or_else(|| self.missing(name))?;
        postcard::from_bytes(bytes).map_err(|_| self.missing(name))
    }

    /// Takes a slice of numbers out.
    ///
    /// # Errors
    /// When there is none of that name (any more).
    pub fn take_floats(&mut self, name: &str) -> Result<Vec<f32>, LoadError> {
        self.floats.remove(name).ok_or_else(|| self.missing(name))
    }

    fn missing(&self, name: &str) -> LoadError {
        LoadError::Section { path: self.path.clone(), name: name.to_owned() }
    }
}

fn array<const N: usize>(input: &mut impl Read) -> io::Result<[u8; N]> {
    let mut bytes = [0; N];
    input.read_exact(&mut bytes)?;
    Ok(bytes)
}

fn read_floats(input: &mut impl Read, count: usize) -> io::Result<Vec<f32>> {
    let mut values = Vec::with_capacity(count);
    let mut bytes = vec![0; 4 * CHUNK];
    while values.len() < count {
        let part = CHUNK.min(count - values.len());
        let bytes = &mut bytes[..4 * part];
        input.read_exact(bytes)?;
        values.extend(bytes.as_chunks().0.iter().map(|bytes| f32::from_le_bytes(*bytes)));
    }
    Ok(values)
}
