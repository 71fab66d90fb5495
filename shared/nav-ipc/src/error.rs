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
    /// The root folder is another user's.
    #[error(
        "the folder {} belongs to user {owner}, and this program runs as user {us}: run all programs of a robot as the \
         same user, or choose another folder with --ipc-root",
        root.display()
    )]
    ForeignRoot {
        /// The root folder in use.
        root: PathBuf,
        /// Whose it is.
        owner: String,
        /// Who we are.
        us: String,
    },
    /// Others could put files into the root folder, or choose where it leads.
    #[error(
        "the folder {} is a link, or others may write to it: run `chmod go-w` on it or choose another one with --ipc-root",
        root.display()
    )]
    SharedRoot {
        /// The root folder in use.
        root: PathBuf,
    },
    /// Another user has put a file where ours would go.
    #[error(
        "{} belongs to user {owner} and is in the way: have it removed, or choose another folder with --ipc-root",
        path.display()
    )]
    ForeignFile {
        /// The file.
        path: PathBuf,
        /// Whose it is.
        owner: String,
    },
    /// No room for what a program shares, or for a reader that joined.
    #[error(
        "shared memory is full: {need_kib} KiB are needed under /dev/shm, {free_kib} are free; remove what is not needed \
         there or make it larger (`mount -o remount,size=256M /dev/shm`, for a container `--shm-size=256m`)"
    )]
    SharedMemoryFull {
        /// What is needed, KiB.
        need_kib: u64,
        /// What there is, KiB.
        free_kib: u64,
    },
    /// Another program's start does not come to an end.
    #[error(
        "process {holder} has been starting in {} for a long time: end it and start this program again",
        root.display()
    )]
    Starting {
        /// The root folder in use.
        root: PathBuf,
        /// The number of the process.
        holder: String,
    },
    /// A file is half made, and may not or cannot be removed.
    #[error(
        "{} is half made (open in: {holder}): end that program, run `rm -f {}`, and start this one again",
        path.display(), path.display()
    )]
    HalfMade {
        /// The file.
        path: PathBuf,
        /// The process that has it open.
        holder: String,
    },
    /// A killed process left a topic that cannot be removed.
    #[error(
        "topic `{topic}` of robot `{robot}` is broken and cannot be made again ({reason}): end all programs of this robot, \
         run `{command}`, and start them again"
    )]
    Broken {
        /// The robot.
        robot: RobotName,
        /// The topic.
        topic: &'static str,
        /// iceoryx2's own word for it, and which processes use it.
        reason: String,
        /// What removes it.
        command: String,
    },
    /// The topic was made by a program that lets several programs write it.
    #[error(
        "topic `{topic}` of robot `{robot}` was opened first by a program that lets {writers_max} programs write it \
         (open in: {holders}): give its service `max_publishers(1)` and restart it, or start it after this program"
    )]
    SeveralWritersAllowed {
        /// The robot.
        robot: RobotName,
        /// The topic.
        topic: &'static str,
        /// How many could.
        writers_max: usize,
        /// Which processes use it.
        holders: String,
    },
    /// Several programs write the topic.
    #[error(
        "{writers} programs write `{topic}`, and nobody can tell which to believe: stop all of them but the {writer}"
    )]
    SeveralWriters {
        /// The topic.
        topic: &'static str,
        /// How many there are.
        writers: usize,
        /// Which program writes this topic.
        writer: &'static str,
    },
    /// A dead process is still entered as writer of the topic.
    #[error(
        "the writer of `{topic}` of robot `{robot}` was left by process {process}, which is dead, and cannot be removed: \
         run `{command}` as the user it ran as"
    )]
    DeadWriter {
        /// The robot.
        robot: RobotName,
        /// The topic.
        topic: &'static str,
        /// The number of the process.
        process: i32,
        /// What removes it.
        command: String,
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
