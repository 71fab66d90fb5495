//! iceoryx2's `ipc::Service` with two differences inside this process: what a loan needs comes from a fixed slab, and
//! connecting never waits for long (see `bounded.rs`).
//!
//! Stock services allocate 48 bytes for each message sent, because the state of a loaned sample is counted by
//! an `Rc`. Everything that other processes see is the same type as in `ipc::Service`, so both interoperate;
//! a test holds them to it. The traits used here are public but hidden, therefore iceoryx2 is pinned exactly.

use crate::slab::SlabRc;
use iceoryx2::service::internal::ServiceInternal;
use iceoryx2_bb_elementary_traits::testing::abandonable::Abandonable;
use iceoryx2_bb_elementary_traits::zero_copy_send::ZeroCopySend;
use iceoryx2_cal::shm_allocator::{bump_allocator::BumpAllocator, pool_allocator::PoolAllocator};
use iceoryx2_cal::{
    bag, dynamic_storage, event, hash, monitoring, reactor, resizable_shared_memory, serialize,
    shared_memory, static_storage,
};
use std::fmt::Debug;

/// The service variant of every port of this crate. Ports stay in the thread that made them.
#[derive(Debug, Clone)]
pub struct SlabService {}

impl iceoryx2::service::Service for SlabService {
    type StaticStorage = static_storage::recommended::Ipc;
    type ConfigSerializer = serialize::recommended::Recommended;
    type PersistentDynamicStorage<T: Debug + Send + Sync + ZeroCopySend + 'static> =
        dynamic_storage::recommended::PersistentIpc<T>;
    type Bag = bag::recommended::Recommended;
    type DynamicStorage<T: Debug + Send + Sync + ZeroCopySend + 'static> =
        dynamic_storage::recommended::Ipc<T>;
    type ServiceNameHasher = hash::recommended::Recommended;
    type SharedMemory = shared_memory::recommended::Ipc<PoolAllocator>;
    type ResizableSharedMemory = resizable_shared_memory::recommended::Ipc<PoolAllocator>;
    type Connection = crate::bounded::Connection;
    type Event = event::recommended::Ipc;
    type Monitoring = monitoring::recommended::Ipc;
    type Reactor = reactor::recommended::Ipc;
    type ArcThreadSafetyPolicy<T: Send + Debug + Abandonable> = SlabRc<T>;
    type BlackboardMgmt<T: Send + Sync + Debug + ZeroCopySend + 'static> =
        dynamic_storage::recommended::Ipc<T>;
    type BlackboardPayload = shared_memory::recommended::Ipc<BumpAllocator>;
    type UniqueId = iceoryx2::unique_id_generator::unique_system_id::UniqueSystemId;
}

impl ServiceInternal<Self> for SlabService {}
