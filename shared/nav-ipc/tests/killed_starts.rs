//! A start that is killed at any moment never keeps the next one from starting.
//!
//! `NAV_IPC_KILLS=1000` repeats it longer than the few tens of times here, `NAV_SOAK_SEED` at other moments.

#[path = "../../nav-model/tests/support/soak.rs"]
mod soak;

use nav_core::messages::{CmdVel, Goal, Header, LaserScan, Odometry, Status};
use nav_ipc::{IpcConfig, IpcError, RobotName, RobotNode};
use soak::{count, setting};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

const ROOT: &str = "NAV_IPC_CHILD_ROOT";

/// What a runtime opens and what a driver opens, in one process; then waits if asked to.
fn start(config: &IpcConfig, stay: Duration) -> Result<(), IpcError> {
    let node = RobotNode::open(&RobotName::new("r")?, config)?;
    let _out = (
        node.writer::<CmdVel>()?,
        node.writer::<Status>()?,
        node.writer::<LaserScan>()?,
        node.writer::<Odometry>()?,
        node.writer::<Goal>()?,
    );
    let _in = (node.reader::<LaserScan>()?, node.reader::<Odometry>()?, node.wakeup::<LaserScan>()?);
    std::thread::sleep(stay);
    Ok(())
}

/// Not a test of its own: the process that the other tests kill. Does nothing without its variable.
#[test]
fn child() {
    if let Some(root) = std::env::var_os(ROOT) {
        let config = IpcConfig::in_folder(Path::new(&root)).expect("a short path");
        start(&config, Duration::from_secs(60)).expect("a start");
    }
}

fn child_in(root: &Path, name: &str) -> std::process::Child {
    Command::new(std::env::current_exe().expect("this test"))
        .args(["--exact", name])
        .env(ROOT, root)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("the test starts itself")
}

/// A number of microseconds below `below`, of a fixed sequence (SplitMix64).
fn random_us(state: &mut u64, below: u64) -> u64 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    (z ^ (z >> 31)) % below
}

/// Starts a process in a root, kills it within 60 ms of its first step, and says when that was, us.
fn start_and_kill(root: &Path, state: &mut u64) -> u64 {
    let mut killed = child_in(root, "child");
    // Loading the test takes a while: the clock starts with its lock.
    let spawned = Instant::now();
    let process = format!("{}\n", killed.id());
    let has_begun = || std::fs::read_to_string(root.join("start.lock")).is_ok_and(|holder| holder == process);
    while !has_begun() && spawned.elapsed() < Duration::from_secs(20) {
        std::hint::spin_loop();
    }
    let after_us = random_us(state, 60_000);
    std::thread::sleep(Duration::from_micros(after_us));
    killed.kill().expect("killed");
    killed.wait().expect("waited for");
    after_us
}

fn kills() -> u64 {
    setting("NAV_IPC_KILLS", 40)
}

/// Where the sequence of a test begins.
fn dice(test: u64) -> u64 {
    setting("NAV_SOAK_SEED", 1) << 8 | test
}

#[test]
fn a_start_that_was_killed_does_not_block_the_next() {
    let folder = tempfile::Builder::new().prefix("nav").tempdir_in("/tmp").expect("a scratch folder");
    let mut state = dice(7);
    let mut refused = Vec::new();
    for kill in 0..kills() {
        // A robot that has never run, as after a boot: then all that a start makes is made in it.
        let root = folder.path().join(kill.to_string());
        let config = IpcConfig::in_folder(&root).expect("a short path");
        let after_us = start_and_kill(&root, &mut state);
        if let Err(error) = start(&config, Duration::ZERO) {
            refused.push(format!("after {after_us} us: {error}"));
        }
        config.remove_all();
    }
    count(&[("starts killed", kills()), ("starts after them refused", refused.len() as u64)]);
    assert!(refused.is_empty(), "{} starts were refused:\n{}", refused.len(), refused.join("\n"));
}

#[test]
fn nor_does_it_where_another_program_of_the_robot_lives() {
    let folder = tempfile::Builder::new().prefix("nav").tempdir_in("/tmp").expect("a scratch folder");
    let config = IpcConfig::in_folder(folder.path()).expect("a short path");
    let node = RobotNode::open(&RobotName::new("r").expect("a plain name"), &config).expect("a node");
    let goals = node.reader::<Goal>().expect("a reader that stays");
    let mut state = dice(11);
    for kill in 1..=kills() / 2 {
        let after_us = start_and_kill(folder.path(), &mut state);
        let again = RobotNode::open(&RobotName::new("r").expect("a plain name"), &config)
            .and_then(|node| {
                Ok((node.writer::<Goal>()?, node.writer::<LaserScan>()?, node.writer::<CmdVel>()?, node))
            })
            .unwrap_or_else(|error| panic!("after {after_us} us: {error}"));
        let sent = Goal { header: Header { stamp_ns: kill, seq: kill }, ..Goal::default() };
        again.0.write(&sent).expect("sent");
        let mut goal = Goal::default();
        assert!(goals.read_latest(&mut goal).expect("received"), "the one that lives is still connected");
        assert_eq!(goal.header.seq, kill);
    }
    count(&[("starts killed beside a program that lives", kills() / 2)]);
    drop((goals, node));
    config.remove_all();
}

/// Whoever has been there all along finds a writer that lives, and the place of one that died.
#[test]
fn the_place_of_a_killed_writer_is_free_for_who_was_there_before() {
    let folder = tempfile::Builder::new().prefix("nav").tempdir_in("/tmp").expect("a scratch folder");
    let config = IpcConfig::in_folder(folder.path()).expect("a short path");
    let node = RobotNode::open(&RobotName::new("r").expect("a plain name"), &config).expect("a node");
    let scans = node.reader::<LaserScan>().expect("a reader");
    let mut peer = child_in(folder.path(), "child");
    let started = Instant::now();
    while scans.writer_count() == 0 {
        assert!(started.elapsed() < Duration::from_secs(20), "the writer never came");
        std::thread::sleep(Duration::from_millis(1));
    }
    let error = node.writer::<LaserScan>().expect_err("it lives").to_string();
    assert!(error.contains(&format!("process {}", peer.id())), "{error}");
    peer.kill().expect("killed");
    peer.wait().expect("waited for");
    let writer = node.writer::<LaserScan>().expect("the place of one who died");
    drop((writer, scans, node));
    config.remove_all();
}

/// Not a test of its own: a reader of a topic that somebody writes.
#[test]
fn reading_child() {
    if let Some(root) = std::env::var_os(ROOT) {
        let config = IpcConfig::in_folder(Path::new(&root)).expect("a short path");
        let node = RobotNode::open(&RobotName::new("r").expect("a plain name"), &config).expect("a node");
        let _goals = node.reader::<Goal>().expect("a reader");
        std::thread::sleep(Duration::from_secs(60));
    }
}

/// A peer that is killed after it has made the file of a connection and before that has a size: as small as the moment is,
/// the loop that writes must outlive it.
#[test]
fn a_peer_that_was_killed_while_connecting_holds_no_loop_up() {
    let folder = tempfile::Builder::new().prefix("nav").tempdir_in("/tmp").expect("a scratch folder");
    let config = IpcConfig::in_folder(folder.path()).expect("a short path");
    let node = RobotNode::open(&RobotName::new("r").expect("a plain name"), &config).expect("a node");
    let goals = node.writer::<Goal>().expect("a writer");
    let mut peer = child_in(folder.path(), "reading_child");
    let started = Instant::now();
    while goals.reader_count() == 0 {
        assert!(started.elapsed() < Duration::from_secs(20), "the reader never came");
        std::thread::sleep(Duration::from_millis(1));
    }
    peer.kill().expect("killed");
    peer.wait().expect("waited for");
    let files = std::fs::read_dir("/dev/shm").expect("shared memory is mounted").flatten();
    let mut connections = files.map(|file| file.path()).filter(|path| {
        path.to_string_lossy().contains(config.prefix())
            && path.extension().is_some_and(|kind| kind == "connection")
    });
    let connection = connections.next().expect("the reader has made it");
    std::fs::write(&connection, []).expect("emptied, as it was at first");
    let is_over = Arc::new(AtomicBool::new(false));
    let seen = is_over.clone();
    std::thread::spawn(move || {
        std::thread::sleep(Duration::from_secs(20));
        if !seen.load(Ordering::Relaxed) {
            // A call that never returns cannot fail a test in another way.
            eprintln!("the loop hangs in its write");
            std::process::abort();
        }
    });
    let error = goals.write(&Goal::default()).expect_err("half made").to_string();
    let name = connection.to_string_lossy();
    assert!(error.contains(&*name) && error.contains("open in: nobody"), "{error}");
    is_over.store(true, Ordering::Relaxed);
    goals.write(&Goal::default()).expect("said once");
    drop((goals, node));
    config.remove_all();
}

/// iceoryx2 waits for such a file for ever, whatever time-out it is given.
#[test]
fn a_file_that_never_got_its_size_is_removed() {
    let folder = tempfile::Builder::new().prefix("nav").tempdir_in("/tmp").expect("a scratch folder");
    let config = IpcConfig::in_folder(folder.path()).expect("a short path");
    start(&config, Duration::ZERO).expect("a first start");
    let prefix = config.prefix();
    let files = std::fs::read_dir("/dev/shm").expect("shared memory is mounted").flatten();
    let counter = files.map(|file| file.path()).find(|path| path.to_string_lossy().contains(prefix));
    let counter = counter.expect("the counter of nodes stays");
    std::fs::write(&counter, []).expect("emptied");
    start(&config, Duration::ZERO).expect("a start without the leftover");
    // Somebody who has it open may still be making it: then who that is, is said.
    let open = std::fs::File::create(&counter).expect("emptied and held open");
    let error = start(&config, Duration::ZERO).expect_err("half made").to_string();
    assert!(error.contains(&format!("process {}", std::process::id())), "{error}");
    drop(open);
    start(&config, Duration::ZERO).expect("given up");
    config.remove_all();
}
