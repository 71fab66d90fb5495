//! Who may speak while the loop drives: a stock peer that wants to write, too, a second driver, and one that died.

mod support;

use iceoryx2::prelude::*;
use nav_core::messages::{Odometry, Status, fault};
use nav_ipc::IpcConfig;
use support::Stage;
use support::programs::{Running, run, wait_until};
use support::soak::count;

const DRIVE: [&str; 4] = ["--family", "clutter", "--episodes", "50"];

/// The payload of odometry, as another program has it.
#[derive(Clone, Copy, Debug, ZeroCopySend)]
#[type_name("hybridnav/Odometry/v1")]
#[repr(C)]
struct StockOdometry([u64; 5]);

fn stock_node(stage: &Stage) -> Node<ipc::Service> {
    let config = IpcConfig::in_folder(&stage.ipc_root()).expect("a short path");
    NodeBuilder::new().config(&config.iceoryx2().expect("valid")).create().expect("a stock node")
}

fn odom() -> ServiceName {
    ServiceName::new("hybridnav/robot/odom").expect("a service name")
}

fn wait_until_driving(stage: &Stage) {
    let node = stage.node();
    let reader = node.reader::<Odometry>().expect("a reader");
    let mut odom = Odometry::default();
    wait_until("the robot drives", || {
        reader.read_latest(&mut odom).expect("received") && odom.linear_mps > 0.3
    });
}

/// What is open for several writers is refused before anything drives, with who opened it.
#[test]
fn a_topic_that_others_could_write_keeps_the_runtime_from_driving() {
    let stage = Stage::new();
    drop(stage.node());
    let node = stock_node(&stage);
    let service = node.service_builder(&odom()).publish_subscribe::<StockOdometry>();
    let _service = service.max_publishers(2).create().expect("a service");
    run("runtime", &stage, &["run"]).refused(&[
        "lets 2 programs write it",
        "process ",
        "max_publishers(1)",
        "restart it",
    ]);
    count(&[("topics that others could write refused", 1)]);
}

/// While the loop drives nobody gets a second writer's place, and nobody who tries disturbs the drive.
#[test]
fn a_second_writer_is_kept_out_of_a_drive() {
    let stage = Stage::new();
    let mut runtime = Running::start("runtime", &stage, &["run"]);
    let mut simulator = Running::start("simulator", &stage, &DRIVE);
    wait_until_driving(&stage);
    let second = run("simulator", &stage, &DRIVE);
    second.refused(&["already has a writer of `scan`", &format!("process {}", simulator.id())]);
    let node = stock_node(&stage);
    let builder = || node.service_builder(&odom()).publish_subscribe::<StockOdometry>();
    let service = builder().open().expect("it may be read");
    assert!(service.publisher_builder().create().is_err(), "but not written");
    assert!(builder().max_publishers(2).open().is_err(), "nor opened for more");
    count(&[("second writers kept out", 3)]);
    assert!(runtime.is_running() && simulator.is_running());
    wait_until_driving(&stage);
    runtime.signal(libc::SIGTERM);
    let ended = runtime.end().stopped_by(libc::SIGTERM);
    assert!(!ended.stdout.contains("programs write"), "{}", ended.stdout);
}

/// A writer that was killed is not called a running program: the loop names the silence, and the next one takes its place.
#[test]
fn a_killed_writer_is_no_running_program() {
    let stage = Stage::new();
    let node = stage.node();
    let (statuses, mut status) = (node.reader::<Status>().expect("a reader"), Status::default());
    let mut runtime = Running::start("runtime", &stage, &["run"]);
    let first = Running::start("simulator", &stage, &DRIVE);
    wait_until_driving(&stage);
    first.signal(libc::SIGKILL);
    drop(first);
    wait_until("the loop names the silence", || {
        statuses.read_latest(&mut status).expect("received") && status.faults & fault::STALE_SCAN != 0
    });
    let mut second = Running::start("simulator", &stage, &DRIVE);
    wait_until_driving(&stage);
    assert!(runtime.is_running() && second.is_running());
    second.signal(libc::SIGKILL);
    drop(second);
    runtime.signal(libc::SIGTERM);
    let ended = runtime.end().stopped_by(libc::SIGTERM);
    assert!(ended.stdout.contains("ticks with stale scan"), "{}", ended.stdout);
}
