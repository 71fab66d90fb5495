//! Writing, reading and waiting allocate nothing once both sides are connected.

use nav_core::messages::{CmdVel, Header, LaserScan};
use nav_ipc::{IpcConfig, RobotName, RobotNode};
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::time::Duration;

struct Counting;

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

fn count() {
    // A thread that ends may allocate after its counter is gone.
    let _ = ALLOCATIONS.try_with(|n| n.set(n.get() + 1));
}

// SAFETY: forwards to the system allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: as promised by the caller.
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: as promised by the caller.
        unsafe { System.dealloc(pointer, layout) }
    }
    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count();
        // SAFETY: as promised by the caller.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn allocations_in(work: impl FnOnce()) -> u64 {
    let before = ALLOCATIONS.get();
    work();
    ALLOCATIONS.get() - before
}

#[test]
fn the_counter_counts() {
    assert_eq!(allocations_in(|| drop(std::hint::black_box(Box::new(7_u64)))), 1);
    assert_eq!(allocations_in(|| std::hint::black_box(String::with_capacity(9)).push('x')), 1);
}

#[test]
fn a_connected_exchange_allocates_nothing() {
    let folder = tempfile::tempdir().expect("a scratch folder");
    let config = IpcConfig::in_folder(folder.path()).expect("a short path");
    let robot = RobotName::new("r").expect("a plain name");
    let runtime = RobotNode::open(&robot, &config).expect("a node");
    let simulator = RobotNode::open(&robot, &config).expect("a second node");
    let scan_out = simulator.writer::<LaserScan>().expect("the scan writer");
    let scan_in = runtime.reader::<LaserScan>().expect("a scan reader");
    let wakeup = runtime.wakeup::<LaserScan>().expect("a wakeup");
    let command_out = runtime.writer::<CmdVel>().expect("the command writer");
    let command_in = simulator.reader::<CmdVel>().expect("a command reader");

    let mut scan = LaserScan::default();
    let mut seen = Box::new(LaserScan::default());
    let mut command = CmdVel::default();
    let mut round = |seq: u64| {
        scan.header = Header { stamp_ns: seq * 100, seq };
        scan_out.write(&scan).expect("sent");
        assert!(wakeup.wait(Duration::from_secs(5)).expect("waited"));
        assert!(scan_in.read_latest(&mut seen).expect("received"));
        command_out.write(&CmdVel { scan_seq: seen.header.seq, ..CmdVel::default() }).expect("sent");
        assert!(command_in.read_latest(&mut command).expect("received"));
        assert_eq!(command.scan_seq, seq);
        assert!(!wakeup.wait(Duration::from_micros(50)).expect("waited in vain"));
    };
    round(1);
    let rounds = allocations_in(|| (2..2000).for_each(&mut round));
    assert_eq!(rounds, 0, "in about two thousand exchanges");
    // Nobody reads: the slab and the queues must not fill up either.
    let unread = allocations_in(|| (0..2000).for_each(|_| scan_out.write(&scan).expect("sent")));
    assert_eq!(unread, 0, "in two thousand messages that nobody takes");

    let joining = runtime.reader::<LaserScan>().expect("a second reader");
    let refresh = allocations_in(|| scan_out.refresh().expect("connected"));
    assert!(refresh > 0, "a peer that joins costs allocations, in `refresh`");
    let after = allocations_in(|| scan_out.write(&scan).expect("sent"));
    assert_eq!(after, 0, "after `refresh`");
    drop((joining, scan_out, scan_in, wakeup, command_out, command_in, runtime, simulator));
    config.remove_all();
}
