//! Emptying the processor's caches.

use std::fs;
use std::hint::black_box;

/// When the system does not tell its last cache.
const ASSUMED_BYTES: usize = 64 << 20;
/// A sum of all caches of a large server; more is not worth the time.
const MAX_BYTES: usize = 512 << 20;
const LINE_BYTES: usize = 64;

/// A buffer twice as large as the last cache.
#[derive(Debug)]
pub(super) struct Caches {
    buffer: Vec<u8>,
    last_bytes: usize,
}

impl Caches {
    pub(super) fn new() -> Self {
        let last_bytes = last_cache_bytes().unwrap_or(ASSUMED_BYTES).clamp(1 << 20, MAX_BYTES / 2);
        Self { buffer: vec![1; 2 * last_bytes], last_bytes }
    }

    /// Size of the last cache, bytes.
    pub(super) fn last_bytes(&self) -> usize {
        self.last_bytes
    }

    /// Writes one byte of every line of the buffer, which pushes everything else out.
    pub(super) fn empty(&mut self) {
        for byte in self.buffer.iter_mut().step_by(LINE_BYTES) {
            *byte = byte.wrapping_add(1);
        }
        black_box(&self.buffer);
    }
}

/// The largest cache of the first core, as Linux tells it.
fn last_cache_bytes() -> Option<usize> {
    let entries = fs::read_dir("/sys/devices/system/cpu/cpu0/cache").ok()?;
    let size = |path: std::path::PathBuf| parse_size(fs::read_to_string(path.join("size")).ok()?.trim());
    entries.flatten().filter_map(|entry| size(entry.path())).max()
}

/// `32768K` or `32M` in bytes.
fn parse_size(text: &str) -> Option<usize> {
    let (number, unit) = match text.strip_suffix('K') {
        Some(number) => (number, 1 << 10),
        None => (text.strip_suffix('M')?, 1 << 20),
    };
    number.parse::<usize>().ok()?.checked_mul(unit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_read_as_the_kernel_writes_them() {
        assert_eq!(parse_size("32768K"), Some(32 << 20));
        assert_eq!(parse_size("32M"), Some(32 << 20));
        assert_eq!(parse_size("many"), None);
    }
}
