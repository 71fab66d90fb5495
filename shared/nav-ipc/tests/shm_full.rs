//! Shared memory that is nearly full is a sentence, not SIGBUS: at the start, while running, and when somebody joins.
//!
//! Each case runs in a process of its own with a small file system over `/dev/shm`, where the machine lets us make one.

#[path = "../../nav-model/tests/support/soak.rs"]
mod soak;

use iceoryx2::prelude::{NodeBuilder, ServiceName, ZeroCopySend, ipc};
use nav_core::messages::{CmdVel, Goal, LaserScan, Odometry, Status};
use nav_ipc::{IpcConfig, IpcError, RobotName, RobotNode, Writer};
use std::path::Path;
use std::process::{Command, Output};
use std::time::{Duration, Instant};

const CASE: &str = "NAV_IPC_SHM_CASE";
const ROOT: &str = "NAV_IPC_SHM_ROOT";

#[derive(Clone, Copy, Debug, ZeroCopySend)]
#[type_name("hybridnav/LaserScan/v1")]
#[repr(C)]
struct TheirScan([u64; 725]);

/// The test again in a namespace of its own, with `/dev/shm` of so many KiB; nothing where that is not allowed.
fn in_shared_memory_of(kib: u32, case: &str) -> Option<Output> {
    let folder = tempfile::Builder::new().prefix("nav").tempdir_in("/tmp").expect("a scratch folder");
    let script = format!(
        "mount -t tmpfs -o size={kib}k tmpfs /dev/shm || exit 77; exec \"$0\" --exact child --nocapture"
    );
    let output = Command::new("unshare")
        .args(["--mount", "--propagation", "private", "sh", "-c", &script])
        .arg(std::env::current_exe().expect("this test"))
        .env(CASE, case)
        .env(ROOT, folder.path())
        .output();
    let refused = |output: &Output| {
        let said = String::from_utf8_lossy(&output.stderr);
        output.status.code() == Some(77) || said.contains("unshare failed")
    };
    match output {
        Ok(output) if !refused(&output) => {
            soak::count(&[("programs in a full /dev/shm", 1)]);
            Some(output)
        }
        _ => {
            eprintln!("not checked: this machine does not let us mount a small /dev/shm");
            None
        }
    }
}

/// It ended by itself, without a signal; what it printed.
fn said(output: &Output) -> String {
    let text =
        String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{}: {text}", output.status);
    text
}

fn config() -> IpcConfig {
    IpcConfig::in_folder(Path::new(&std::env::var_os(ROOT).expect("a root"))).expect("a short path")
}

fn node() -> Result<RobotNode, IpcError> {
    RobotNode::open(&RobotName::new("r")?, &config())
}

/// Opens everything and says how that went.
fn start() {
    let opened = node().and_then(|node| {
        Ok((
            node.writer::<CmdVel>()?,
            node.writer::<Status>()?,
            node.writer::<LaserScan>()?,
            node.writer::<Odometry>()?,
            node.writer::<Goal>()?,
            node.reader::<LaserScan>()?,
            node.wakeup::<LaserScan>()?,
            node,
        ))
    });
    match opened {
        Ok((.., scan_out, _, _, _, _, _)) if fill() => println!("opened, {}", send(&scan_out, 200)),
        Ok(_) => println!("opened"),
        Err(error) => println!("{error}"),
    }
}

/// Takes all that is free.
fn fill() -> bool {
    let mut file = std::fs::File::create("/dev/shm/other").expect("a file");
    let mut taken = 0;
    while std::io::Write::write(&mut file, &[1; 4096]).is_ok_and(|len| len > 0) {
        taken += 1;
    }
    taken < 1_000_000
}

fn send(scan_out: &Writer<LaserScan>, count: u64) -> String {
    let mut scan = LaserScan::default();
    for seq in 1..=count {
        scan.header.seq = seq;
        if let Err(error) = scan_out.refresh().and_then(|()| scan_out.write(&scan)) {
            return error.to_string();
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    format!("{count} scans sent")
}

/// Writes into full memory while other programs read and join.
fn join() {
    let node = node().expect("a node");
    let scan_out = node.writer::<LaserScan>().expect("the writer");
    let _reader = node.reader::<LaserScan>().expect("a reader");
    println!("{}", send(&scan_out, 10));
    // The first one joins while there is room, the others when there is none.
    for readers in 0..4 {
        let stock = Command::new(std::env::current_exe().expect("this test"))
            .args(["--exact", "child"])
            .env(CASE, "stock")
            .spawn();
        let began = Instant::now();
        while readers == 0 && scan_out.reader_count() < 2 && began.elapsed() < Duration::from_secs(20) {
            std::thread::sleep(Duration::from_millis(1));
        }
        assert!(readers > 0 || fill());
        println!("{}", send(&scan_out, 200));
        // It may have died of the full memory: it is not ours.
        let _ = stock.expect("a stock reader").wait();
    }
}

/// A reader that knows nothing of us.
fn stock() {
    let config = config().iceoryx2().expect("a configuration");
    let node = NodeBuilder::new().config(&config).create::<ipc::Service>().expect("a node");
    let name = ServiceName::new("hybridnav/r/scan").expect("a name");
    let service = node.service_builder(&name).publish_subscribe::<TheirScan>().open().expect("the service");
    let subscriber = service.subscriber_builder().create().expect("a reader");
    // Held as long as it may, so that the writer must take others.
    let mut held = std::collections::VecDeque::new();
    for _ in 0..100 {
        while let Some(sample) = subscriber.receive().expect("received") {
            held.push_back(sample);
            if held.len() > 1 {
                held.pop_front();
            }
        }
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// Not a test of its own: the process of a case.
#[test]
fn child() {
    match std::env::var(CASE).as_deref() {
        Ok("start") => start(),
        Ok("join") => join(),
        Ok("stock") => stock(),
        _ => (),
    }
}

#[test]
fn a_start_without_room_is_a_sentence_and_one_with_room_keeps_it() {
    let mut started = 0;
    for kib in [8, 16, 40, 64, 100, 160, 220, 260, 320, 400, 640, 900] {
        let Some(output) = in_shared_memory_of(kib, "start") else { return };
        let said = said(&output);
        let is_refused = said.contains("shared memory is full: ");
        assert!(is_refused || said.contains("opened, 200 scans sent"), "{kib} KiB: {said}");
        started += u32::from(!is_refused);
    }
    assert!(started >= 1, "900 KiB are enough");
}

#[test]
fn a_reader_that_joins_when_memory_is_full_does_not_end_the_writer() {
    let Some(output) = in_shared_memory_of(600, "join") else { return };
    let said = said(&output);
    assert!(said.contains("10 scans sent"), "{said}");
    let ends = said.matches("200 scans sent").count() + said.matches("shared memory is full").count();
    assert!(ends >= 4, "each time it went on or said why not: {said}");
}
