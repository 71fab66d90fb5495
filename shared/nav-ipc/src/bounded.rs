//! The shared memory of connections, with an end to every wait.
//!
//! A connection is made by whichever of its two ports comes first, and by iceoryx2's rules a port makes all of its own
//! before others can see it. So what a running loop opens is finished, with one exception: two ports that appear at the same
//! moment see each other only afterwards, and then each makes the connection or opens what the other is making. (Programs
//! of this crate never do: their starts take turns. Programs of other languages may.) If the other is killed after it has made
//! the file and before it has given it a size, iceoryx2 waits for that size for ever, whatever time-out it is given, and
//! a loop with it. Here the wait ends after [`WAIT_MAX`], and [`expect_whole`] names the file.
//!
//! Names, contents and order are iceoryx2's own: the other side may be a stock peer.

use crate::error::IpcError;
use crate::leftovers::{self, SHARED_MEMORY};
use iceoryx2::prelude::{FileName, Path};
use iceoryx2_bb_elementary_traits::{testing::abandonable::Abandonable, zero_copy_send::ZeroCopySend};
use iceoryx2_bb_memory::bump_allocator::BumpAllocator;
use iceoryx2_bb_posix::file::AccessMode;
use iceoryx2_cal::dynamic_storage::posix_shared_memory::{Builder, Configuration, Storage};
use iceoryx2_cal::dynamic_storage::{
    DynamicStorage, DynamicStorageBuilder, DynamicStorageCreateError, DynamicStorageOpenError,
    DynamicStorageOpenOrCreateError,
};
use iceoryx2_cal::named_concept::{
    NamedConcept, NamedConceptBuilder, NamedConceptConfiguration, NamedConceptDoesExistError,
    NamedConceptListError, NamedConceptMgmt, NamedConceptPathHintRemoveError, NamedConceptRemoveError,
};
use iceoryx2_cal::zero_copy_connection::common::details::{self, SharedManagementData};
use std::cell::RefCell;
use std::fmt::Debug;
use std::mem::MaybeUninit;
use std::path::PathBuf;
use std::ptr::NonNull;
use std::time::{Duration, Instant};

/// Longer than any living process takes to make a connection (microseconds), and a fifth of the shortest control period
/// (20 Hz).
pub(crate) const WAIT_MAX: Duration = Duration::from_millis(10);
/// Between two looks.
const GLANCE: Duration = Duration::from_millis(1);

/// What every port of this crate connects by.
pub(crate) type Connection = details::Connection<Bounded<SharedManagementData>>;

thread_local! {
    /// The newest file of this thread that did not get finished.
    static UNFINISHED: RefCell<Option<PathBuf>> = const { RefCell::new(None) };
}

/// Whether all connections of this thread could be made; to be asked after whatever may have connected.
///
/// # Errors
/// [`IpcError::HalfMade`], once for each that could not. Its other side is deaf to us.
pub(crate) fn expect_whole() -> Result<(), IpcError> {
    UNFINISHED.with_borrow_mut(Option::take).map_or(Ok(()), |path| Err(leftovers::is_half_made(path)))
}

/// iceoryx2's shared memory; only how it is opened differs.
#[derive(Debug)]
pub struct Bounded<T: Debug + Send + Sync + ZeroCopySend>(Storage<T>);

/// See [`Bounded`].
#[derive(Debug)]
pub struct BoundedBuilder<'a, T: Debug + Send + Sync + ZeroCopySend> {
    inner: Builder<'a, T>,
    name: FileName,
    config: Configuration<T>,
}

impl<T: Debug + Send + Sync + ZeroCopySend> BoundedBuilder<'_, T> {
    /// Waits until the file has a size, and gives the time that is left. It never loses it again.
    fn wait_for_size(&self) -> Result<Duration, DynamicStorageOpenError> {
        let path = self.path();
        let began = Instant::now();
        loop {
            let Ok(metadata) = std::fs::metadata(&path) else {
                return Err(DynamicStorageOpenError::DoesNotExist);
            };
            let left = WAIT_MAX.saturating_sub(began.elapsed());
            if metadata.len() > 0 {
                return Ok(left);
            }
            if left.is_zero() {
                return Err(DynamicStorageOpenError::InitializationNotYetFinalized);
            }
            std::thread::sleep(GLANCE);
        }
    }

    fn path(&self) -> PathBuf {
        PathBuf::from(SHARED_MEMORY).join(self.config.path_for(&self.name).file_name().to_string())
    }

    fn open_soon(self, access_mode: AccessMode) -> Result<Bounded<T>, DynamicStorageOpenError> {
        let opened = self.wait_for_size().and_then(|left| {
            let builder = <Builder<'_, T> as NamedConceptBuilder<Storage<T>>>::new(&self.name);
            NamedConceptBuilder::<Storage<T>>::config(builder, &self.config).timeout(left).open(access_mode)
        });
        if let Err(DynamicStorageOpenError::InitializationNotYetFinalized) = &opened {
            UNFINISHED.set(Some(self.path()));
        }
        opened.map(Bounded)
    }
}

impl<T: Debug + Send + Sync + ZeroCopySend> NamedConceptBuilder<Bounded<T>> for BoundedBuilder<'_, T> {
    fn new(name: &FileName) -> Self {
        let inner = <Builder<'_, T> as NamedConceptBuilder<Storage<T>>>::new(name);
        Self { inner, name: *name, config: Configuration::default() }
    }

    fn config(mut self, config: &Configuration<T>) -> Self {
        self.inner = NamedConceptBuilder::<Storage<T>>::config(self.inner, config);
        self.config = config.clone();
        self
    }
}

impl<'a, T: Debug + Send + Sync + ZeroCopySend> DynamicStorageBuilder<'a, T, Bounded<T>>
    for BoundedBuilder<'a, T>
{
    fn has_ownership(mut self, value: bool) -> Self {
        self.inner = self.inner.has_ownership(value);
        self
    }

    fn enable_global_access(mut self, value: bool) -> Self {
        self.inner = self.inner.enable_global_access(value);
        self
    }

    fn supplementary_size(mut self, value: usize) -> Self {
        self.inner = self.inner.supplementary_size(value);
        self
    }

    /// Nobody waits longer than [`WAIT_MAX`], whatever is asked for.
    fn timeout(self, _value: Duration) -> Self {
        self
    }

    fn initializer<F: FnMut(&mut MaybeUninit<T>, &mut BumpAllocator) -> bool + 'a>(
        mut self,
        value: F,
    ) -> Self {
        self.inner = self.inner.initializer(value);
        self
    }

    fn create(self) -> Result<Bounded<T>, DynamicStorageCreateError> {
        self.inner.create().map(Bounded)
    }

    fn open(self, access_mode: AccessMode) -> Result<Bounded<T>, DynamicStorageOpenError> {
        self.open_soon(access_mode)
    }

    fn open_or_create(self) -> Result<Bounded<T>, DynamicStorageOpenOrCreateError> {
        // Created first and then opened, so that nothing is opened whose size was not seen.
        let again = Self {
            inner: <Builder<'a, T> as NamedConceptBuilder<Storage<T>>>::new(&self.name),
            name: self.name,
            config: self.config.clone(),
        };
        match self.inner.create() {
            Ok(storage) => Ok(Bounded(storage)),
            Err(DynamicStorageCreateError::AlreadyExists) => Ok(again.open_soon(AccessMode::ReadWrite)?),
            Err(error) => Err(error.into()),
        }
    }
}

impl<T: Debug + Send + Sync + ZeroCopySend> Abandonable for Bounded<T> {
    unsafe fn abandon_in_place(this: NonNull<Self>) {
        // SAFETY: what is asked of `this` holds for what it consists of.
        unsafe { Storage::abandon_in_place(this.cast::<Storage<T>>()) }
    }
}

impl<T: Debug + Send + Sync + ZeroCopySend> NamedConcept for Bounded<T> {
    fn name(&self) -> &FileName {
        self.0.name()
    }
}

impl<T: Debug + Send + Sync + ZeroCopySend> NamedConceptMgmt for Bounded<T> {
    type Configuration = Configuration<T>;

    unsafe fn remove_cfg(
        name: &FileName,
        config: &Self::Configuration,
    ) -> Result<bool, NamedConceptRemoveError> {
        // SAFETY: as asked of this.
        unsafe { Storage::<T>::remove_cfg(name, config) }
    }

    fn does_exist_cfg(
        name: &FileName,
        config: &Self::Configuration,
    ) -> Result<bool, NamedConceptDoesExistError> {
        Storage::<T>::does_exist_cfg(name, config)
    }

    fn list_cfg(config: &Self::Configuration) -> Result<Vec<FileName>, NamedConceptListError> {
        Storage::<T>::list_cfg(config)
    }

    fn remove_path_hint(path: &Path) -> Result<(), NamedConceptPathHintRemoveError> {
        Storage::<T>::remove_path_hint(path)
    }
}

impl<T: Debug + Send + Sync + ZeroCopySend> DynamicStorage<T> for Bounded<T> {
    type Builder<'a> = BoundedBuilder<'a, T>;

    fn does_support_persistency() -> bool {
        Storage::<T>::does_support_persistency()
    }

    fn has_ownership(&self) -> bool {
        self.0.has_ownership()
    }

    fn release_ownership(&self) {
        self.0.release_ownership();
    }

    fn acquire_ownership(&self) {
        self.0.acquire_ownership();
    }

    fn get(&self) -> &T {
        self.0.get()
    }

    unsafe fn __internal_set_type_name_in_config(config: &mut Self::Configuration, type_name: &str) {
        // SAFETY: as asked of this.
        unsafe { Storage::<T>::__internal_set_type_name_in_config(config, type_name) }
    }
}
