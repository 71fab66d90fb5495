//! The drivers that the topics' page shows drive: each reaches its goal with the real runtime, and stops by itself when the
//! runtime is gone.
//!
//! The one in Python needs the environment of `cargo xtask python`. Without it, its test passes and says so, unless the
//! variable `CI` is `true`: then it fails.

mod support;

use nav_core::messages::{Goal, Odometry, RunState, Status};
use nav_ipc::Reader;
use std::path::{Path, PathBuf};
use std::process::Command;
use support::Stage;
use support::programs::{Running, wait_until};

/// The checkout.
fn checkout() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}

fn newest(reader: &Reader<Odometry>) -> Odometry {
    let mut message = Odometry::default();
    wait_until("odometry", || reader.read_latest(&mut message).expect("received"));
    message
}

/// Drives, loses its runtime, stands, and reaches its goal with another one.
fn assert_drives_and_stops(mut driver: Command) {
    let stage = Stage::with_shipped_model();
    let node = stage.node();
    let (odom, goal) =
        (node.reader::<Odometry>().expect("a reader"), node.reader::<Goal>().expect("a reader"));
    let status = node.reader::<Status>().expect("a reader");
    driver.arg("robot").arg(stage.ipc_root());
    let mut driver = Running::of("driver", driver);
    let first = Running::start("runtime", &stage, &["run", "--quiet"]);
    wait_until("it drives", || {
        assert!(driver.is_running(), "the driver ended");
        newest(&odom).linear_mps > 0.3
    });
    first.signal(libc::SIGKILL);
    drop(first);
    let killed = newest(&odom);
    wait_until("it stands", || newest(&odom).linear_mps == 0.0);
    let stood = newest(&odom);
    // The age of 0.25 s at most, a period, and the ramp from 1 m/s: 0.6 m; some more for a busy machine.
    let way_m = (stood.pose.position() - killed.pose.position()).norm();
    assert!(way_m < 1.0, "{way_m} m without a command");
    wait_until("a second passes", || newest(&odom).header.seq > stood.header.seq + 10);
    assert_eq!(newest(&odom).pose, stood.pose, "and stays");

    let second = Running::start("runtime", &stage, &["run", "--quiet"]);
    let mut newest_status = Status::default();
    wait_until("it is at the goal", || {
        assert!(driver.is_running(), "the driver ended");
        let is_new = status.read_latest(&mut newest_status).expect("received");
        is_new && newest_status.state == RunState::Reached as u32
    });
    let mut target = Goal::default();
    assert!(goal.read_latest(&mut target).expect("received"));
    let (x_m, y_m) = (newest(&odom).pose.x_m - target.x_m, newest(&odom).pose.y_m - target.y_m);
    assert!(x_m.hypot(y_m) < target.radius_m + 0.2, "{x_m} m, {y_m} m from the goal");
    second.signal(libc::SIGTERM);
    second.end().stopped_by(libc::SIGTERM);
}

/// The example, beside this test; built if nobody has.
fn example() -> PathBuf {
    let test = std::env::current_exe().expect("the test's own path");
    let folder = test.parent().and_then(Path::parent).expect("target/<profile>/deps");
    let example = folder.join("examples/driver");
    if !example.exists() {
        let mut build = Command::new(env!("CARGO"));
        build.args(["build", "--workspace", "--example", "driver"]);
        if folder.ends_with("release") {
            build.arg("--release");
        }
        build.arg("--target-dir").arg(folder.parent().expect("the target folder")).current_dir(checkout());
        assert!(build.status().expect("cargo starts").success(), "the example could not be built");
    }
    example
}

#[test]
fn the_driver_in_rust() {
    assert_drives_and_stops(Command::new(example()));
}

/// An interpreter that has iceoryx2; nothing when it is missing and need not be there.
fn python() -> Option<PathBuf> {
    let python = checkout().join(".tools/python/bin/python3");
    let has_iceoryx2 = |python: &Path| {
        let asked = Command::new(python).args(["-c", "import iceoryx2"]).output();
        asked.is_ok_and(|output| output.status.success())
    };
    if has_iceoryx2(&python) {
        return Some(python);
    }
    let required = std::env::var("CI").is_ok_and(|value| value == "true");
    assert!(!required, "{} has no iceoryx2: run `cargo xtask python` once", python.display());
    eprintln!("not checked: {} has no iceoryx2; `cargo xtask python` installs it", python.display());
    None
}

#[test]
fn the_driver_in_python() {
    let Some(python) = python() else { return };
    let mut driver = Command::new(python);
    driver.arg(checkout().join("shared/nav-ipc/examples/python/driver.py"));
    assert_drives_and_stops(driver);
}
