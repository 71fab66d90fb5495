//! A process's place among the programs of one robot.

use crate::config::{IpcConfig, RobotName};
use crate::error::IpcError;
use crate::leftovers;
use crate::message::Message;
use crate::ports::{Reader, Wakeup, Writer};
use crate::root::Root;
use crate::service::SlabService;
use crate::space::{self, Room};
use iceoryx2::port::publisher::PublisherCreateError;
use iceoryx2::prelude::{LogLevel, Node, NodeBuilder, SignalHandlingMode, set_log_level};

/// Readers of a topic, in all processes.
pub(crate) const READERS_MAX: u64 = 8;

/// What iceoryx2 calls a node: it owns the ports of one process and is missed when the process dies.
#[derive(Debug)]
pub struct RobotNode {
    pub(crate) node: Node<SlabService>,
    pub(crate) robot: RobotName,
    pub(crate) config: IpcConfig,
    root: Root,
}

impl RobotNode {
    /// Opens a node and removes what killed processes left behind. Waits for other programs that are starting, 20 s at
    /// most.
    ///
    /// iceoryx2's own log is switched off in this process: errors come back as [`IpcError`].
    ///
    /// # Errors
    /// [`IpcError::Node`] when the shared files cannot be made, [`IpcError::ForeignRoot`], [`IpcError::SharedRoot`] and
    /// [`IpcError::ForeignFile`] when they are not ours alone, [`IpcError::Starting`] and [`IpcError::HalfMade`] when
    /// another process does not get on, [`IpcError::SharedMemoryFull`].
    pub fn open(robot: &RobotName, config: &IpcConfig) -> Result<Self, IpcError> {
        set_log_level(LogLevel::Fatal);
        let root = Root::claim(&config.root())?;
        let _starting = root.start()?;
        // Before iceoryx2 sees any of it: it waits for what is half made.
        leftovers::remove_half_made(config)?;
        space::require(space::NODE)?;
        leftovers::secure_counter(config)?;
        let node = NodeBuilder::new()
            .config(&config.iceoryx2()?)
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<SlabService>()
            .map_err(|error| IpcError::Node { root: config.root(), reason: format!("{error:?}") })?;
        Ok(Self { node, robot: robot.clone(), config: config.clone(), root })
    }

    /// The robot's name.
    pub fn robot(&self) -> &RobotName {
        &self.robot
    }

    /// The one writer of a topic.
    ///
    /// # Errors
    /// [`IpcError::SecondWriter`] when another process writes it, [`IpcError::SeveralWritersAllowed`] when others could,
    /// [`IpcError::DeadWriter`], [`IpcError::TypeMismatch`], [`IpcError::Broken`], [`IpcError::SharedMemoryFull`] and
    /// [`IpcError::Open`].
    pub fn writer<T: Message>(&self) -> Result<Writer<T>, IpcError> {
        let _starting = self.root.start()?;
        space::require(space::writer(size_of::<T>()))?;
        let service = self.message_service::<T>()?;
        self.expect_no_writer(&service)?;
        let publisher = match service.publisher_builder().create() {
            Ok(publisher) => publisher,
            Err(error) => {
                if error == PublisherCreateError::ExceedsMaxSupportedPublishers {
                    // Somebody who does not take the folder's lock was faster.
                    self.expect_no_writer(&service)?;
                }
                return Err(self.open_error::<T>(&error));
            }
        };
        let event = self.event_service::<T>()?;
        let notifier = event.notifier_builder().create().map_err(|error| self.open_error::<T>(&error))?;
        Ok(Writer::new(publisher, notifier, service, Room::take(&self.config, READERS_MAX)?))
    }

    /// A reader of a topic; up to eight of them in all processes.
    ///
    /// # Errors
    /// [`IpcError::SeveralWritersAllowed`] when more than one process could write it, [`IpcError::TypeMismatch`],
    /// [`IpcError::Broken`], [`IpcError::SharedMemoryFull`] and [`IpcError::Open`].
    pub fn reader<T: Message>(&self) -> Result<Reader<T>, IpcError> {
        let _starting = self.root.start()?;
        space::require(space::READER)?;
        let service = self.message_service::<T>()?;
        let subscriber =
            service.subscriber_builder().create().map_err(|error| self.open_error::<T>(&error))?;
        Ok(Reader::new(subscriber, service, Room::take(&self.config, 1)?))
    }

    /// Wakes this thread when a topic is written.
    ///
    /// # Errors
    /// [`IpcError::Broken`], [`IpcError::SharedMemoryFull`] and [`IpcError::Open`].
    pub fn wakeup<T: Message>(&self) -> Result<Wakeup, IpcError> {
        let _starting = self.root.start()?;
        space::require(space::READER)?;
        let event = self.event_service::<T>()?;
        let listener = event.listener_builder().create().map_err(|error| self.open_error::<T>(&error))?;
        space::take(&self.config)?;
        Ok(Wakeup::new(listener, T::TOPIC))
    }

    pub(crate) fn open_error<T: Message>(&self, error: &impl std::fmt::Debug) -> IpcError {
        IpcError::Open { robot: self.robot.clone(), topic: T::TOPIC.name, reason: format!("{error:?}") }
    }
}
