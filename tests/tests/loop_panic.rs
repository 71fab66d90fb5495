//! A controller that panics leaves a robot that is told to stop.

mod support;

use nav_core::messages::{CmdVel, Goal, Header, LaserScan, Odometry};
use nav_host::stop::Stop;
use nav_ipc::clock::monotonic_ns;
use nav_ipc::{IpcConfig, RobotName};
use runtime::run::drive::drive;
use runtime::run::live::Live;
use runtime::run::plan::{DrivePlan, Pace};
use runtime::run::ports::Ports;
use runtime::run::tally::Tally;
use std::panic::{AssertUnwindSafe, catch_unwind};
use support::Stage;
use support::stub::Stub;

#[test]
fn the_last_command_of_a_loop_that_panics_is_zero() {
    let stage = Stage::new();
    let config = IpcConfig::in_folder(&stage.ipc_root()).expect("a short path");
    let mut ports = Ports::open(&RobotName::new("robot").expect("a plain name"), &config).expect("ports");
    let node = stage.node();
    let command_in = node.reader::<CmdVel>().expect("a command reader");
    let header = Header { stamp_ns: monotonic_ns(), seq: 1 };
    node.writer::<Odometry>()
        .expect("a writer")
        .write(&Odometry { header, ..Odometry::default() })
        .expect("sent");
    node.writer::<Goal>().expect("a writer").write(&Goal { header, ..Goal::default() }).expect("sent");
    let scan_out = node.writer::<LaserScan>().expect("a writer");
    scan_out.write(&LaserScan { header, ..LaserScan::default() }).expect("sent");
    let plan = DrivePlan {
        pace: Pace::Clock,
        duration: None,
        idle_exit: Some(std::time::Duration::from_secs(20)),
        exit_with_peer: false,
        assert_no_alloc: false,
        period_ns: None,
    };
    // Drives at full speed for a tick, then panics.
    let mut faulty = Stub::new(|tick| {
        assert!(tick < 2, "a defect");
        (1.0, 0.5)
    });
    let mut tally = Tally::new(100_000_000);
    let driven = catch_unwind(AssertUnwindSafe(|| {
        drive(&mut faulty, &mut ports, &plan, &Stop::default(), &Live::default(), &mut tally)
    }));
    assert!(driven.is_err(), "the panic is not swallowed");
    let mut last = CmdVel::default();
    assert!(command_in.read_latest(&mut last).expect("received"));
    assert!(last.header.seq > 1 && last.linear_mps <= 0.0 && last.angular_radps <= 0.0, "{last:?}");
}
