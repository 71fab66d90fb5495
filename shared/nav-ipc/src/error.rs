//! What can go wrong between processes, a sentence each.

use crate::config::RobotName;
use std::path::PathBuf;

/// A topic could not be opened, written or read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum IpcError {
    /// A name that cannot be part of a service name.
    #[error("the robot name `{name}` is not usable: choose 1 to 32 letters, digits, `-` or `_`")]
    RobotName {
        /// What was asked for.
        name: String,
    },
    /// A root folder that cannot hold sockets.
    #[error("the folder {} cannot hold the shared files: give an absolute path of at most {root_max_len} bytes", root.display())]
    Root {
        /// What was asked for.
        root: PathBuf,
        /// The longest possible path, bytes.
        root_max_len: usize,
    },
    /// The node could not be created.
    #[error(
        "shared memory cannot be used ({reason}): check that {} and /dev/shm are writable for this user and not full",
        root.display()
    )]
    Node {
        /// The root folder in use.
        root: PathBuf,
        /// iceoryx2's own word for it.
        reason: String,
    },
    /// Another process writes the topic already.
    #[error(
        "robot `{robot}` already has a writer of `{topic}` ({holder}): stop that {writer} or choose another --robot name"
    )]
    SecondWriter {
        /// The robot.
        robot: RobotName,
        /// The topic.
        topic: &'static str,
        /// Which program writes this topic.
        writer: &'static str,
        /// The process that holds it.
        holder: String,
    },
    /// The topic exists with a type of another version.
    #[error(
        "topic `{topic}` of robot `{robot}` carries another message type than `{type_name}`: run programs of the same version"
    )]
    TypeMismatch {
        /// The robot.
        robot: RobotName,
        /// The topic.
        topic: &'static str,
        /// What this program speaks.
        type_name: &'static str,
    },
    /// Too many readers, or settings that do not go together.
    #[error(
        "topic `{topic}` of robot `{robot}` cannot be opened ({reason}): stop programs that are not needed"
    )]
    Open {
        /// The robot.
        robot: RobotName,
        /// The topic.
        topic: &'static str,
        /// iceoryx2's own word for it.
        reason: String,
    },
    /// A message could not be sent.
    #[error("a message on `{topic}` could not be sent ({reason}): restart this program")]
    Send {
        /// The topic.
        topic: &'static str,
        /// iceoryx2's own word for it.
        reason: &'static str,
    },
    /// Messages could not be received.
    #[error("messages on `{topic}` could not be received ({reason}): restart the program that writes it")]
    Receive {
        /// The topic.
        topic: &'static str,
        /// iceoryx2's own word for it.
        reason: &'static str,
    },
    /// Waiting failed.
    #[error("waiting for `{topic}` failed ({reason}): restart this program")]
    Wait {
        /// The topic.
        topic: &'static str,
        /// What the system said.
        reason: &'static str,
    },
}
