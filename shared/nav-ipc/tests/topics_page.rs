//! `docs/topics.md` is all that somebody needs who writes a driver in another language: what it says is what is true.

use nav_core::guard::command_age_limit_ns;
use nav_core::messages::{CmdVel, Goal, LaserScan, MAX_BEAMS, Odometry, RunState, Status, fault};
use nav_core::task::Task;
use nav_ipc::{IpcConfig, Message};
use std::mem::{align_of, offset_of, size_of};
use std::path::Path;

const PAGE: &str = include_str!("../../../docs/topics.md");

/// The rows of the first table after a text, a cell each, without the back quotes.
fn table(after: &str) -> Vec<Vec<String>> {
    let (_, rest) = PAGE.split_once(after).unwrap_or_else(|| panic!("`{after}` is not on the page"));
    let lines =
        rest.lines().skip_while(|line| !line.starts_with('|')).take_while(|line| line.starts_with('|'));
    let cells = |line: &str| {
        let cells = line.trim_matches('|').split('|');
        cells.map(|cell| cell.trim().replace(['`', '*'], "")).collect::<Vec<_>>()
    };
    // Without heading and rule.
    lines.skip(2).map(cells).collect()
}

/// The rows of a message's table: offset, type and field.
fn fields(topic: &str) -> Vec<(usize, String, String)> {
    let row = |row: Vec<String>| (row[0].parse().expect("an offset"), row[1].clone(), row[2].clone());
    table(&format!("\n### `{topic}`")).into_iter().map(row).collect()
}

/// Field by field, with what the type of each says about its size: nothing may be left out, nothing overlaps.
fn assert_layout<T: Message>(expected: &[(&str, &str, usize)]) {
    let found = fields(T::TOPIC.name);
    let expected: Vec<_> = expected
        .iter()
        .map(|(kind, name, offset)| (*offset, (*kind).to_owned(), (*name).to_owned()))
        .collect();
    assert_eq!(found, expected, "{}", T::TOPIC.name);
    let mut end = 0;
    for (offset, kind, name) in found {
        assert_eq!(offset, end, "{name} follows the field before it");
        end += match kind.as_str() {
            "u64" => 8,
            "u32" | "f32" => 4,
            "f32[1440]" => 4 * MAX_BEAMS,
            other => panic!("{other} is no type of this page"),
        };
    }
    assert_eq!(end, size_of::<T>(), "the fields fill the message");
}

/// The type of a field, as the page calls it.
trait Kind {
    const KIND: &'static str;
}
impl Kind for u64 {
    const KIND: &'static str = "u64";
}
impl Kind for u32 {
    const KIND: &'static str = "u32";
}
impl Kind for f32 {
    const KIND: &'static str = "f32";
}
impl Kind for [f32; 1440] {
    const KIND: &'static str = "f32[1440]";
}

fn kind_of<T, F: Kind>(_: fn(&T) -> &F) -> &'static str {
    F::KIND
}

macro_rules! layout {
    ($message:ty: $($($field:ident).+),+) => {
        assert_layout::<$message>(&[
            (kind_of(|m: &$message| &m.header.stamp_ns), "stamp_ns", offset_of!($message, header.stamp_ns)),
            (kind_of(|m: &$message| &m.header.seq), "seq", offset_of!($message, header.seq)),
            $((
                kind_of(|m: &$message| &m.$($field).+),
                stringify!($($field).+),
                offset_of!($message, $($field).+),
            )),+
        ])
    };
}

#[test]
fn every_field_is_where_the_page_says() {
    layout!(LaserScan: angle_min_rad, angle_increment_rad, range_min_m, range_max_m, beam_count, reserved, ranges_m);
    layout!(Odometry: pose.x_m, pose.y_m, pose.yaw_rad, linear_mps, angular_radps, reserved);
    layout!(Goal: x_m, y_m, radius_m, id);
    layout!(CmdVel: linear_mps, angular_radps, scan_seq, faults, state);
    layout!(Status: state, faults, goal_id, subgoal_action, subgoal_x_m, subgoal_y_m, wish_linear_mps,
        wish_angular_radps, scan_age_ns, odom_age_ns, policy_ns, tick_ns, overruns);
}

#[test]
fn topics_have_their_names_types_and_sizes() {
    fn row<T: Message>() -> Vec<String> {
        let topic = T::TOPIC;
        let (size, alignment) = (size_of::<T>().to_string(), align_of::<T>().to_string());
        vec![topic.name.into(), topic.type_name.into(), size, alignment, topic.writer.into()]
    }
    let expected = [row::<LaserScan>(), row::<Odometry>(), row::<Goal>(), row::<CmdVel>(), row::<Status>()];
    assert_eq!(table("## Services"), expected);
}

#[test]
fn settings_are_those_that_we_create_services_with() {
    let folder = tempfile::tempdir().expect("a scratch folder");
    let config = IpcConfig::in_folder(folder.path()).expect("a short path");
    let robot = nav_ipc::RobotName::new("r").expect("a plain name");
    let node = nav_ipc::RobotNode::open(&robot, &config).expect("a node");
    let _goals = node.reader::<Goal>().expect("a reader");
    let services = std::fs::read_dir(folder.path().join("services")).expect("services").flatten();
    let texts: Vec<_> = services.map(|file| std::fs::read(file.path()).expect("readable")).collect();
    let texts: Vec<_> = texts.iter().map(|bytes| String::from_utf8_lossy(bytes).replace('-', "_")).collect();
    let service =
        texts.iter().find(|text| text.contains("max_publishers")).expect("the description of the service");
    for row in table("Settings, to be given") {
        let line = format!("{} = {}", row[0], row[1]);
        assert!(service.contains(&line), "`{line}` is not in {service}");
    }
    drop((_goals, node));
    config.remove_all();
}

#[test]
fn prefixes_follow_from_paths() {
    for row in table("For example:") {
        let config = IpcConfig::in_folder(Path::new(&row[0])).expect("a short path");
        assert_eq!(config.prefix(), row[1], "{}", row[0]);
    }
    let root = IpcConfig::default().root();
    let parts = table("## Where the files are")[0][1].replace("<user id>", "");
    assert!(root.to_string_lossy().starts_with(&parts), "{}", root.display());
}

#[test]
fn states_faults_and_limits_are_the_codes() {
    let states: Vec<_> =
        RunState::ALL.map(|state| vec![(state as u32).to_string(), state.name().to_owned()]).into();
    assert_eq!(table("### States"), states);
    let faults = table("### Faults");
    for (bit, name) in fault::NAMES.iter().enumerate() {
        assert_eq!(faults[bit][0], bit.to_string());
        assert!(faults[bit].iter().any(|cell| cell.contains(name)), "{name} is missing at bit {bit}");
    }
    for row in table("2.5 periods at least:") {
        let [period_ms, limit_ms] = [&row[0], &row[1]].map(|cell| cell.parse::<u64>().expect("milliseconds"));
        assert_eq!(command_age_limit_ns(period_ms * 1_000_000), limit_ms * 1_000_000, "{period_ms} ms");
    }
}

#[test]
fn the_shipped_geometry_is_the_default_one() {
    let lidar = Task::default().lidar;
    let near = |angle_rad: f32, expected: f32| assert!((angle_rad - expected).abs() < 1e-5, "{angle_rad}");
    assert_eq!(lidar.beam_count, 72);
    near(lidar.beam_angle_rad(0), -std::f32::consts::PI);
    near(lidar.beam_angle_rad(1) - lidar.beam_angle_rad(0), 0.087_266_5);
    near(lidar.beam_angle_rad(36), 0.0);
    near(lidar.beam_angle_rad(54), std::f32::consts::FRAC_PI_2);
}
