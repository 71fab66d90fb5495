//! Floor 1: the topics of a robot over iceoryx2 shared memory.
//!
//! A process opens a [`RobotNode`], takes the [`Writer`]s and [`Reader`]s it needs, and from then on passes
//! messages of [`nav_core::messages`] without copying through the kernel and without a heap allocation. System calls
//! remain where somebody waits: a write wakes each [`Wakeup`] (`sendto`), and waiting is `ppoll`.
//!
//! ```
//! use nav_core::messages::{Goal, Header};
//! use nav_ipc::{IpcConfig, RobotName, RobotNode};
//!
//! # fn main() -> Result<(), nav_ipc::IpcError> {
//! # let folder = tempfile::tempdir().expect("a scratch folder");
//! # let config = IpcConfig::in_folder(folder.path())?;
//! let node = RobotNode::open(&RobotName::new("r1")?, &config)?;
//! let writer = node.writer::<Goal>()?;
//! let reader = node.reader::<Goal>()?;
//!
//! writer.write(&Goal { header: Header { stamp_ns: 1, seq: 1 }, x_m: 2.0, ..Goal::default() })?;
//! let mut goal = Goal::default();
//! assert!(reader.read_latest(&mut goal)?);
//! assert!(!reader.read_latest(&mut goal)?, "nothing newer arrived");
//! # Ok(())
//! # }
//! ```
//!
//! # What is promised
//! - **Any start order.** Services are opened or created; a reader sees what is written after it connected.
//! - **The newest message wins.** A reader keeps at most two messages and hands out the last one.
//! - **One writer a topic**, whoever came first. A second one is refused with the process id of the first, a topic that
//!   somebody else opened for several with the ids of those who have it open.
//! - **A killed start blocks nobody.** What it left is removed by the next one, or named with the command that does.
//! - **A peer that is killed while it connects holds nobody up** for more than 10 ms, and its file is named (`bounded`).
//! - **Full shared memory is a sentence**, not SIGBUS: room is taken at the start, and some is kept for who joins.
//! - **No allocation after start-up** in [`Writer::write`], [`Reader::read_latest`] and [`Wakeup::wait`], proved by
//!   a counting allocator. A peer that *joins or leaves* does cost allocations, in the next call: a loop that
//!   must not allocate calls `refresh` on its ports first, and counts that apart.
//! - **Stock iceoryx2 peers join in.** The services are those of `iceoryx2::prelude::ipc::Service` (see
//!   [`service`]); [`message`] documents layout and type names for other languages.
//!
//! # What is not promised
//! - **A dead peer is not signalled.** Watch the age of what it writes.
//! - **Leftovers of killed processes** go when the next node is opened, never while running.
//! - **Trust.** The folder and the shared memory are readable and writable by the same user only (modes 0700 and 0600): the
//!   user id is the trust domain. A hostile process of the same user can send wrong numbers, or crash a peer that reads
//!   its memory. The stop must therefore also be guarded on the driver's side.

pub mod message;
pub mod config;
mod user;
mod root;
pub mod others;
mod leftovers;
mod space;
pub mod service;
mod slab;
mod bounded;
pub mod node;
mod topic;
pub mod ports;
pub mod error;
pub mod clock;

pub use config::{IpcConfig, RobotName};
pub use error::IpcError;
pub use message::Message;
pub use node::RobotNode;
pub use ports::{Reader, Wakeup, Writer};
