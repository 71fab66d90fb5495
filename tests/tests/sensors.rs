//! What drivers really say: other lidars, things too near, clocks and counters that are wrong. The runtime drives, or stands
//! and says why with the value that was expected and the one that came.

mod support;

use iceoryx2::prelude::{NodeBuilder, ServiceName, ZeroCopySend, ipc};
use nav_core::geometry::{Pose, wrap_angle};
use nav_core::messages::{CmdVel, Goal, Header, LaserScan, MAX_BEAMS, Odometry, RunState, Status, fault};
use nav_core::task::Task;
use nav_ipc::IpcConfig;
use nav_ipc::clock::monotonic_ns;
use std::f32::consts::{PI, TAU};
use std::time::Duration;
use support::programs::{Running, wait_until};
use support::soak::{count, setting};
use support::{Stage, read_json};

const PERIOD_NS: u64 = 100_000_000;

/// What came of a drive.
struct Drive {
    fastest_mps: f32,
    faults: u32,
    causes: Vec<String>,
}

/// Answers in lock-step: a base that obeys at once, before a wall 4 m ahead of where it started, as `scan` shows it; `retouch`
/// changes the headers of a step.
fn drive(
    steps: u64,
    scan: &dyn Fn(&LaserScan) -> LaserScan,
    retouch: &dyn Fn(&mut Header),
    more: &[&str],
) -> Drive {
    let stage = Stage::with_shipped_model();
    let node = stage.node();
    let command_in = node.reader::<CmdVel>().expect("a reader");
    let wakeup = node.wakeup::<CmdVel>().expect("a wakeup");
    let (scan_out, odom_out, goal_out) = (
        node.writer::<LaserScan>().expect("a writer"),
        node.writer::<Odometry>().expect("a writer"),
        node.writer::<Goal>().expect("a writer"),
    );
    let report = stage.path("runtime.json");
    let mut arguments =
        vec!["run", "--quiet", "--pace", "scan", "--report", report.to_str().expect("a plain path")];
    arguments.extend(more);
    let runtime = Running::start("runtime", &stage, &arguments);
    wait_until("the runtime listens", || scan_out.reader_count() > 0 && goal_out.reader_count() > 0);
    let task = Task::default();
    let (mut pose, mut command) = (Pose::default(), CmdVel::default());
    let (mut fastest_mps, mut faults) = (0.0_f32, 0);
    for seq in 1..=steps {
        let mut header = Header { stamp_ns: seq * PERIOD_NS, seq };
        retouch(&mut header);
        let odom = Odometry {
            header,
            pose,
            linear_mps: command.linear_mps,
            angular_radps: command.angular_radps,
            ..Odometry::default()
        };
        let wall = LaserScan::of(&task.lidar, |angle| {
            let ahead = (angle + pose.yaw_rad).cos();
            let range_m = (4.0 - pose.x_m) / ahead;
            if ahead > 0.05 && range_m < task.lidar.range_max_m { range_m } else { f32::INFINITY }
        });
        odom_out.write(&odom).expect("sent");
        goal_out.write(&Goal { header, x_m: 3.0, radius_m: 0.3, id: 1, ..Goal::default() }).expect("sent");
        scan_out.write(&LaserScan { header, ..scan(&wall) }).expect("sent");
        let last = command.header.seq;
        wait_until("an answer", || {
            let _ = wakeup.wait(Duration::from_millis(20));
            command_in.read_latest(&mut command).expect("received");
            command.header.seq > last
        });
        let period_s = task.control_period_s;
        let yaw_rad = wrap_angle(pose.yaw_rad + command.angular_radps * period_s);
        let way_m = command.linear_mps * period_s;
        pose = Pose::new(pose.x_m + way_m * yaw_rad.cos(), pose.y_m + way_m * yaw_rad.sin(), yaw_rad);
        fastest_mps = fastest_mps.max(command.linear_mps);
        faults |= command.faults;
    }
    drop((scan_out, odom_out, goal_out));
    runtime.end().succeeded();
    let causes = read_json(&report)["causes"].as_array().expect("causes").clone();
    let causes = causes.iter().map(|cause| cause.as_str().expect("words").to_owned()).collect();
    Drive { fastest_mps, faults, causes }
}

fn unchanged(_: &mut Header) {}

/// The trained scan as another lidar would have seen it: the nearest trained beam in each direction.
fn as_seen_by(beams: u32, angle_min_rad: f32, increment_rad: f32, trained: &LaserScan) -> LaserScan {
    let mut scan = LaserScan {
        angle_min_rad,
        angle_increment_rad: increment_rad,
        beam_count: beams,
        range_max_m: 12.0,
        ..*trained
    };
    for beam in 0..beams as usize {
        let angle = wrap_angle(angle_min_rad + beam as f32 * increment_rad);
        let nearest = ((angle - trained.angle_min_rad) / trained.angle_increment_rad).round() as usize % 72;
        scan.ranges_m[beam] = trained.ranges_m[nearest];
    }
    scan
}

#[test]
fn scans_of_real_drivers_drive() {
    let layouts = [
        ("LDS-01", 360, 0.0, TAU / 360.0),
        ("rplidar_ros", 360, -PI, TAU / 359.0),
        ("upside down", 72, PI, -TAU / 72.0),
        ("720 beams", 720, -PI, TAU / 720.0),
        ("36 beams", 36, -PI, TAU / 36.0),
    ];
    for (name, beams, angle_min_rad, increment_rad) in layouts {
        let drive = drive(25, &|wall| as_seen_by(beams, angle_min_rad, increment_rad, wall), &unchanged, &[]);
        assert!(drive.fastest_mps > 0.5, "{name}: {}", drive.fastest_mps);
        assert_eq!(drive.faults & fault::STOPPING, 0, "{name}: {:?}", drive.causes);
    }
}

/// A pillar 20 degrees wide dead ahead in every scan, however a driver says that it is too near. Of a wedge of NaN a robot that
/// turns has just seen the rim; of 60 degrees never the middle.
#[test]
fn what_is_too_near_is_not_driven_at() {
    let cases = [
        (f32::NEG_INFINITY, 34..=38, 0.0),
        (0.0, 34..=38, 0.0),
        (f32::NAN, 30..=42, 0.0),
        (0.3, 34..=38, 0.4),
    ];
    for (value, beams, most_mps) in cases {
        let pillar = |wall: &LaserScan| {
            let mut scan = LaserScan { range_min_m: 0.45, ..*wall };
            scan.ranges_m[beams.clone()].fill(value);
            scan
        };
        let drive = drive(25, &pillar, &unchanged, &[]);
        assert!(drive.fastest_mps <= most_mps, "{value}: {} m/s, {:?}", drive.fastest_mps, drive.causes);
    }
}

#[test]
fn what_cannot_be_driven_on_stands_and_is_named_once() {
    type Case<'a> = (&'a dyn Fn(&LaserScan) -> LaserScan, &'a dyn Fn(&mut Header), [&'a str; 2]);
    let fine = |wall: &LaserScan| *wall;
    let cases: [Case<'_>; 6] = [
        (&|wall| as_seen_by(30, -PI, TAU / 30.0, wall), &unchanged, ["36 beams needed", "30 came"]),
        (&|wall| LaserScan { range_max_m: 2.0, ..*wall }, &unchanged, ["2.5 m needed", "2.0 m"]),
        (&|wall| LaserScan { beam_count: 36, ..*wall }, &unchanged, ["360 degrees needed", "into 180"]),
        (
            &|wall| {
                let mut scan = *wall;
                scan.ranges_m[..40].fill(65.533);
                scan
            },
            &unchanged,
            ["32 of 72 beams", "+inf"],
        ),
        (&fine, &|header| header.seq = 1, ["seq went from 1 to 1", "must grow"]),
        (&fine, &|header| header.stamp_ns = 7, ["the scan's seq", "must grow"]),
    ];
    for (scan, retouch, parts) in cases {
        let drive = drive(12, scan, retouch, &[]);
        assert!(drive.fastest_mps <= 0.2, "{parts:?}: {}", drive.fastest_mps);
        let said: Vec<_> =
            drive.causes.iter().filter(|cause| parts.iter().all(|part| cause.contains(part))).collect();
        assert_eq!(said.len(), 1, "{parts:?} in {:?}", drive.causes);
    }
    // The driver's own code for nothing.
    let hall = |wall: &LaserScan| {
        let mut scan = *wall;
        scan.ranges_m[..20].fill(65.533);
        scan.ranges_m[52..72].fill(65.533);
        scan
    };
    assert!(drive(25, &hall, &unchanged, &["--no-return", "65"]).fastest_mps > 0.5);
}

/// A scan as a stock program publishes it, without notifying anybody.
#[derive(Clone, Copy, Debug, ZeroCopySend)]
#[type_name("hybridnav/LaserScan/v1")]
#[repr(C)]
struct MuteScan {
    stamp_ns: u64,
    seq: u64,
    geometry: [f32; 4],
    beam_count: u32,
    reserved: u32,
    ranges_m: [f32; MAX_BEAMS],
}

#[test]
fn a_driver_that_never_notifies_is_heard() {
    let stage = Stage::with_shipped_model();
    let node = stage.node();
    let status_in = node.reader::<Status>().expect("a reader");
    let (odom_out, goal_out) =
        (node.writer::<Odometry>().expect("a writer"), node.writer::<Goal>().expect("a writer"));
    let config = IpcConfig::in_folder(&stage.ipc_root()).expect("a short path").iceoryx2().expect("fine");
    let their_node = NodeBuilder::new().config(&config).create::<ipc::Service>().expect("a node");
    let service = their_node
        .service_builder(&ServiceName::new("hybridnav/robot/scan").expect("a name"))
        .publish_subscribe::<MuteScan>()
        .max_publishers(1)
        .open_or_create()
        .expect("their service");
    let publisher = service.publisher_builder().create().expect("their writer");
    let _runtime = Running::start("runtime", &stage, &["run", "--quiet"]);
    let lidar = Task::default().lidar;
    let mut status = Status::default();
    let mut seq = 0;
    wait_until("the runtime drives", || {
        seq += 1;
        let header = Header { stamp_ns: monotonic_ns(), seq };
        odom_out.write(&Odometry { header, ..Odometry::default() }).expect("sent");
        goal_out.write(&Goal { header, x_m: 3.0, radius_m: 0.3, id: 1, ..Goal::default() }).expect("sent");
        publisher
            .send_copy(MuteScan {
                stamp_ns: monotonic_ns(),
                seq,
                geometry: [-PI, lidar.angle_increment_rad(), lidar.range_min_m, lidar.range_max_m],
                beam_count: lidar.beam_count,
                reserved: 0,
                ranges_m: [4.0; MAX_BEAMS],
            })
            .expect("sent");
        std::thread::sleep(Duration::from_millis(100));
        status_in.read_latest(&mut status).expect("received");
        status.state == RunState::Driving as u32
    });
}

/// Scans as fast as they can be sent, for `NAV_SOAK_SECONDS` (two usually): the loop keeps its rate and does not allocate.
#[test]
fn a_flood_of_scans_does_not_hold_the_loop() {
    let seconds = setting("NAV_SOAK_SECONDS", 2);
    let stage = Stage::with_shipped_model();
    let node = stage.node();
    let (scan_out, odom_out, goal_out) = (
        node.writer::<LaserScan>().expect("a writer"),
        node.writer::<Odometry>().expect("a writer"),
        node.writer::<Goal>().expect("a writer"),
    );
    let report = stage.path("runtime.json");
    let runtime = Running::start(
        "runtime",
        &stage,
        &["run", "--quiet", "--report", report.to_str().expect("a plain path")],
    );
    wait_until("the runtime listens", || scan_out.reader_count() > 0);
    let lidar = Task::default().lidar;
    let scan = LaserScan::of(&lidar, |_| 4.0);
    let ends_ns = monotonic_ns() + seconds * 1_000_000_000;
    let mut seq = 0_u64;
    while monotonic_ns() < ends_ns {
        seq += 1;
        let header = Header { stamp_ns: monotonic_ns(), seq };
        odom_out.write(&Odometry { header, ..Odometry::default() }).expect("sent");
        goal_out.write(&Goal { header, x_m: 3.0, radius_m: 0.3, id: 1, ..Goal::default() }).expect("sent");
        scan_out.write(&LaserScan { header, ..scan }).expect("sent");
    }
    runtime.signal(libc::SIGTERM);
    runtime.end().stopped_by(libc::SIGTERM);
    let report = read_json(&report);
    let (ticks, wanted) = (report["ticks"].as_u64().expect("ticks"), seconds * 10);
    count(&[("seconds of a flood", seconds), ("scans in it", seq), ("ticks in it", ticks)]);
    assert!(seq > 200 * seconds, "no flood: {seq}");
    assert!(ticks * 2 > wanted && ticks < 2 * wanted + 5, "{ticks} ticks in {seconds} s");
    assert_eq!(report["allocations"], 0);
}
