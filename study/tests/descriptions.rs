//! A study that contradicts itself is refused with a sentence that says what to do.

mod support;

use study::plan::Study;
use support::{STUDY, Stage};

fn refused(from: &str, to: &str) -> String {
    let stage = Stage::new();
    assert!(STUDY.contains(from), "{from}");
    let path = stage.path("study.toml");
    Study::parse(&path, STUDY.replacen(from, to, 1)).expect_err("it is refused").to_string()
}

#[test]
fn the_committed_study_makes_sense() {
    let study = Study::read(concat!(env!("CARGO_MANIFEST_DIR"), "/paper.toml").as_ref()).expect("paper.toml");
    assert_eq!(study.methods[study.subject()].name, "hybrid");
    assert!(study.methods.iter().filter(|method| method.is_learned()).count() > 3);
    let in_primaries: std::collections::BTreeSet<&str> =
        study.primaries.iter().map(|contrast| contrast.family.as_str()).collect();
    assert_eq!(in_primaries.into_iter().collect::<Vec<_>>(), ["deep_u", "maze", "rooms", "stream"]);
}

#[test]
fn the_quick_study_is_a_small_one_of_the_same() {
    let read = |name: &str| {
        Study::read(&std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join(name)).expect("a study")
    };
    let (quick, paper) = (read("quick.toml"), read("paper.toml"));
    let names: Vec<&str> = quick.methods.iter().map(|method| method.name.as_str()).collect();
    assert_eq!((names, quick.families.len(), quick.training_runs().len()), (vec!["hybrid", "td3"], 2, 6));
    for contrast in &quick.primaries {
        let is_asked = paper.primaries.iter().any(|asked| {
            (asked.metric, &asked.family, asked.gate) == (contrast.metric, &contrast.family, contrast.gate)
        });
        assert!(is_asked, "{contrast:?}");
    }
}

#[test]
fn unknown_fields_are_errors() {
    for (from, to) in [
        ("[training]", "[training]\nseed = 1"),
        ("margin = 0.02", "margin = 0.02\nmargins = 1"),
        ("title =", "titel = \"x\"\ntitle ="),
        ("metric = \"success\"", "metric = \"speed\""),
        ("gates = [\"off\", \"on\"]", "gates = [\"off\", \"half\"]"),
    ] {
        let error = refused(from, to);
        assert!(error.contains("study.toml is no study") && error.contains("line"), "{error}");
    }
}

#[test]
fn contradictions_are_told() {
    for (from, to, told) in [
        ("name = \"td3\"", "name = \"hybrid\"", "two methods are named hybrid"),
        ("name = \"td3\"", "name = \"a/b\"", "a name has 1 to 40 letters"),
        ("configs/td3.toml", "configs/none.toml", "there is no configuration"),
        ("rival = \"reactive\"", "rival = \"reactive\"\nlow_level_of = \"td3\"", "exactly one of"),
        ("rival = \"reactive\"", "rival = \"reactive\"\nseeds = [1]", "learns nothing"),
        ("low_level_of = \"hybrid\"", "low_level_of = \"reactive\"", "no method with `train`"),
        ("low_level_of = \"hybrid\"", "low_level_of = \"hybrid\"\nseeds = [11]", "not trained with seed 11"),
        ("[\"--profile\", \"quick\"]", "[\"--seed=3\"]", "for the study to say"),
        ("seeds = [1, 2,", "seeds = [1, 1,", "seed 1 is named twice"),
        ("seeds = [1, 2, 3, 4, 5, 6, 7, 8, 9, 10]", "seeds = []", "has no seed"),
        ("families = [\"clutter\", \"maze\"]", "families = [\"maze\"]", "add it to evaluation.families"),
        ("families = [\"clutter\", \"maze\"]", "families = [\"maze\", \"maze\"]", "names maze twice"),
        ("worlds = 30", "worlds = 0", "evaluation.worlds is 0"),
        ("resamples = 200", "resamples = 5", "interval.resamples is 5"),
        ("resamples = 200", "coverage = 1.0", "interval.coverage is 1"),
        ("margin = 0.02", "margin = 2.0", "two points of a hundred"),
        ("margin = 0.02\n", "", "needs a margin"),
        ("[[primary]]", "[[primary]]\nmargin = 0.02", "ask for it under [[non_inferiority]]"),
        ("against = [\"td3\"]", "against = [\"td4\"]", "no method of this study: there are hybrid, td3"),
        ("against = [\"td3\"]", "against = [\"hybrid\"]", "with itself"),
        ("against = [\"td3\"]", "against = [\"td3\", \"td3\"]", "is asked twice"),
        ("against = [\"td3\"]", "against = []", "compares nothing"),
        ("families = [\"maze\"]", "families = [\"maze\"]\ngates = []", "compares nothing"),
        ("base = \"hybrid\"", "base = \"none\"", "ablation names none"),
        ("{ method = \"td3\"", "{ method = \"none\"", "ladder names none"),
    ] {
        let error = refused(from, to);
        assert!(error.contains(told), "{to}: {error}");
    }
}

#[test]
fn a_gate_that_nobody_drives_with_is_told() {
    let stage = Stage::new();
    let text = STUDY.replacen("gates = [\"off\", \"on\"]", "gates = [\"on\"]", 1).replacen(
        "families = [\"maze\"]",
        "families = [\"maze\"]\ngates = [\"off\"]",
        1,
    );
    let error = Study::parse(&stage.path("study.toml"), text).expect_err("it is refused").to_string();
    assert!(error.contains("nobody drives with the gate off"), "{error}");
}
