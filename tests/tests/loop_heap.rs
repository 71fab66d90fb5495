//! The proof that the loop does not allocate is itself proved: a controller that does is counted.

mod support;

use nav_core::messages::{Goal, Header, LaserScan, Odometry};
use nav_host::stop::Stop;
use nav_host::terminal::{Level, set_level};
use nav_ipc::clock::monotonic_ns;
use nav_ipc::{IpcConfig, RobotName, RobotNode};
use nav_model::alloc::CheckedAllocator;
use runtime::run::drive::drive;
use runtime::run::live::Live;
use runtime::run::plan::{DrivePlan, End, Pace};
use runtime::run::ports::Ports;
use runtime::run::tally::Tally;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use support::Stage;
use support::stub::Stub;

#[global_allocator]
static ALLOCATOR: CheckedAllocator = CheckedAllocator;

/// Publishes scans at 200 Hz until told to end.
fn publisher(config: IpcConfig, ended: Arc<AtomicBool>) -> std::thread::JoinHandle<()> {
    std::thread::spawn(move || {
        let robot = RobotName::new("robot").expect("a plain name");
        let node = RobotNode::open(&robot, &config).expect("a node");
        let scan_out = node.writer::<LaserScan>().expect("the scan writer");
        let odom_out = node.writer::<Odometry>().expect("the odometry writer");
        let goal_out = node.writer::<Goal>().expect("the goal writer");
        let mut scan = Box::<LaserScan>::default();
        for seq in 1.. {
            if ended.load(Ordering::Relaxed) {
                break;
            }
            let header = Header { stamp_ns: monotonic_ns(), seq };
            odom_out.write(&Odometry { header, ..Odometry::default() }).expect("sent");
            goal_out.write(&Goal { header, ..Goal::default() }).expect("sent");
            scan.header = header;
            scan_out.write(&scan).expect("sent");
            std::thread::sleep(Duration::from_millis(5));
        }
    })
}

fn heap_of_a_run(pace: Pace, allocates: bool) -> (Tally, u64) {
    let stage = Stage::new();
    let config = IpcConfig::in_folder(&stage.ipc_root()).expect("a short path");
    let mut ports = Ports::open(&RobotName::new("robot").expect("a plain name"), &config).expect("ports");
    let ended = Arc::new(AtomicBool::new(false));
    let publisher = publisher(config, ended.clone());
    let plan = DrivePlan {
        pace,
        duration: Some(Duration::from_millis(700)),
        idle_exit: Some(Duration::from_secs(20)),
        exit_with_peer: false,
        assert_no_alloc: false,
        period_ns: Some(5_000_000),
    };
    let mut stub = Stub::new(|tick| {
        if allocates && tick.is_multiple_of(10) {
            drop(std::hint::black_box(vec![tick; 3]));
        }
        (0.0, 0.0)
    });
    let mut tally = Tally::new(5_000_000);
    let end = drive(&mut stub, &mut ports, &plan, &Stop::default(), &Live::default(), &mut tally);
    assert_eq!(end.expect("a good run"), End::Duration);
    ended.store(true, Ordering::Relaxed);
    publisher.join().expect("the publisher ended well");
    (tally, stub.ticks)
}

#[test]
fn a_loop_that_allocates_is_caught_and_one_that_does_not_is_not() {
    // With debug the loop hands over what it met, too.
    for (pace, level) in [(Pace::Clock, Level::Info), (Pace::Scan, Level::Info), (Pace::Scan, Level::Debug)] {
        set_level(level);
        let (tally, ticks) = heap_of_a_run(pace, true);
        assert!(ticks > 20, "{pace:?}: {ticks}");
        assert_eq!(tally.heap.allocations, ticks / 10, "{pace:?}, {level:?}: one in ten ticks");
        let (tally, ticks) = heap_of_a_run(pace, false);
        assert_eq!((tally.heap.allocations, tally.heap.frees), (0, 0), "{pace:?}, {level:?}, {ticks} ticks");
        assert_eq!(tally.ticks, ticks);
    }
}
