//! Where the shared files of a robot live, and what a robot may be called.

use crate::error::IpcError;
use crate::leftovers;
use iceoryx2::prelude::{Config, FileName, Path, SemanticString};
use std::path::{Path as StdPath, PathBuf};

/// The longest name of a robot, characters.
const NAME_MAX_LEN: usize = 32;
/// The longest root folder and prefix together, bytes: a socket's path ends at 107.
const ROOT_MAX_LEN: usize = 58;

/// The name of a robot: part of every service name, so that several robots share a machine.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct RobotName(String);

impl RobotName {
    /// Takes 1 to 32 letters, digits, `-` and `_`.
    ///
    /// # Errors
    /// [`IpcError::RobotName`] for anything else.
    pub fn new(name: &str) -> Result<Self, IpcError> {
        let allowed = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        if name.is_empty() || name.len() > NAME_MAX_LEN || !name.chars().all(allowed) {
            return Err(IpcError::RobotName { name: name.to_owned() });
        }
        Ok(Self(name.to_owned()))
    }

    /// The name as text.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl std::fmt::Display for RobotName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

/// Where iceoryx2 keeps its files. Processes see each other only if theirs is the same.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct IpcConfig {
    /// The root folder.
    root: PathBuf,
    /// What the names of shared memory begin with.
    prefix: String,
}

impl Default for IpcConfig {
    /// The world of this user: `/tmp/hybridnav-<user id>`. Not iceoryx2's own `/tmp/iceoryx2`, which whoever comes first
    /// owns, and not a folder that comes and goes with a login.
    fn default() -> Self {
        Self::of_user(crate::user::id())
    }
}

/// What the names of shared memory begin with in a world: `nav`, the path as FNV-1a of 32 bits in hexadecimal, `_`.
fn prefix_of(root: &StdPath) -> String {
    let bytes = root.as_os_str().as_encoded_bytes();
    let hash = bytes.iter().fold(0x811c_9dc5_u32, |h, b| (h ^ u32::from(*b)).wrapping_mul(0x0100_0193));
    format!("nav{hash:08x}_")
}

impl IpcConfig {
    /// The world of a user.
    pub(crate) fn of_user(user: u32) -> Self {
        let root = PathBuf::from(format!("/tmp/hybridnav-{user}"));
        Self { prefix: prefix_of(&root), root }
    }

    /// A world of its own under `root` (an absolute path, created when missing), for tests and for several
    /// systems on one machine. The prefix of shared-memory names is derived from the path.
    ///
    /// # Errors
    /// [`IpcError::Root`] when the path is relative, or too long for the sockets that go there.
    pub fn in_folder(root: &StdPath) -> Result<Self, IpcError> {
        // However it is spelled: `/x/`, `/x/.` and `/x` are one folder.
        let root: PathBuf = root.components().collect();
        let prefix = prefix_of(&root);
        if !root.is_absolute() || root.as_os_str().len() + prefix.len() > ROOT_MAX_LEN {
            return Err(IpcError::Root { root, root_max_len: ROOT_MAX_LEN - prefix.len() });
        }
        Ok(Self { root, prefix })
    }

    /// [`Self::in_folder`] for an optional command-line value; the user's world ([`Self::default`]) without one.
    ///
    /// # Errors
    /// As [`Self::in_folder`].
    pub fn from_option(root: Option<&StdPath>) -> Result<Self, IpcError> {
        root.map_or_else(|| Ok(Self::default()), Self::in_folder)
    }

    /// The root folder, for messages to people.
    pub fn root(&self) -> PathBuf {
        self.root.clone()
    }

    /// What the names of shared memory begin with.
    pub fn prefix(&self) -> &str {
        &self.prefix
    }

    /// The command that removes the shared files of this world, for people.
    pub(crate) fn removal(&self) -> String {
        format!("rm -rf {} {}/{}*", self.root.display(), leftovers::SHARED_MEMORY, self.prefix)
    }

    /// Removes the shared files of this world, those of killed processes included: for tests and benches, after all its
    /// processes have ended.
    pub fn remove_all(&self) {
        // What is gone already, or belongs to somebody else, needs no removal.
        let _ = std::fs::remove_dir_all(&self.root);
        for path in leftovers::shared_files(self) {
            let _ = std::fs::remove_file(path);
        }
    }

    /// The same for iceoryx2. Files that configure other programs are not read: what runs is what is written here.
    pub fn iceoryx2(&self) -> Result<Config, IpcError> {
        let mut config = Config::default();
        // Leftovers are removed when a node or service opens, never by a loop that happens to end.
        config.global.node.cleanup_dead_nodes_on_destruction = false;
        let refused = || IpcError::Root { root: self.root(), root_max_len: ROOT_MAX_LEN - self.prefix.len() };
        let path = Path::new(self.root.as_os_str().as_encoded_bytes()).map_err(|_| refused())?;
        config.global.set_root_path(&path);
        config.global.prefix = FileName::new(self.prefix.as_bytes()).map_err(|_| refused())?;
        Ok(config)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_folder_is_one_world_however_it_is_spelled() {
        let world = |root: &str| IpcConfig::in_folder(StdPath::new(root)).expect("a short path");
        assert_eq!(world("/tmp/a/"), world("/tmp/a"));
        assert_eq!(world("/tmp//a/."), world("/tmp/a"));
        assert_ne!(world("/tmp/a"), world("/tmp/b"));
    }

    #[test]
    fn robot_names_are_plain() {
        assert!(RobotName::new("robot_2-b").is_ok());
        for bad in ["", "a/b", "a b", "ä", &"x".repeat(33)] {
            let error = RobotName::new(bad).expect_err("a bad name").to_string();
            assert!(error.contains("letters, digits"), "{error}");
        }
    }

    #[test]
    fn folders_are_apart_and_short_enough() {
        let one = IpcConfig::in_folder(StdPath::new("/run/one")).expect("a fine folder");
        let two = IpcConfig::in_folder(StdPath::new("/run/two")).expect("a fine folder");
        assert_ne!(one.prefix(), two.prefix());
        assert!(IpcConfig::in_folder(StdPath::new("relative")).is_err());
        assert!(IpcConfig::in_folder(StdPath::new(&format!("/{}", "x".repeat(80)))).is_err());
    }
}
