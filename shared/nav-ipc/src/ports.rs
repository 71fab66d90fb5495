//! Writing, reading and waiting, without allocating.

use crate::bounded;
use crate::clock;
use crate::error::IpcError;
use crate::message::{Message, Wire};
use crate::service::SlabService;
use crate::space::Room;
use iceoryx2::port::listener::Listener;
use iceoryx2::port::notifier::Notifier;
use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::port::update_connections::UpdateConnections;
use iceoryx2::prelude::{CallbackProgression, FileDescriptorBased, PortFactory};
use iceoryx2::service::port_factory::publish_subscribe;
use nav_core::topics::Topic;
use std::time::Duration;

/// Messages taken in one read at most, so that a flood cannot hold the reader.
const DRAIN_MAX: usize = 16;

/// More than one writer is an error, whoever they are.
fn one_writer(topic: Topic, writers: usize) -> Result<(), IpcError> {
    if writers > 1 {
        return Err(IpcError::SeveralWriters { topic: topic.name, writers, writer: topic.writer });
    }
    Ok(())
}

/// The one writer of a topic.
#[derive(Debug)]
pub struct Writer<T: Message> {
    publisher: Publisher<SlabService, Wire<T>, ()>,
    notifier: Notifier<SlabService>,
    service: publish_subscribe::PortFactory<SlabService, Wire<T>, ()>,
    room: Room,
}

impl<T: Message> Writer<T> {
    pub(crate) fn new(
        publisher: Publisher<SlabService, Wire<T>, ()>,
        notifier: Notifier<SlabService>,
        service: publish_subscribe::PortFactory<SlabService, Wire<T>, ()>,
        room: Room,
    ) -> Self {
        Self { publisher, notifier, service, room }
    }

    /// Hands `message` to every reader and wakes those who wait. Never blocks.
    ///
    /// # Errors
    /// [`IpcError::SharedMemoryFull`]: a reader joined and there is no room for it. [`IpcError::Send`]: shared memory is
    /// broken or exhausted.
    pub fn write(&self, message: &T) -> Result<(), IpcError> {
        self.room.expect(self.reader_count())?;
        let failed = |reason| IpcError::Send { topic: T::TOPIC.name, reason };
        let sample = self.publisher.loan_uninit().map_err(|_| failed("no memory to loan"))?;
        sample.write_payload(Wire(*message)).send().map_err(|_| failed("a connection is broken"))?;
        self.notifier.notify().map_err(|_| failed("a listener could not be woken"))?;
        bounded::expect_whole()
    }

    /// Connects to readers that joined and forgets those that left. **Allocates** when there are any.
    ///
    /// # Errors
    /// [`IpcError::SeveralWriters`]: somebody else writes this topic, too. [`IpcError::SharedMemoryFull`]: a reader joined
    /// and there is no room for it. [`IpcError::Send`]: shared memory is broken or
    /// exhausted.
    pub fn refresh(&self) -> Result<(), IpcError> {
        one_writer(T::TOPIC, self.service.dynamic_config().number_of_publishers())?;
        self.room.expect(self.reader_count())?;
        self.notifier.for_each_listener(|_, _| CallbackProgression::Stop);
        self.publisher
            .update_connections()
            .map_err(|_| IpcError::Send { topic: T::TOPIC.name, reason: "a reader cannot be connected" })?;
        bounded::expect_whole()?;
        self.room.settle();
        Ok(())
    }

    /// How many readers the topic has, the dead included until their leftovers are removed.
    pub fn reader_count(&self) -> usize {
        self.service.dynamic_config().number_of_subscribers()
    }
}

/// A reader of a topic, interested in the newest message only.
#[derive(Debug)]
pub struct Reader<T: Message> {
    subscriber: Subscriber<SlabService, Wire<T>, ()>,
    service: publish_subscribe::PortFactory<SlabService, Wire<T>, ()>,
    room: Room,
}

impl<T: Message> Reader<T> {
    pub(crate) fn new(
        subscriber: Subscriber<SlabService, Wire<T>, ()>,
        service: publish_subscribe::PortFactory<SlabService, Wire<T>, ()>,
        room: Room,
    ) -> Self {
        Self { subscriber, service, room }
    }

    /// Copies the newest message into `message`, if one arrived since the last call. Never blocks.
    ///
    /// # Errors
    /// [`IpcError::SeveralWriters`]: it could be anybody's. [`IpcError::Receive`]: shared memory is broken; `message` may
    /// or may not be new.
    pub fn read_latest(&self, message: &mut T) -> Result<bool, IpcError> {
        one_writer(T::TOPIC, self.writer_count())?;
        self.room.expect(self.writer_count())?;
        let mut newest = None;
        for _ in 0..DRAIN_MAX {
            match self.subscriber.receive() {
                Ok(Some(sample)) => newest = Some(sample),
                Ok(None) => break,
                Err(_) => return Err(Self::broken()),
            }
        }
        bounded::expect_whole()?;
        if let Some(sample) = &newest {
            message.clone_from(&sample.payload().0);
        }
        Ok(newest.is_some())
    }

    /// Connects to a writer that joined and forgets one that left. **Allocates** when there is one.
    ///
    /// # Errors
    /// [`IpcError::SeveralWriters`]: what is read could be anybody's. [`IpcError::Receive`]: shared memory is broken or
    /// exhausted.
    pub fn refresh(&self) -> Result<(), IpcError> {
        one_writer(T::TOPIC, self.writer_count())?;
        self.room.expect(self.writer_count())?;
        self.subscriber.update_connections().map_err(|_| Self::broken())?;
        bounded::expect_whole()?;
        self.room.settle();
        Ok(())
    }

    /// How many writers the topic has: 0 or 1, a dead one included until its leftovers are removed.
    pub fn writer_count(&self) -> usize {
        self.service.dynamic_config().number_of_publishers()
    }

    fn broken() -> IpcError {
        IpcError::Receive { topic: T::TOPIC.name, reason: "a connection is broken" }
    }
}

/// Wakes a thread when a topic is written.
#[derive(Debug)]
pub struct Wakeup {
    listener: Listener<SlabService>,
    topic: Topic,
}

impl Wakeup {
    pub(crate) fn new(listener: Listener<SlabService>, topic: Topic) -> Self {
        Self { listener, topic }
    }

    /// Waits until the topic is written, at most `timeout`; true when it was, also before this call and since
    /// the last one. A signal ends the wait early.
    ///
    /// # Errors
    /// [`IpcError::Wait`]: the operating system refuses.
    pub fn wait(&self, timeout: Duration) -> Result<bool, IpcError> {
        // First what is already there: the trigger may have been consumed with an earlier message.
        if self.drain()? {
            return Ok(true);
        }
        let timeout_ns = u64::try_from(timeout.as_nanos()).unwrap_or(u64::MAX);
        if timeout_ns == 0 {
            return Ok(false);
        }
        // Not `timed_wait`: it works in scheduler ticks, which is up to 4 ms late at every deadline.
        let time = clock::timespec(timeout_ns);
        // SAFETY: the descriptor is open as long as the listener lives.
        let descriptor = unsafe { self.listener.file_descriptor().native_handle() };
        let mut poll = libc::pollfd { fd: descriptor, events: libc::POLLIN, revents: 0 };
        // SAFETY: one valid entry, a valid time, no signal mask.
        let ready = unsafe { libc::ppoll(&raw mut poll, 1, &raw const time, std::ptr::null()) };
        match ready {
            0 => Ok(false),
            1.. => self.drain(),
            // SAFETY: errno is always readable.
            _ if unsafe { *libc::__errno_location() } == libc::EINTR => Ok(false),
            _ => Err(self.failed("ppoll")),
        }
    }

    /// [`Self::wait`] until an absolute time of [`clock::monotonic_ns`].
    ///
    /// # Errors
    /// As [`Self::wait`].
    pub fn wait_until(&self, deadline_ns: u64) -> Result<bool, IpcError> {
        self.wait(Duration::from_nanos(deadline_ns.saturating_sub(clock::monotonic_ns())))
    }

    fn drain(&self) -> Result<bool, IpcError> {
        match self.listener.try_wait(|_| {}) {
            Ok(count) => Ok(count > 0),
            Err(iceoryx2::port::listener::ListenerWaitError::InterruptSignal) => Ok(false),
            Err(_) => Err(self.failed("the listener is broken")),
        }
    }

    fn failed(&self, reason: &'static str) -> IpcError {
        IpcError::Wait { topic: self.topic.name, reason }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{IpcConfig, RobotName};
    use crate::node::RobotNode;
    use iceoryx2::prelude::ServiceName;
    use nav_core::messages::Goal;

    /// What [`RobotNode`] never opens: a topic with two writers.
    #[test]
    fn two_writers_are_an_error_while_running() {
        let folder = tempfile::tempdir().expect("a scratch folder");
        let config = IpcConfig::in_folder(folder.path()).expect("a short path");
        let node = RobotNode::open(&RobotName::new("r").expect("a plain name"), &config).expect("a node");
        let name = ServiceName::new("hybridnav/r/goal").expect("a service name");
        let builder = node.node.service_builder(&name).publish_subscribe::<Wire<Goal>>();
        let service = builder.max_publishers(2).open_or_create().expect("a service");
        let room = Room::take(&config, 2).expect("room");
        let subscriber = service.subscriber_builder().create().expect("a reader");
        let reader = Reader::<Goal>::new(subscriber, service, room);
        let publisher = || reader.service.publisher_builder().create().expect("a publisher");
        let _one = publisher();
        assert_eq!(reader.refresh(), Ok(()));
        let two = publisher();
        let error = reader.refresh().expect_err("two writers");
        assert!(matches!(error, IpcError::SeveralWriters { topic: "goal", writers: 2, .. }), "{error}");
        let mut goal = Goal::default();
        assert_eq!(reader.read_latest(&mut goal), Err(error), "nor is anything read");
        drop(two);
        assert_eq!(reader.refresh(), Ok(()));
        drop((_one, reader, node));
        config.remove_all();
    }
}
