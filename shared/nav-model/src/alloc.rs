//! A global allocator that proves a piece of code does not allocate.
//!
//! [`CheckedAllocator`] passes everything on to the system allocator. Inside [`count`] it counts what the current thread does;
//! while a [`Forbidden`] guard lives it aborts the process with a backtrace at the first allocation or release, because a
//! robot that allocates in its loop has already lost its timing proof.
//!
//! A program installs it once; nothing is checked without that, and [`is_installed`] tells:
//!
//! ```
//! use nav_model::alloc::{self, CheckedAllocator};
//!
//! #[global_allocator]
//! static ALLOCATOR: CheckedAllocator = CheckedAllocator;
//!
//! assert!(alloc::is_installed());
//! let (_, counts) = alloc::count(|| Box::new(1));
//! assert_eq!((counts.allocations, counts.frees), (1, 0));
//! ```
//!
//! **What it does not see:** memory that C code takes with `malloc` (ONNX Runtime, libc itself), `mmap`, and other threads.
//! For C, count once with an `LD_PRELOAD` library; for page faults, lock the memory.

use std::alloc::{GlobalAlloc, Layout, System};
use std::backtrace::Backtrace;
use std::cell::Cell;
use std::marker::PhantomData;

/// The allocator to install with `#[global_allocator]`.
#[derive(Clone, Copy, Debug, Default)]
pub struct CheckedAllocator;

/// What a thread did with the heap.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Allocations and reallocations.
    pub allocations: u64,
    /// Releases.
    pub frees: u64,
}

thread_local! {
    // Constant and without destructor: touching them never allocates.
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
    static FREES: Cell<u64> = const { Cell::new(0) };
    static FORBIDDEN_DEPTH: Cell<u32> = const { Cell::new(0) };
}

/// Runs `work` and counts what this thread allocates and releases in it. Nests.
pub fn count<R>(work: impl FnOnce() -> R) -> (R, Counts) {
    let before = so_far();
    let result = work();
    let after = so_far();
    let counts =
        Counts { allocations: after.allocations - before.allocations, frees: after.frees - before.frees };
    (result, counts)
}

/// Forbids this thread to allocate or release until the guard is dropped. Nests.
#[must_use = "allocation is allowed again as soon as the guard is dropped"]
pub fn forbid() -> Forbidden {
    FORBIDDEN_DEPTH.set(FORBIDDEN_DEPTH.get() + 1);
    Forbidden { not_send: PhantomData }
}

/// Runs `work` with allocation allowed inside a forbidden section, for what is rare and known, like a reconnect.
pub fn permit<R>(work: impl FnOnce() -> R) -> R {
    struct Restore(u32);
    impl Drop for Restore {
        fn drop(&mut self) {
            FORBIDDEN_DEPTH.set(self.0);
        }
    }
    let _restore = Restore(FORBIDDEN_DEPTH.replace(0));
    work()
}

/// Whether this program runs on [`CheckedAllocator`], seen by allocating once.
pub fn is_installed() -> bool {
    let ((), counts) = permit(|| count(|| drop(std::hint::black_box(Box::new(0_u8)))));
    counts.allocations > 0
}

/// A section of this thread that must not allocate; made by [`forbid`].
#[derive(Debug)]
pub struct Forbidden {
    /// The section belongs to the thread that opened it.
    not_send: PhantomData<*const ()>,
}

impl Drop for Forbidden {
    fn drop(&mut self) {
        FORBIDDEN_DEPTH.set(FORBIDDEN_DEPTH.get().saturating_sub(1));
    }
}

fn so_far() -> Counts {
    Counts { allocations: ALLOCATIONS.get(), frees: FREES.get() }
}

fn note(counter: &'static std::thread::LocalKey<Cell<u64>>, what: &str, bytes: usize) {
    // A thread that is being torn down may have lost its locals; it is past its loop.
    let _ = counter.try_with(|counter| counter.set(counter.get() + 1));
    let forbidden = FORBIDDEN_DEPTH.try_with(|depth| depth.replace(0)).unwrap_or(0);
    if forbidden > 0 {
        // The depth is zero from here on, so that the report itself may allocate.
        eprintln!(
            "{what} of {bytes} bytes in a section that must not touch the heap\n{}",
            Backtrace::force_capture()
        );
        std::process::abort();
    }
}

// SAFETY: every call is passed unchanged to the system allocator; the notes beside it touch thread-local cells only.
unsafe impl GlobalAlloc for CheckedAllocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        note(&ALLOCATIONS, "allocation", layout.size());
        // SAFETY: the caller's promises are passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        note(&ALLOCATIONS, "allocation", layout.size());
        // SAFETY: the caller's promises are passed on.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, new_size: usize) -> *mut u8 {
        note(&ALLOCATIONS, "reallocation", new_size);
        // SAFETY: the caller's promises are passed on.
        unsafe { System.realloc(pointer, layout, new_size) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        note(&FREES, "release", layout.size());
        // SAFETY: the caller's promises are passed on.
        unsafe { System.dealloc(pointer, layout) }
    }
}
