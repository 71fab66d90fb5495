//! Opening the services of a topic: ours whoever came first, without what killed programs left of them.

use crate::error::IpcError;
use crate::leftovers;
use crate::message::{Message, Wire};
use crate::node::RobotNode;
use crate::service::SlabService;
use iceoryx2::node::{NodeState, NodeView};
use iceoryx2::prelude::{CallbackProgression, MessagingPattern, PortFactory, ServiceName};
use iceoryx2::service::Service;
use iceoryx2::service::internal::ServiceInternal;
use iceoryx2::service::port_factory::{event, publish_subscribe};
use std::time::Duration;

/// The service that carries the messages of a topic.
pub(crate) type MessageService<T> = publish_subscribe::PortFactory<SlabService, Wire<T>, ()>;
/// The service that wakes its readers.
pub(crate) type EventService = event::PortFactory<SlabService>;

/// What iceoryx2 says of a service that was left half made or half removed.
const BROKEN: [&str; 5] = [
    "HangsInCreation",
    "ServiceInCorruptedState",
    "IsMarkedForDestruction",
    "InternalFailure",
    "SystemInFlux",
];
/// How often a broken service is removed before giving up.
const REMOVALS_MAX: usize = 2;
/// How long another process may take that is removing the same leftovers.
const REMOVAL_WAIT: Duration = Duration::from_secs(1);

impl RobotNode {
    /// Asks for no more than iceoryx2's defaults give, so that a stock peer may be the one who creates it; but one that
    /// lets several programs write is refused.
    pub(crate) fn message_service<T: Message>(&self) -> Result<MessageService<T>, IpcError> {
        let service = self.open_service::<T, _>(MessagingPattern::PublishSubscribe, |name| {
            self.node
                .service_builder(name)
                .publish_subscribe::<Wire<T>>()
                .max_publishers(1)
                .max_subscribers(8)
                .subscriber_max_buffer_size(2)
                .enable_safe_overflow(true)
                .open_or_create()
                .map_err(|error| format!("{error:?}"))
        })?;
        match service.static_config().max_publishers() {
            1 => Ok(service),
            writers_max => Err(IpcError::SeveralWritersAllowed {
                robot: self.robot.clone(),
                topic: T::TOPIC.name,
                writers_max,
                holders: self.others_in(&service),
            }),
        }
    }

    pub(crate) fn event_service<T: Message>(&self) -> Result<EventService, IpcError> {
        self.open_service::<T, _>(MessagingPattern::Event, |name| {
            self.node.service_builder(name).event().open_or_create().map_err(|error| format!("{error:?}"))
        })
    }

    /// Opens a service; one that is broken and nobody's is removed and made again.
    fn open_service<T: Message, S>(
        &self,
        pattern: MessagingPattern,
        open: impl Fn(&ServiceName) -> Result<S, String>,
    ) -> Result<S, IpcError> {
        let name = ServiceName::new(&format!("hybridnav/{}/{}", self.robot, T::TOPIC.name))
            .map_err(|error| self.open_error::<T>(&error))?;
        leftovers::remove_half_made(&self.config)?;
        let mut removals = 0;
        loop {
            let reason = match open(&name) {
                Ok(service) => return Ok(service),
                Err(reason) => reason,
            };
            if reason.contains("IncompatibleTypes") {
                return Err(IpcError::TypeMismatch {
                    robot: self.robot.clone(),
                    topic: T::TOPIC.name,
                    type_name: T::TOPIC.type_name,
                });
            }
            if removals == REMOVALS_MAX || !BROKEN.iter().any(|word| reason.contains(word)) {
                return Err(IpcError::Open { robot: self.robot.clone(), topic: T::TOPIC.name, reason });
            }
            removals += 1;
            self.remove_broken::<T>(&name, pattern, &reason)?;
        }
    }

    /// Removes a service that no living process has open.
    fn remove_broken<T: Message>(
        &self,
        name: &ServiceName,
        pattern: MessagingPattern,
        reason: &str,
    ) -> Result<(), IpcError> {
        let config = self.config.iceoryx2()?;
        let details = SlabService::details(name, &config, pattern).ok().flatten();
        let nodes = details.and_then(|details| details.dynamic_details).map(|details| details.nodes);
        let holders: Vec<_> = nodes.iter().flatten().filter_map(|node| self.other(node)).collect();
        let remove = || {
            // SAFETY: no living process has it open, and while we hold the folder's lock none of ours can open it.
            unsafe { SlabService::__internal_force_remove_service(name, &config, pattern) }
        };
        if holders.is_empty() && remove().is_ok() {
            return Ok(());
        }
        let holders = if holders.is_empty() { "nobody".to_owned() } else { holders.join("; ") };
        Err(IpcError::Broken {
            robot: self.robot.clone(),
            topic: T::TOPIC.name,
            reason: format!("{reason}; open in: {holders}"),
            command: self.config.removal(),
        })
    }

    /// A node that is not ours and not dead, for people.
    fn other(&self, state: &NodeState<SlabService>) -> Option<String> {
        if state.node_id() == self.node.id() || matches!(state, NodeState::Dead(_)) {
            return None;
        }
        let details = match state {
            NodeState::Alive(view) => view.details().as_ref(),
            _ => None,
        };
        let process = state.node_id().pid::<SlabService>().map_or(0, |process| process.value());
        Some(match details {
            Some(details) => format!("process {process}, {}", details.executable()),
            None => format!("process {process}"),
        })
    }

    /// The living processes that have a service open, but for this one's node.
    fn others_in<T: Message>(&self, service: &MessageService<T>) -> String {
        let mut others = Vec::new();
        let listed = service.nodes(|state| {
            others.extend(self.other(&state));
            CallbackProgression::Continue
        });
        if listed.is_err() || others.is_empty() {
            others.push("a process that cannot be seen".to_owned());
        }
        others.join("; ")
    }

    /// Makes sure that nobody writes a topic: a writer that is dead is removed.
    pub(crate) fn expect_no_writer<T: Message>(&self, service: &MessageService<T>) -> Result<(), IpcError> {
        if service.dynamic_config().number_of_publishers() > 0 {
            service.blocking_cleanup_dead_nodes(REMOVAL_WAIT);
        }
        let mut writer = None;
        service.dynamic_config().list_publishers(|details| {
            writer = Some(details.node_id);
            CallbackProgression::Stop
        });
        let Some(writer) = writer else { return Ok(()) };
        let process = writer.pid::<SlabService>().map_or(0, |process| process.value());
        let mut is_dead = false;
        let listed = service.nodes(|state| {
            is_dead |= *state.node_id() == writer && matches!(state, NodeState::Dead(_));
            CallbackProgression::Continue
        });
        if listed.is_ok() && is_dead {
            return Err(IpcError::DeadWriter {
                robot: self.robot.clone(),
                topic: T::TOPIC.name,
                process,
                command: self.config.removal(),
            });
        }
        Err(IpcError::SecondWriter {
            robot: self.robot.clone(),
            topic: T::TOPIC.name,
            writer: T::TOPIC.writer,
            holder: format!("process {process}"),
        })
    }
}
