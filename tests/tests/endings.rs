//! How a loop ends, seen from the command topic: by a ramp while the robot drives by commands, and at once after a
//! silence.

mod support;

use nav_core::guard::command_age_limit_ns;
use nav_core::messages::{CmdVel, Goal, Header, LaserScan, Odometry};
use nav_host::stop::Stop;
use nav_ipc::clock::monotonic_ns;
use nav_ipc::{IpcConfig, RobotName, RobotNode};
use runtime::run::drive::drive;
use runtime::run::live::Live;
use runtime::run::plan::{DriveError, DrivePlan, End, Pace};
use runtime::run::ports::Ports;
use runtime::run::tally::Tally;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc;
use std::thread::sleep;
use std::time::Duration;
use support::Stage;
use support::stub::Stub;

const PERIOD: Duration = Duration::from_millis(100);

/// Publishes so many scans, a hundred a second, and leaves; says when the first is out.
fn publish(config: &IpcConfig, scans: u64, begun: &mpsc::Sender<()>) {
    let node = RobotNode::open(&RobotName::new("robot").expect("a plain name"), config).expect("a node");
    let scan_out = node.writer::<LaserScan>().expect("the scan writer");
    let odom_out = node.writer::<Odometry>().expect("the odometry writer");
    let goal_out = node.writer::<Goal>().expect("the goal writer");
    let mut scan = Box::<LaserScan>::default();
    for seq in 1..=scans {
        let header = Header { stamp_ns: monotonic_ns(), seq };
        odom_out.write(&Odometry { header, ..Odometry::default() }).expect("sent");
        goal_out.write(&Goal { header, ..Goal::default() }).expect("sent");
        scan.header = header;
        scan_out.write(&scan).expect("sent");
        if seq == 1 {
            begun.send(()).expect("somebody waits");
        }
        sleep(PERIOD / 10);
    }
}

/// Drives by the stub's commands, and returns how it ended and what was commanded.
fn driven(plan: DrivePlan, scans: u64) -> (Result<End, DriveError>, Vec<CmdVel>) {
    let stage = Stage::new();
    let config = IpcConfig::in_folder(&stage.ipc_root()).expect("a short path");
    let mut ports = Ports::open(&RobotName::new("robot").expect("a plain name"), &config).expect("ports");
    let ended = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let listener = scope.spawn(|| {
            let node = stage.node();
            let command_in = node.reader::<CmdVel>().expect("a command reader");
            let (mut commands, mut command) = (Vec::new(), CmdVel::default());
            loop {
                // Asked first, so that what was sent before the end is read after it.
                let is_over = ended.load(Ordering::Relaxed);
                while command_in.read_latest(&mut command).expect("received") {
                    commands.push(command);
                }
                if is_over {
                    return commands;
                }
                sleep(Duration::from_millis(1));
            }
        });
        // The reader is there before the first command.
        sleep(Duration::from_millis(200));
        let (begun, has_begun) = mpsc::channel();
        let config = &config;
        scope.spawn(move || publish(config, scans, &begun));
        has_begun.recv().expect("scans come");
        let mut stub = Stub::new(|_| (0.8, 0.0));
        let (stop, live) = (Stop::default(), Live::default());
        let mut tally = Tally::new(PERIOD.as_nanos() as u64);
        let end = drive(&mut stub, &mut ports, &plan, &stop, &live, &mut tally);
        ended.store(true, Ordering::Relaxed);
        (end, listener.join().expect("no panic"))
    })
}

fn plan(pace: Pace) -> DrivePlan {
    DrivePlan {
        pace,
        duration: None,
        idle_exit: Some(Duration::from_secs(20)),
        exit_with_peer: true,
        assert_no_alloc: false,
        period_ns: None,
    }
}

fn speeds(commands: &[CmdVel]) -> Vec<f32> {
    commands.iter().map(|command| command.linear_mps).collect()
}

#[test]
fn a_peer_that_leaves_a_robot_is_followed_by_a_ramp() {
    let (end, commands) = driven(plan(Pace::Clock), 60);
    assert!(matches!(end, Ok(End::PeerLeft)), "{end:?}");
    for pair in commands.windows(2) {
        let silent_ns = pair[1].header.stamp_ns - pair[0].header.stamp_ns;
        let change_mps = (pair[0].linear_mps - pair[1].linear_mps).abs();
        // 2 m/s² at 10 Hz, unless a busy machine left the base without commands for so long that it stands.
        assert!(
            change_mps < 0.21 || silent_ns > command_age_limit_ns(PERIOD.as_nanos() as u64),
            "{commands:?}"
        );
    }
    let speeds = speeds(&commands[commands.len() - 1..]);
    assert!(speeds[0].abs() < 1e-9, "{commands:?}");
}

#[test]
fn scans_that_stop_are_followed_by_zero_and_not_by_a_ramp() {
    let idle_exit = Some(Duration::from_millis(600));
    let (end, commands) = driven(DrivePlan { exit_with_peer: false, idle_exit, ..plan(Pace::Scan) }, 20);
    assert!(matches!(end, Err(DriveError::ScansStopped { .. })), "{end:?}");
    let speeds = speeds(&commands);
    assert!(speeds.iter().all(|speed| *speed > 0.7 || speed.abs() < 1e-9), "{speeds:?}");
    assert!(speeds[speeds.len() - 1].abs() < 1e-9, "{speeds:?}");
}

#[test]
fn an_idle_limit_below_the_period_does_not_end_a_run_with_scans() {
    // Fifty scans come in each period.
    let (idle_exit, duration) = (Some(Duration::from_millis(450)), Some(Duration::from_secs(2)));
    let period_ns = Some(500_000_000);
    let (end, _) = driven(DrivePlan { idle_exit, duration, period_ns, ..plan(Pace::Clock) }, 300);
    assert!(matches!(end, Ok(End::Duration)), "{end:?}");
}
