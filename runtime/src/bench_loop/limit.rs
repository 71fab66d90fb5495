//! A limit on cores for this process and whatever it starts: cgroup v2 where writable, else CPU affinity.

use crate::run::realtime::{allowed_cores, restrict};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

const ROOT: &str = "/sys/fs/cgroup";
/// Accounting period of the bandwidth, us.
const BANDWIDTH_PERIOD_US: usize = 100_000;

/// An active limit; a cgroup is left and removed when dropped.
#[derive(Debug)]
pub struct Limit {
    words: String,
    group: Option<Group>,
}

#[derive(Debug)]
struct Group {
    path: PathBuf,
    /// Where this process came from.
    home: PathBuf,
}

impl Limit {
    /// Limits this process to as many cores.
    ///
    /// # Errors
    /// Neither way works.
    pub fn enter(cores: usize) -> io::Result<Self> {
        match Group::enter(Path::new(ROOT), cores) {
            Ok(group) => {
                let words = format!("{cores} cores by cgroup v2 (cpu.max in {})", group.path.display());
                Ok(Self { words, group: Some(group) })
            }
            Err(reason) => {
                let allowed = allowed_cores()?;
                let chosen: Vec<usize> = allowed.iter().copied().take(cores).collect();
                restrict(&chosen)?;
                let names: Vec<String> = chosen.iter().map(ToString::to_string).collect();
                let words = format!(
                    "{} of {} usable cores by CPU affinity (cores {}), because cgroup v2 is not writable ({reason})",
                    chosen.len(),
                    allowed.len(),
                    names.join(", ")
                );
                Ok(Self { words, group: None })
            }
        }
    }

    /// How the limit is enforced.
    pub fn words(&self) -> &str {
        &self.words
    }
}

impl Group {
    fn enter(root: &Path, cores: usize) -> io::Result<Self> {
        let controllers = fs::read_to_string(root.join("cgroup.subtree_control"))?;
        if !controllers.split_whitespace().any(|name| name == "cpu") {
            return Err(io::Error::new(io::ErrorKind::Unsupported, "the cpu controller is not delegated"));
        }
        let own = fs::read_to_string("/proc/self/cgroup")?;
        let home = own.lines().find_map(|line| line.strip_prefix("0::/")).unwrap_or_default();
        let group = Self {
            path: root.join(format!("hybridnav-bench-{}", std::process::id())),
            home: root.join(home),
        };
        fs::create_dir(&group.path)?;
        // From here on dropping the group removes it.
        let bandwidth_us = cores * BANDWIDTH_PERIOD_US;
        fs::write(group.path.join("cpu.max"), format!("{bandwidth_us} {BANDWIDTH_PERIOD_US}"))?;
        fs::write(group.path.join("cgroup.procs"), std::process::id().to_string())?;
        Ok(group)
    }
}

impl Drop for Group {
    fn drop(&mut self) {
        // Best effort: the process is about to end, and an empty group harms nobody.
        let _ = fs::write(self.home.join("cgroup.procs"), std::process::id().to_string());
        let _ = fs::remove_dir(&self.path);
    }
}

impl Drop for Limit {
    fn drop(&mut self) {
        drop(self.group.take());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_group_without_the_controller_is_refused_and_leaves_nothing() {
        let root = tempfile::tempdir().expect("a scratch folder");
        fs::write(root.path().join("cgroup.subtree_control"), "memory pids").expect("written");
        assert!(Group::enter(root.path(), 2).is_err());
        assert_eq!(fs::read_dir(root.path()).expect("readable").count(), 1);
    }

    #[test]
    fn a_group_gets_its_bandwidth() {
        let root = tempfile::tempdir().expect("a scratch folder");
        fs::write(root.path().join("cgroup.subtree_control"), "cpu memory").expect("written");
        let group = Group::enter(root.path(), 2).expect("a plain folder stands in for a cgroup");
        let written = fs::read_to_string(group.path.join("cpu.max")).expect("written");
        assert_eq!(written, "200000 100000");
    }

    #[test]
    fn affinity_is_the_way_out_and_says_so() {
        std::thread::spawn(|| {
            let limit = Limit::enter(1).expect("one core can always be had");
            assert!(limit.words().contains("1 "), "{}", limit.words());
            if limit.group.is_none() {
                assert_eq!(allowed_cores().expect("readable").len(), 1);
            }
        })
        .join()
        .expect("no panic");
    }
}
