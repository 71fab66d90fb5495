//! Memory for weights that costs few translations: one mapping aligned to a huge page.
#![allow(unsafe_code, reason = "maps and unmaps memory")]

use std::io;
use std::ptr::NonNull;

/// A huge page of x86-64 and 64-bit Arm with 4 KiB pages.
const HUGE_PAGE_BYTES: usize = 2 << 20;

/// A fixed slice of `f32`, zeroed, aligned to 2 MiB, on huge pages where the system grants them.
///
/// On a robot that ticks 20 times a second the caches are cold in every tick; with its weights on one huge page a network needs
/// one address translation instead of one every 4 KiB.
#[derive(Debug)]
pub struct Arena {
    mapping: NonNull<libc::c_void>,
    mapping_bytes: usize,
    floats: NonNull<f32>,
    len: usize,
}

// SAFETY: the arena owns its mapping alone and hands it out by the usual borrow rules only.
unsafe impl Send for Arena {}
// SAFETY: as above.
unsafe impl Sync for Arena {}

impl Arena {
    /// Maps `len` floats.
    ///
    /// # Errors
    /// When the system has no memory left, or the size overflows.
    pub fn new(len: usize) -> io::Result<Self> {
        let bytes = len
            .checked_mul(size_of::<f32>())
            .and_then(|bytes| bytes.max(1).checked_next_multiple_of(HUGE_PAGE_BYTES))
            .filter(|bytes| *bytes < isize::MAX as usize / 2)
            .ok_or(io::ErrorKind::OutOfMemory)?;
        // One huge page more, so that an aligned start lies inside.
        let mapping_bytes = bytes + HUGE_PAGE_BYTES;
        let protection = libc::PROT_READ | libc::PROT_WRITE;
        // SAFETY: asks for fresh anonymous memory; no existing mapping is touched.
        let mapping = unsafe {
            libc::mmap(
                std::ptr::null_mut(),
                mapping_bytes,
                protection,
                libc::MAP_PRIVATE | libc::MAP_ANONYMOUS,
                -1,
                0,
            )
        };
        if mapping == libc::MAP_FAILED {
            return Err(io::Error::last_os_error());
        }
        let to_aligned = mapping.addr().next_multiple_of(HUGE_PAGE_BYTES) - mapping.addr();
        // SAFETY: `to_aligned` is less than a huge page, by which the mapping is larger than `bytes`.
        let start = unsafe { mapping.byte_add(to_aligned) };
        // A refusal only means ordinary pages.
        // SAFETY: the range lies inside the mapping.
        unsafe { libc::madvise(start, bytes, libc::MADV_HUGEPAGE) };
        let (Some(mapping), Some(floats)) = (NonNull::new(mapping), NonNull::new(start.cast::<f32>())) else {
            return Err(io::ErrorKind::OutOfMemory.into());
        };
        Ok(Self { mapping, mapping_bytes, floats, len })
    }
}

impl AsRef<[f32]> for Arena {
    fn as_ref(&self) -> &[f32] {
        // SAFETY: `len` floats lie in the mapping, are initialised (zeroed by the system), and live as long as `self`.
        unsafe { std::slice::from_raw_parts(self.floats.as_ptr(), self.len) }
    }
}

impl AsMut<[f32]> for Arena {
    fn as_mut(&mut self) -> &mut [f32] {
        // SAFETY: as in `as_ref`, and `self` is borrowed mutably.
        unsafe { std::slice::from_raw_parts_mut(self.floats.as_ptr(), self.len) }
    }
}

impl Drop for Arena {
    fn drop(&mut self) {
        // SAFETY: the mapping was made by `new` with this length, and no slice of it outlives `self`.
        unsafe { libc::munmap(self.mapping.as_ptr(), self.mapping_bytes) };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn is_zeroed_aligned_and_writable_to_its_end() {
        for len in [0, 1, 600_000] {
            let mut arena = Arena::new(len).unwrap();
            assert_eq!(arena.as_ref().len(), len);
            assert_eq!(arena.as_ref().as_ptr().addr() % HUGE_PAGE_BYTES, 0);
            assert!(arena.as_ref().iter().all(|x| x.to_bits() == 0));
            arena.as_mut().fill(1.0);
            assert!((arena.as_ref().iter().sum::<f32>() - len as f32).abs() < 1.0);
        }
        assert!(Arena::new(usize::MAX).is_err());
    }
}
