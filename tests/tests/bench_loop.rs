//! The latency bench runs to its end and its file says what was measured. No figure is judged here.

mod support;

use support::programs::run;
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
        let median = |name: &str| phase[name]["p50_ns"].as_u64().expect("a median");
        assert!(median("controller") <= median("tick"), "a part is not longer than the whole: {phase}");
    }
}
