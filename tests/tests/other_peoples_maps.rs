//! Maps and worlds as other people's tools write them, under `tests/cases/`, through the simulator itself. Each once stopped it, or
//! was read as something else than `map_server` reads.

mod support;

use support::Stage;
use support::programs::{Ended, run};

/// What the simulator says of a case; it gives up at once where a runtime would have to come.
fn simulate(case: &str, start: &str, goal: &str) -> Ended {
    let map = format!("{}/cases/{case}/map.yaml", env!("CARGO_MANIFEST_DIR"));
    run("simulator", &Stage::new(), &["--map", &map, "--start", start, "--goal", goal, "--wait", "0.2"])
}

/// The map was read and can be driven on, and no word was said about it.
fn accepted(ended: &Ended) {
    ended.refused(&["no runtime answered"]);
}

/// The map was read and can be driven on, with one warning that contains these parts.
fn warned(ended: &Ended, parts: &[&str]) {
    assert_eq!(ended.status.code(), Some(1), "{}", ended.stderr);
    let mut lines = ended.stderr.lines();
    let warning = lines.next().unwrap_or_default();
    assert!(warning.starts_with("simulator: warning: "), "{}", ended.stderr);
    for part in parts {
        assert!(warning.contains(part), "`{part}` is missing in: {warning}");
    }
    assert!(lines.next().is_some_and(|line| line.contains("no runtime answered")), "{}", ended.stderr);
    assert_eq!(lines.next(), None);
}

#[test]
fn negate_may_be_a_bool() {
    accepted(&simulate("map-01-negate-bool", "0,0,0", "1.5,0.5"));
}

#[test]
fn a_scaled_map_is_read() {
    accepted(&simulate("map-02-mode-scale", "0,0,0", "1.5,0.5"));
    simulate("map-02-mode-scale", "2.7,0,0", "1.5,0.5").refused(&["the map knows nothing"]);
}

#[test]
fn unknown_that_a_threshold_frees_is_warned_about() {
    let ended = simulate("map-04-free-thresh-0.25", "2.7,0,0", "0.5,0.5");
    warned(&ended, &["pixels of value 205", "free_thresh of 0.196"]);
}

#[test]
fn transparent_pixels_are_unknown() {
    simulate("map-06-alpha", "2.7,0,0", "0.5,0.5")
        .refused(&["the start at (2.70, 0.00)", "the map knows nothing"]);
    accepted(&simulate("map-06-alpha", "0,0,0", "0.5,0.5"));
}

#[test]
fn keys_of_other_tools_are_passed_over() {
    let ended = simulate("map-09-extra", "0,0,0", "1.5,0.5");
    let lines: Vec<_> = ended.stderr.lines().collect();
    assert_eq!(lines.len(), 3, "{}", ended.stderr);
    assert!(lines[0].contains("`strata_image_bytes`") && lines[0].contains("ignored"), "{}", lines[0]);
    assert!(lines[1].contains("`strata_image_sha256`"), "{}", lines[1]);
    assert!(lines[2].contains("no runtime answered"), "{}", lines[2]);
}

#[test]
fn a_list_may_go_over_lines() {
    accepted(&simulate("map-09-list", "0,0,0", "1.5,0.5"));
}

#[test]
fn coordinates_of_a_survey_are_refused_before_driving() {
    let ended = simulate("map-11-utm", "388096,3948995,0", "388096.5,3948996.5");
    ended.refused(&["map-11-utm/map.yaml, line 3", "100 km", "UTM"]);
    assert_eq!(ended.stdout, "", "nothing was begun");
}

#[test]
fn a_way_that_is_closed_is_told_once() {
    let ended = simulate("map-13-double-message", "1,1,0", "3,1");
    ended.refused(&["no path for a robot 0.4 m wide"]);
    assert_eq!(ended.stderr.matches("no path").count(), 1, "{}", ended.stderr);
}

#[test]
fn a_door_in_a_large_world_is_wide_enough() {
    let world = concat!(env!("CARGO_MANIFEST_DIR"), "/cases/world-large-door/world.toml");
    let ended = run("simulator", &Stage::new(), &["--world-file", world, "--wait", "0.2"]);
    accepted(&ended);
}

#[test]
fn a_map_of_a_survey_can_be_shifted_to_where_robots_drive() {
    let stage = Stage::new();
    let case = concat!(env!("CARGO_MANIFEST_DIR"), "/cases/map-11-utm");
    let yaml = std::fs::read_to_string(format!("{case}/map.yaml")).expect("the case");
    std::fs::copy(format!("{case}/map.pgm"), stage.path("map.pgm")).expect("copied");
    let map = stage.path("map.yaml");
    // What the refusal says to do: one offset off origin, start and goal.
    std::fs::write(&map, yaml.replace("388095.0, 3948994.0", "-1.0, -2.0")).expect("written");
    let map = map.to_str().expect("a plain path");
    accepted(&run(
        "simulator",
        &stage,
        &["--map", map, "--start", "0,-1,0", "--goal", "0.5,0.5", "--wait", "0.2"],
    ));
}
