//! A reference-counted pointer whose small values live in a fixed slab instead of the heap.
//!
//! iceoryx2 makes one such value for each loaned sample. Values larger than a block (the ports themselves,
//! made at start-up) go to the heap.

use iceoryx2_bb_elementary_traits::testing::abandonable::Abandonable;
use iceoryx2_cal::arc_sync_policy::{ArcSyncPolicy, ArcSyncPolicyCreationError, LockGuard};
use std::cell::{Cell, UnsafeCell};
use std::fmt::Debug;
use std::marker::PhantomData;
use std::mem::MaybeUninit;
use std::ops::Deref;
use std::ptr::NonNull;
use std::sync::atomic::{AtomicU64, Ordering};

/// Size and alignment of a block, bytes: a cache line.
const BLOCK_BYTES: usize = 64;
/// Words of the bitmap; each stands for 64 blocks. A port has at most two samples on loan, so this is plenty.
const WORDS: usize = 4;

#[repr(C, align(64))]
struct Block(UnsafeCell<MaybeUninit<[u8; BLOCK_BYTES]>>);

struct Slab {
    /// A set bit is a block in use.
    used: [AtomicU64; WORDS],
    blocks: [Block; WORDS * 64],
}

// SAFETY: a block is only touched by whoever won its bit in `used`.
unsafe impl Sync for Slab {}

static SLAB: Slab = Slab {
    used: [const { AtomicU64::new(0) }; WORDS],
    blocks: [const { Block(UnsafeCell::new(MaybeUninit::uninit())) }; WORDS * 64],
};

impl Slab {
    /// A free block, or nothing when all are in use. Lock-free.
    fn take(&self) -> Option<NonNull<u8>> {
        for (word_index, word) in self.used.iter().enumerate() {
            let mut used = word.load(Ordering::Relaxed);
            while used != u64::MAX {
                let bit = used.trailing_ones();
                match word.compare_exchange_weak(used, used | 1 << bit, Ordering::Acquire, Ordering::Relaxed)
                {
                    Ok(_) => {
                        let block = &self.blocks[word_index * 64 + bit as usize];
                        return NonNull::new(block.0.get().cast());
                    }
                    Err(now) => used = now,
                }
            }
        }
        None
    }

    /// Gives a block back.
    ///
    /// # Safety
    /// `block` came from [`Self::take`] and is not used any more.
    unsafe fn give_back(&self, block: NonNull<u8>) {
        let index = (block.as_ptr() as usize - self.blocks.as_ptr() as usize) / BLOCK_BYTES;
        self.used[index / 64].fetch_and(!(1 << (index % 64)), Ordering::Release);
    }
}

struct Counted<T> {
    count: Cell<usize>,
    value: T,
}

impl<T> Counted<T> {
    const IN_SLAB: bool = size_of::<Self>() <= BLOCK_BYTES && align_of::<Self>() <= BLOCK_BYTES;
}

/// An `Rc` on the slab. Like an `Rc` it stays in its thread.
pub struct SlabRc<T: Send + Debug + Abandonable> {
    counted: NonNull<Counted<T>>,
    _owns: PhantomData<Counted<T>>,
}

impl<T: Send + Debug + Abandonable> SlabRc<T> {
    fn counted(&self) -> &Counted<T> {
        // SAFETY: alive as long as any `SlabRc` points to it; only `abandon_in_place`, which ends the last use,
        // ever makes a mutable reference.
        unsafe { self.counted.as_ref() }
    }
}

impl<T: Send + Debug + Abandonable> Clone for SlabRc<T> {
    fn clone(&self) -> Self {
        let count = &self.counted().count;
        count.set(count.get() + 1);
        Self { counted: self.counted, _owns: PhantomData }
    }
}

impl<T: Send + Debug + Abandonable> Drop for SlabRc<T> {
    fn drop(&mut self) {
        let count = &self.counted().count;
        count.set(count.get() - 1);
        if count.get() > 0 {
            return;
        }
        if Counted::<T>::IN_SLAB {
            // SAFETY: this was the last pointer; the block came from the slab because the type fits.
            unsafe {
                self.counted.drop_in_place();
                SLAB.give_back(self.counted.cast());
            }
        } else {
            // SAFETY: this was the last pointer, and it came from a box because the type does not fit a block.
            drop(unsafe { Box::from_raw(self.counted.as_ptr()) });
        }
    }
}

impl<T: Send + Debug + Abandonable> Debug for SlabRc<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("SlabRc").field(&self.counted().value).finish()
    }
}

impl<T: Send + Debug + Abandonable> Abandonable for SlabRc<T> {
    unsafe fn abandon_in_place(mut this: NonNull<Self>) {
        // SAFETY: the caller passes a valid value that is not used afterwards.
        let this = unsafe { this.as_mut() };
        if this.counted().count.get() == 1 {
            // SAFETY: the only pointer to the value, as counted.
            let value = unsafe { &mut this.counted.as_mut().value };
            // SAFETY: valid, and not used afterwards.
            unsafe { T::abandon_in_place(NonNull::from(value)) };
        } else {
            // SAFETY: the caller forgets `this`, so it is dropped once.
            unsafe { std::ptr::drop_in_place(this) };
        }
    }
}

/// Access to the value, as long as the pointer lives.
pub struct Borrowed<'parent, T>(&'parent T);

impl<T> Deref for Borrowed<'_, T> {
    type Target = T;
    fn deref(&self) -> &T {
        self.0
    }
}

impl<'parent, T: Send + Debug + Abandonable> LockGuard<'parent, T> for Borrowed<'parent, T> {}

impl<T: Send + Debug + Abandonable> ArcSyncPolicy<T> for SlabRc<T> {
    type LockGuard<'parent>
        = Borrowed<'parent, T>
    where
        Self: 'parent,
        T: 'parent;

    fn new(value: T) -> Result<Self, ArcSyncPolicyCreationError> {
        let new = Counted { count: Cell::new(1), value };
        let counted = if Counted::<T>::IN_SLAB {
            let block = SLAB.take().ok_or(ArcSyncPolicyCreationError::InsufficientResources)?.cast();
            // SAFETY: a block of our own, large and aligned enough as `IN_SLAB` says.
            unsafe { block.write(new) };
            block
        } else {
            NonNull::from(Box::leak(Box::new(new)))
        };
        Ok(Self { counted, _owns: PhantomData })
    }

    fn lock(&self) -> Borrowed<'_, T> {
        Borrowed(&self.counted().value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    #[derive(Debug)]
    struct Probe<const BYTES: usize> {
        alive: Arc<()>,
        _bulk: [u8; BYTES],
    }

    impl<const BYTES: usize> Abandonable for Probe<BYTES> {
        unsafe fn abandon_in_place(_: NonNull<Self>) {}
    }

    fn drops_once<const BYTES: usize>() {
        let alive = Arc::new(());
        let first = SlabRc::new(Probe { alive: alive.clone(), _bulk: [7; BYTES] }).expect("room in the slab");
        let second = first.clone();
        drop(first);
        assert_eq!(Arc::strong_count(&second.lock().alive), 2, "one pointer is left");
        drop(second);
        assert_eq!(Arc::strong_count(&alive), 1, "the value is gone");
    }

    #[test]
    fn small_and_large_values_are_dropped_once() {
        const { assert!(Counted::<Probe<8>>::IN_SLAB && !Counted::<Probe<200>>::IN_SLAB) };
        drops_once::<8>();
        drops_once::<200>();
    }

    #[test]
    fn a_full_slab_refuses_and_recovers() {
        let slab = Box::new(Slab {
            used: [const { AtomicU64::new(0) }; WORDS],
            blocks: [const { Block(UnsafeCell::new(MaybeUninit::uninit())) }; WORDS * 64],
        });
        let taken: Vec<_> = std::iter::from_fn(|| slab.take()).collect();
        assert_eq!(taken.len(), WORDS * 64);
        // SAFETY: taken above, used by nobody.
        unsafe { slab.give_back(taken[130]) };
        assert_eq!(slab.take(), Some(taken[130]));
        assert_eq!(slab.take(), None);
    }
}
