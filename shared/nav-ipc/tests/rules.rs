//! One writer a topic, robots apart, the newest message, wake-ups in time.

#[path = "../../nav-model/tests/support/soak.rs"]
mod soak;

use nav_core::messages::{CmdVel, Goal, Header, LaserScan};
use nav_ipc::{IpcConfig, IpcError, RobotName, RobotNode, clock};
use std::time::Duration;

struct Stage {
    config: IpcConfig,
    _folder: tempfile::TempDir,
}

impl Stage {
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("a scratch folder");
        let config = IpcConfig::in_folder(folder.path()).expect("a short path");
        Self { config, _folder: folder }
    }

    /// Files in shared memory that belong to this stage.
    fn shared_files(&self) -> usize {
        let prefix = self.config.iceoryx2().expect("a configuration").global.prefix.to_string();
        let files = std::fs::read_dir("/dev/shm").expect("shared memory is mounted").flatten();
        files.filter(|file| file.file_name().to_string_lossy().starts_with(&prefix)).count()
    }

    fn node(&self, robot: &str) -> RobotNode {
        RobotNode::open(&RobotName::new(robot).expect("a plain name"), &self.config).expect("a node")
    }
}

impl Drop for Stage {
    fn drop(&mut self) {
        self.config.remove_all();
    }
}

fn goal(seq: u64) -> Goal {
    Goal { header: Header { stamp_ns: seq, seq }, ..Goal::default() }
}

#[test]
fn a_second_writer_is_refused_and_the_place_is_free_again_later() {
    let stage = Stage::new();
    let (one, two) = (stage.node("r"), stage.node("r"));
    let writer = one.writer::<CmdVel>().expect("the first writer");
    let error = two.writer::<CmdVel>().expect_err("a second writer");
    assert!(matches!(error, IpcError::SecondWriter { .. }), "{error}");
    let process = format!("process {}", std::process::id());
    assert!(error.to_string().contains(&process), "{error}");
    soak::count(&[("second writers kept out", 1)]);
    assert!(stage.node("other").writer::<CmdVel>().is_ok(), "another robot is another topic");
    drop(writer);
    assert!(two.writer::<CmdVel>().is_ok(), "the first writer is gone");
}

#[test]
fn readers_get_the_newest_and_only_their_robots_messages() {
    let stage = Stage::new();
    let node = stage.node("r");
    let reader = node.reader::<Goal>().expect("a reader before the writer");
    let stranger = stage.node("s").reader::<Goal>().expect("a reader of another robot");
    let writer = node.writer::<Goal>().expect("the writer");
    let mut newest = Goal::default();
    assert!(!reader.read_latest(&mut newest).expect("nothing yet"));
    for seq in 1..=100 {
        writer.write(&goal(seq)).expect("sent");
    }
    assert!(reader.read_latest(&mut newest).expect("received"));
    assert_eq!(newest.header.seq, 100);
    assert!(!reader.read_latest(&mut newest).expect("nothing new"));
    assert!(!stranger.read_latest(&mut newest).expect("nothing for this robot"));
}

#[test]
fn a_writer_may_come_back() {
    let stage = Stage::new();
    let node = stage.node("r");
    let reader = node.reader::<Goal>().expect("a reader");
    let mut newest = Goal::default();
    for seq in 1..4 {
        let writer = stage.node("r").writer::<Goal>().expect("the place is free");
        writer.write(&goal(seq)).expect("sent");
        assert!(reader.read_latest(&mut newest).expect("received"));
        assert_eq!(newest.header.seq, seq);
    }
}

#[test]
fn waiting_ends_with_a_message_or_at_the_deadline() {
    let stage = Stage::new();
    let config = stage.config.clone();
    let node = stage.node("r");
    let wakeup = node.wakeup::<LaserScan>().expect("a wakeup");

    let deadline_ns = clock::monotonic_ns() + 30_000_000;
    assert!(!wakeup.wait_until(deadline_ns).expect("waited"));
    assert!(clock::monotonic_ns() >= deadline_ns, "not before the deadline");

    let other = std::thread::spawn(move || {
        let node = RobotNode::open(&RobotName::new("r").expect("a plain name"), &config).expect("a node");
        let writer = node.writer::<LaserScan>().expect("the writer");
        let mut scan = LaserScan::default();
        for seq in 1..=500 {
            scan.header.seq = seq;
            writer.write(&scan).expect("sent");
            std::thread::sleep(Duration::from_micros(100));
        }
    });
    let reader = node.reader::<LaserScan>().expect("a reader");
    let mut scan = LaserScan::default();
    let started_ns = clock::monotonic_ns();
    while scan.header.seq < 500 {
        assert!(wakeup.wait(Duration::from_secs(10)).expect("waited"), "woken, not timed out");
        reader.read_latest(&mut scan).expect("received");
        assert!(clock::monotonic_ns() - started_ns < 60_000_000_000, "stuck at {}", scan.header.seq);
    }
    other.join().expect("the writer ended well");
}

#[test]
fn an_unusable_folder_is_one_clear_sentence() {
    let file = tempfile::NamedTempFile::new().expect("a scratch file");
    let config = IpcConfig::in_folder(&file.path().join("x")).expect("a short path");
    let error = RobotNode::open(&RobotName::new("r").expect("a plain name"), &config).expect_err("no folder");
    assert!(error.to_string().contains("writable"), "{error}");
}

#[test]
fn nothing_is_left_after_all_is_removed() {
    let stage = Stage::new();
    let writer = stage.node("r").writer::<Goal>().expect("the writer");
    // As after a kill: nobody says goodbye.
    std::mem::forget(writer);
    assert!(stage.shared_files() > 1, "leftovers");
    stage.config.remove_all();
    assert_eq!((stage.shared_files(), stage.config.root().exists()), (0, false));
}
