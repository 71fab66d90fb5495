//! A process's place among the programs of one robot.

use crate::config::{IpcConfig, RobotName};
use crate::error::IpcError;
use crate::message::{Message, Wire};
use crate::ports::{Reader, Wakeup, Writer};
use crate::service::SlabService;
use iceoryx2::port::publisher::PublisherCreateError;
use iceoryx2::prelude::{
    CallbackProgression, LogLevel, Node, NodeBuilder, PortFactory, ServiceName, SignalHandlingMode,
    set_log_level,
};
use iceoryx2::service::builder::publish_subscribe::{
    PublishSubscribeOpenError, PublishSubscribeOpenOrCreateError,
};
use iceoryx2::service::port_factory::{event, publish_subscribe};

/// What iceoryx2 calls a node: it owns the ports of one process and is missed when the process dies.
#[derive(Debug)]
pub struct RobotNode {
    node: Node<SlabService>,
    robot: RobotName,
}

type MessageService<T> = publish_subscribe::PortFactory<SlabService, Wire<T>, ()>;
type EventService = event::PortFactory<SlabService>;

impl RobotNode {
    /// Opens a node and removes what killed processes left behind.
    ///
    /// iceoryx2's own log is switched off in this process: errors come back as [`IpcError`].
    ///
    /// # Errors
    /// [`IpcError::Node`] when the shared files cannot be made.
    pub fn open(robot: &RobotName, config: &IpcConfig) -> Result<Self, IpcError> {
        set_log_level(LogLevel::Fatal);
        let node = NodeBuilder::new()
            .config(&config.iceoryx2()?)
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<SlabService>()
            .map_err(|error| IpcError::Node { root: config.root(), reason: format!("{error:?}") })?;
        Ok(Self { node, robot: robot.clone() })
    }

    /// The robot's name.
    pub fn robot(&self) -> &RobotName {
        &self.robot
    }

    /// The one writer of a topic.
    ///
    /// # Errors
    /// [`IpcError::SecondWriter`] when another process writes it, [`IpcError::TypeMismatch`] and
    /// [`IpcError::Open`].
    pub fn writer<T: Message>(&self) -> Result<Writer<T>, IpcError> {
        let service = self.message_service::<T>()?;
        // A service that a stock peer created may allow two writers; we do not.
        if service.dynamic_config().number_of_publishers() > 0 {
            return Err(self.second_writer(&service));
        }
        let publisher = service.publisher_builder().create().map_err(|error| match error {
            PublisherCreateError::ExceedsMaxSupportedPublishers => self.second_writer(&service),
            other => self.open_error::<T>(&other),
        })?;
        let event = self.event_service::<T>()?;
        let notifier = event.notifier_builder().create().map_err(|error| self.open_error::<T>(&error))?;
        Ok(Writer::new(publisher, notifier, service))
    }

    /// A reader of a topic; up to eight of them in all processes.
    ///
    /// # Errors
    /// [`IpcError::TypeMismatch`] and [`IpcError::Open`].
    pub fn reader<T: Message>(&self) -> Result<Reader<T>, IpcError> {
        let service = self.message_service::<T>()?;
        let subscriber =
            service.subscriber_builder().create().map_err(|error| self.open_error::<T>(&error))?;
        Ok(Reader::new(subscriber, service))
    }

    /// Wakes this thread when a topic is written.
    ///
    /// # Errors
    /// [`IpcError::Open`].
    pub fn wakeup<T: Message>(&self) -> Result<Wakeup, IpcError> {
        let event = self.event_service::<T>()?;
        let listener = event.listener_builder().create().map_err(|error| self.open_error::<T>(&error))?;
        Ok(Wakeup::new(listener, T::TOPIC))
    }

    fn service_name<T: Message>(&self) -> Result<ServiceName, IpcError> {
        ServiceName::new(&format!("hybridnav/{}/{}", self.robot, T::TOPIC.name))
            .map_err(|error| self.open_error::<T>(&error))
    }

    /// Asks for no more than iceoryx2's defaults give, so that a stock peer may be the one who creates it.
    fn message_service<T: Message>(&self) -> Result<MessageService<T>, IpcError> {
        self.node
            .service_builder(&self.service_name::<T>()?)
            .publish_subscribe::<Wire<T>>()
            .max_publishers(1)
            .max_subscribers(8)
            .subscriber_max_buffer_size(2)
            .enable_safe_overflow(true)
            .open_or_create()
            .map_err(|error| match error {
                PublishSubscribeOpenOrCreateError::PublishSubscribeOpenError(
                    PublishSubscribeOpenError::IncompatibleTypes,
                ) => IpcError::TypeMismatch {
                    robot: self.robot.clone(),
                    topic: T::TOPIC.name,
                    type_name: T::TOPIC.type_name,
                },
                other => self.open_error::<T>(&other),
            })
    }

    fn event_service<T: Message>(&self) -> Result<EventService, IpcError> {
        self.node
            .service_builder(&self.service_name::<T>()?)
            .event()
            .open_or_create()
            .map_err(|error| self.open_error::<T>(&error))
    }

    fn open_error<T: Message>(&self, error: &impl std::fmt::Debug) -> IpcError {
        IpcError::Open { robot: self.robot.clone(), topic: T::TOPIC.name, reason: format!("{error:?}") }
    }

    fn second_writer<T: Message>(&self, service: &MessageService<T>) -> IpcError {
        let mut holder = String::from("of another process");
        service.dynamic_config().list_publishers(|details| {
            if let Ok(process) = details.node_id.pid::<SlabService>() {
                holder = format!("process {}", process.value());
            }
            CallbackProgression::Continue
        });
        IpcError::SecondWriter {
            robot: self.robot.clone(),
            topic: T::TOPIC.name,
            writer: T::TOPIC.writer,
            holder,
        }
    }
}
