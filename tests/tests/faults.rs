//! Programs that die, stop or are asked to end: the robot comes to rest from whichever side still lives.

mod support;

use nav_core::messages::{CmdVel, Goal, Header, LaserScan, Odometry, RunState, Status, fault};
use nav_ipc::Reader;
use nav_ipc::clock::monotonic_ns;
use support::programs::{Running, run, wait_until};
use support::{Stage, read_json};

const REALTIME: [&str; 6] = ["--family", "clutter", "--seed", "3", "--episodes", "50"];

fn simulator(stage: &Stage, more: &[&str]) -> Running {
    let mut arguments = REALTIME.to_vec();
    arguments.extend(more);
    Running::start("simulator", stage, &arguments)
}

fn runtime(stage: &Stage, more: &[&str]) -> Running {
    let mut arguments = vec!["run", "--quiet"];
    arguments.extend(more);
    Running::start("runtime", stage, &arguments)
}

fn newest<T: nav_ipc::Message>(reader: &Reader<T>) -> T {
    let mut message = T::default();
    wait_until("a message", || reader.read_latest(&mut message).expect("received"));
    message
}

/// Waits until the robot drives.
fn wait_until_driving(odom: &Reader<Odometry>) {
    wait_until("the robot drives", || newest(odom).linear_mps > 0.3);
}

/// The robot stops by its driver's guard: within the age at which a command is stale (0.25 s), a period, the ramp
/// (0.25 m) and some slack for a busy machine; not because its episode ended.
fn assert_comes_to_rest_and_stays(odom: &Reader<Odometry>, goal: &Reader<Goal>) {
    let (before, goal_id) = (newest(odom).pose, newest(goal).id);
    wait_until("the robot stands", || newest(odom).linear_mps == 0.0);
    let way_m = (newest(odom).pose.position() - before.position()).norm();
    assert!(way_m < 1.2, "it drove {way_m} m without commands");
    assert_eq!(newest(goal).id, goal_id, "the same episode");
    let (first, goal_seq) = (newest(odom), newest(odom).header.seq + 10);
    wait_until("a second later", || newest(odom).header.seq >= goal_seq);
    let last = newest(odom);
    assert_eq!((first.pose, last.linear_mps), (last.pose, 0.0), "it stands still");
}

#[test]
fn a_killed_runtime_leaves_a_robot_that_stops_and_a_new_one_drives_on() {
    let stage = Stage::new();
    let node = stage.node();
    let odom = node.reader::<Odometry>().expect("an odometry reader");
    let goal = node.reader::<Goal>().expect("a goal reader");
    let simulator = simulator(&stage, &["--silence", "60"]);
    let first = runtime(&stage, &[]);
    wait_until_driving(&odom);
    first.signal(libc::SIGKILL);
    drop(first);
    assert_comes_to_rest_and_stays(&odom, &goal);
    let second = runtime(&stage, &[]);
    wait_until_driving(&odom);
    second.signal(libc::SIGTERM);
    second.end().stopped_by(libc::SIGTERM);
    simulator.signal(libc::SIGINT);
    simulator.end().stopped_by(libc::SIGINT);
}

#[test]
fn a_frozen_runtime_leaves_a_robot_that_stops_until_it_wakes() {
    let stage = Stage::new();
    let node = stage.node();
    let odom = node.reader::<Odometry>().expect("an odometry reader");
    let goal = node.reader::<Goal>().expect("a goal reader");
    let _simulator = simulator(&stage, &["--silence", "60"]);
    let runtime = runtime(&stage, &[]);
    wait_until_driving(&odom);
    runtime.signal(libc::SIGSTOP);
    assert_comes_to_rest_and_stays(&odom, &goal);
    runtime.signal(libc::SIGCONT);
    wait_until_driving(&odom);
}

#[test]
fn a_killed_simulator_makes_the_runtime_stop_and_say_stale() {
    let stage = Stage::new();
    let node = stage.node();
    let command = node.reader::<CmdVel>().expect("a command reader");
    let status = node.reader::<Status>().expect("a status reader");
    let simulator = simulator(&stage, &[]);
    let report = stage.path("runtime.json");
    let runtime = runtime(&stage, &["--idle-exit", "3", "--report", report.to_str().expect("a plain path")]);
    wait_until("the runtime drives", || newest(&command).linear_mps > 0.3);
    simulator.signal(libc::SIGKILL);
    drop(simulator);
    wait_until("stale scans are reported", || newest(&status).faults & fault::STALE_SCAN != 0);
    wait_until("the command is zero", || {
        let command = newest(&command);
        command.linear_mps == 0.0 && command.angular_radps == 0.0
    });
    assert_ne!(newest(&status).state, RunState::Driving as u32);
    runtime.end().refused(&["no scan for", "commanded to a stop"]);
    let report = read_json(&report);
    let faults = report["faults"].as_array().expect("faults");
    assert!(faults.iter().any(|fault| fault["fault"] == "stale scan"), "{faults:?}");
    assert_eq!(report["allocations"], 0, "not even when the peer is gone");
}

#[test]
fn a_runtime_survives_a_simulator_that_comes_back() {
    let stage = Stage::new();
    let node = stage.node();
    let command = node.reader::<CmdVel>().expect("a command reader");
    let first = simulator(&stage, &[]);
    let runtime = runtime(&stage, &[]);
    wait_until("the runtime drives", || newest(&command).linear_mps > 0.3);
    first.signal(libc::SIGKILL);
    drop(first);
    wait_until("the runtime stops", || newest(&command).linear_mps == 0.0);
    let _second = simulator(&stage, &[]);
    wait_until("the runtime drives again", || newest(&command).linear_mps > 0.3);
    runtime.signal(libc::SIGTERM);
    let ended = runtime.end().stopped_by(libc::SIGTERM);
    assert!(ended.stdout.contains("\n0 allocations in the loop;"), "{}", ended.stdout);
}

#[test]
fn a_lock_step_simulator_that_loses_its_runtime_says_so() {
    let stage = Stage::new();
    let node = stage.node();
    let command = node.reader::<CmdVel>().expect("a command reader");
    let report = stage.path("simulator.json");
    let arguments = ["--pace", "lockstep", "--report", report.to_str().expect("a plain path")];
    let simulator = simulator(&stage, &arguments);
    let runtime = runtime(&stage, &["--pace", "scan"]);
    wait_until("it drives", || newest(&command).linear_mps > 0.3);
    runtime.signal(libc::SIGKILL);
    drop(runtime);
    simulator.end().refused(&["silent for 2.0 s", "was stopped"]);
    assert!(read_json(&report)["ended"].as_str().is_some_and(|ended| ended.contains("silent")));
}

#[test]
fn a_terminated_runtime_ramps_down_and_exits_well() {
    for signal in [libc::SIGTERM, libc::SIGINT, libc::SIGHUP] {
        let stage = Stage::new();
        let node = stage.node();
        let command = node.reader::<CmdVel>().expect("a command reader");
        let odom = node.reader::<Odometry>().expect("an odometry reader");
        let _simulator = simulator(&stage, &["--silence", "60"]);
        let mut runtime = runtime(&stage, &[]);
        wait_until("it drives fast", || newest(&odom).linear_mps > 0.6);
        runtime.signal(signal);
        let mut speeds = Vec::new();
        let mut last = CmdVel::default();
        wait_until("it ends", || {
            if command.read_latest(&mut last).expect("received") {
                speeds.push(last.linear_mps);
            }
            !runtime.is_running()
        });
        let ended = runtime.end().stopped_by(signal);
        assert_eq!((last.linear_mps, last.angular_radps), (0.0, 0.0), "the last command is zero");
        // 2 m/s² at 10 Hz: never more than 0.2 m/s at once, so that the way down has several commands.
        let steepest = speeds.windows(2).map(|pair| pair[0] - pair[1]).fold(0.0, f32::max);
        assert!(steepest < 0.41, "a ramp, not a jump: {speeds:?}");
        assert!(ended.stdout.contains("commanded to a stop"), "{}", ended.stdout);
    }
}

#[test]
fn an_interrupted_simulator_reports_what_was_driven() {
    let stage = Stage::new();
    let report = stage.path("simulator.json");
    let path = report.to_str().expect("a plain path");
    let simulator = Running::start(
        "simulator",
        &stage,
        &["--family", "clutter", "--episodes", "1000", "--pace", "lockstep", "--report", path],
    );
    let runtime = runtime(&stage, &["--pace", "scan"]);
    let node = stage.node();
    let goal = node.reader::<nav_core::messages::Goal>().expect("a goal reader");
    wait_until("the third episode", || newest(&goal).id >= 3);
    simulator.signal(libc::SIGINT);
    simulator.end().stopped_by(libc::SIGINT);
    let report = read_json(&report);
    assert_eq!(report["ended"], "interrupted");
    assert!(report["summary"]["episodes"].as_u64() >= Some(2), "{report}");
    // The simulator said goodbye, so that the runtime ends too.
    runtime.end().succeeded();
}

#[test]
fn a_timed_run_ends_by_itself() {
    let stage = Stage::new();
    let _simulator = simulator(&stage, &["--silence", "60"]);
    let report = stage.path("runtime.json");
    let arguments =
        ["run", "--duration", "2", "--assert-no-alloc", "--report", report.to_str().expect("plain")];
    let ended = run("runtime", &stage, &arguments).succeeded();
    assert!(ended.stdout.contains(" Hz  "), "a live line: {}", ended.stdout);
    let report = read_json(&report);
    let ticks =
        report["ticks"].as_u64().expect("ticks") + report["skipped_periods"].as_u64().expect("skipped");
    assert!((15..=25).contains(&ticks), "{ticks} periods of 0.1 s in 2 s");
    assert_eq!(
        (report["allocations"].as_u64(), report["allocations_counted"].as_bool()),
        (Some(0), Some(true))
    );
}

#[test]
fn a_terminated_runtime_does_not_set_a_robot_in_motion_that_its_driver_has_stopped() {
    let stage = Stage::new();
    let node = stage.node();
    let command = node.reader::<CmdVel>().expect("a command reader");
    let simulator = Running::start(
        "simulator",
        &stage,
        &["--family", "clutter", "--seed", "3", "--episodes", "500", "--pace", "lockstep"],
    );
    let runtime = runtime(&stage, &["--pace", "scan"]);
    wait_until("the runtime drives", || newest(&command).linear_mps > 0.3);
    simulator.signal(libc::SIGSTOP);
    // Far longer than a command counts.
    std::thread::sleep(std::time::Duration::from_secs(1));
    let mut last = CmdVel::default();
    while command.read_latest(&mut last).expect("received") {}
    runtime.signal(libc::SIGTERM);
    let end = newest(&command);
    assert_eq!(
        (end.linear_mps, end.angular_radps),
        (0.0, 0.0),
        "at once, not by a ramp from {}",
        last.linear_mps
    );
    runtime.end().stopped_by(libc::SIGTERM);
}

#[test]
fn commands_from_the_future_are_not_obeyed_and_do_not_shut_out_honest_ones() {
    let stage = Stage::new();
    let node = stage.node();
    let odom = node.reader::<Odometry>().expect("an odometry reader");
    let command = node.writer::<CmdVel>().expect("the command writer");
    // The simulator waits for a runtime, which listens to these too.
    let _scan = node.reader::<LaserScan>().expect("a scan reader");
    let _goal = node.reader::<Goal>().expect("a goal reader");
    let _simulator = simulator(&stage, &["--silence", "60"]);
    let mut seq = 0;
    let mut send = |ahead_ns: u64| {
        let scan_seq = newest(&odom).header.seq;
        seq += 1;
        let header = Header { stamp_ns: monotonic_ns() + ahead_ns, seq };
        let sent = CmdVel { header, scan_seq, linear_mps: 0.5, ..CmdVel::default() };
        command.write(&sent).expect("sent");
    };
    for _ in 0..10 {
        send(3_600_000_000_000);
        assert!(newest(&odom).linear_mps.abs() < 1e-9, "an hour ahead");
    }
    wait_until("it drives by honest commands", || {
        send(0);
        newest(&odom).linear_mps > 0.1
    });
}
