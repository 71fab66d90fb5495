//! The latency bench runs to its end and its file says what was measured. No figure is judged here.

mod support;

use support::programs::{Running, run, wait_until};
use support::{Stage, read_json};

#[test]
fn it_measures_four_phases() {
    let stage = Stage::new();
    let out = stage.path("loop.json");
    let path = out.to_str().expect("a plain path");
    let ended =
        run("runtime", &stage, &["bench", "--loop", "--seconds", "0.7", "--rate", "50", "--out", path])
            .succeeded();
    assert!(ended.stdout.contains("limit: "), "{}", ended.stdout);
    let bench = read_json(&out);
    assert!(bench["limit"].as_str().is_some_and(|words| words.contains("cores")), "{bench}");
    let phases = bench["phases"].as_array().expect("phases");
    let kinds: Vec<_> =
        phases.iter().map(|phase| (phase["loaded"].as_bool(), phase["realtime"].as_bool())).collect();
    let both = |loaded, realtime| (Some(loaded), Some(realtime));
    assert_eq!(kinds, [both(false, false), both(true, false), both(false, true), both(true, true)]);
    for phase in phases {
        assert!(phase["ticks"].as_u64() > Some(0), "{phase}");
        assert!(phase["round_trip"]["count"].as_u64() > Some(0), "{phase}");
        assert_eq!(phase["allocations"], 0, "{phase}");
        assert!(phase["scans_replaced"].is_u64() && phase["round_trips_missing"].is_u64(), "{phase}");
        assert_eq!(phase["hogs"].as_u64() > Some(0), phase["loaded"] == true, "{phase}");
        assert!(phase["realtime"] == true || phase["realtime_granted"] == false, "{phase}");
        let median = |name: &str| phase[name]["p50_ns"].as_u64().expect("a median");
        assert!(median("controller") <= median("tick"), "a part is not longer than the whole: {phase}");
    }
}

#[test]
fn an_interrupted_one_leaves_nothing_behind() {
    let stage = Stage::new();
    let mut bench = Running::start("runtime", &stage, &["bench", "--loop", "--seconds", "30"]);
    let scratch = std::path::PathBuf::from(format!("/tmp/nav-loop-{}", bench.id()));
    wait_until("it has begun", || scratch.exists());
    std::thread::sleep(std::time::Duration::from_millis(300));
    let children = || children_of(bench.id());
    wait_until("the peer runs", || !children().is_empty());
    let children = children();
    bench.signal(libc::SIGINT);
    wait_until("it ends", || !bench.is_running());
    assert!(!scratch.exists(), "{}", scratch.display());
    bench.end().stopped_by(libc::SIGINT);
    assert!(children.iter().all(|child| !std::path::Path::new(&format!("/proc/{child}")).exists()));
}

#[test]
fn a_killed_one_takes_its_peer_along() {
    let stage = Stage::new();
    let bench = Running::start("runtime", &stage, &["bench", "--loop", "--seconds", "30"]);
    let id = bench.id();
    wait_until("the peer runs", || !children_of(id).is_empty());
    let children = children_of(id);
    bench.signal(libc::SIGKILL);
    drop(bench);
    wait_until("the peer is gone", || children.iter().all(|child| has_ended(*child)));
    let scratch = std::path::PathBuf::from(format!("/tmp/nav-loop-{id}"));
    nav_ipc::IpcConfig::in_folder(&scratch).expect("a short path").remove_all();
}

/// Processes that a process started.
fn children_of(parent: u32) -> Vec<u32> {
    let text = std::fs::read_dir(format!("/proc/{parent}/task"))
        .into_iter()
        .flatten()
        .flatten()
        .filter_map(|thread| std::fs::read_to_string(thread.path().join("children")).ok())
        .collect::<String>();
    text.split_whitespace().filter_map(|id| id.parse().ok()).collect()
}

/// Gone, or waiting for somebody to take its status.
fn has_ended(process: u32) -> bool {
    let stat = std::fs::read_to_string(format!("/proc/{process}/stat")).unwrap_or_default();
    stat.is_empty() || stat.contains(") Z ")
}
