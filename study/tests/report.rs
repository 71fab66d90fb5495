//! The whole way from rows to the page, on rows that are made up.

mod support;

use std::fs;
use study::analysis::Analysis;
use study::cells::Cells;
use study::plan::Study;
use study::report::{Provenance, ReportError, Written, write};
use study::rows::{self, Gate};
use support::{STUDY, Stage};

const FIGURES: [&str; 8] = [
    "primary-differences",
    "success-by-family",
    "collision-by-family",
    "non-inferiority-differences",
    "performance-profiles",
    "learning-success",
    "learning-collision",
    "return-against-success",
];

fn provenance() -> Provenance {
    Provenance { command: "a test".into(), commit: "none".into(), machine: "this one".into() }
}

fn judge(stage: &Stage) -> Result<Written, ReportError> {
    let study = Study::read(&stage.path("study.toml")).expect("a study");
    let tables = rows::read(&[stage.path("rows")]).expect("tables");
    write(&study, &tables, &[], &provenance(), &stage.path("out"))
}

fn analysis(stage: &Stage) -> Analysis {
    let study = Study::read(&stage.path("study.toml")).expect("a study");
    let tables = rows::read(&[stage.path("rows")]).expect("tables");
    let cells = Cells::sort(&study, &tables.episodes, &tables.files).expect("no row twice");
    Analysis::of(&study, &cells, &tables)
}

#[test]
fn the_page_is_well_formed_whole_and_needs_nothing_else() {
    let stage = Stage::new();
    let written = judge(&stage).expect("a report");
    assert_eq!(written.gaps, 0);
    let page = fs::read_to_string(&written.page).expect("the page");
    let options = roxmltree::ParsingOptions { allow_dtd: true, ..Default::default() };
    let document = roxmltree::Document::parse_with_options(&page, options).expect("well-formed");
    let figures: Vec<&str> = document
        .descendants()
        .filter(|node| node.has_tag_name(("http://www.w3.org/1999/xhtml", "figure")))
        .map(|node| {
            let svg = node.children().find(|child| child.tag_name().name() == "svg").expect("a drawing");
            assert!(svg.descendants().count() > 20, "it has something in it");
            node.attribute("id").expect("a name")
        })
        .collect();
    let mut expected = FIGURES.to_vec();
    let mut found = figures.clone();
    expected.sort_unstable();
    found.sort_unstable();
    assert_eq!(found, expected);
    for never in ["<script", "href=\"http", "src=", "url("] {
        assert!(!page.contains(never), "{never}");
    }
    assert!(page.contains("Made up &lt;for a test&gt; &amp; nothing else"));
    for told in [
        "Hybrid against Flat TD3, success, gate on: better (corrected p below 0.01) on maze.",
        "missed its gate",
        "abc123",
        "two cores",
    ] {
        assert!(page.contains(told), "{told}");
    }
    let ids: Vec<&str> = document.descendants().filter_map(|node| node.attribute("id")).collect();
    for id in &ids {
        assert_eq!(ids.iter().filter(|other| *other == id).count(), 1, "{id} is there once");
    }
}

#[test]
fn figures_and_tables_are_files_too() {
    let stage = Stage::new();
    let written = judge(&stage).expect("a report");
    for figure in FIGURES {
        let svg = fs::read_to_string(stage.path(&format!("out/figures/{figure}.svg"))).expect("an SVG");
        let document = roxmltree::Document::parse(&svg).expect("well-formed");
        let texts = document.descendants().filter(|node| node.tag_name().name() == "text").count();
        assert!(texts > 4, "{figure} is labelled");
        let png = fs::read(stage.path(&format!("out/figures/{figure}.png"))).expect("a PNG");
        assert!(png.starts_with(b"\x89PNG") && png.len() > 4_000, "{figure}: {} bytes", png.len());
    }
    let tables = [
        "headline",
        "methods",
        "non-inferiority",
        "ladder",
        "ablation",
        "paired",
        "pathbench",
        "runs",
        "scores",
    ];
    for table in tables {
        let mut reader = csv::Reader::from_path(stage.path(&format!("out/{table}.csv"))).expect(table);
        assert!(reader.records().all(|record| record.is_ok()), "{table}");
    }
    let scores = fs::read_to_string(stage.path("out/scores.csv")).expect("scores");
    // Three learned methods of ten seeds and a classical one, two families, two gates.
    assert_eq!(scores.lines().count(), 1 + (3 * 10 + 1) * 4);
    assert_eq!(written.files.len(), 2 * FIGURES.len() + tables.len() + 1);
}

#[test]
fn the_numbers_are_those_of_the_rows() {
    let stage = Stage::new();
    let analysis = analysis(&stage);
    let maze = |text: &str| {
        text.lines().filter(|line| line.contains(",maze,") && line.contains(",success,")).count() as f64
            / 30.0
    };
    let cell = analysis
        .success
        .iter()
        .find(|cell| (cell.method, cell.gate, cell.family.as_str()) == (0, Gate::On, "maze"))
        .expect("the hybrid in mazes");
    for (score, seed) in cell.scores.iter().zip(1..) {
        assert!((score - maze(&support::rows("hybrid", Some(seed), "on"))).abs() < 1e-12, "seed {seed}");
    }
    let answer = &analysis.primaries[1];
    let found = answer.found.as_ref().expect("rows");
    assert!(answer.is_whole);
    assert_eq!((found.seeds, found.worlds), ([10, 10], 30));
    let p = found.p.expect("ten seeds");
    // Every seed of the one above every seed of the other; two primaries.
    assert!((p - 2.0 / 184_756.0).abs() < 1e-12, "{p}");
    assert!((answer.holm.expect("tested") - 2.0 * p).abs() < 1e-12);
    assert!((found.a12.expect("seeds").value - 1.0).abs() < 1e-12);
    let interval = found.difference.interval;
    assert!(
        interval.low > 0.3 && interval.low < found.difference.value && found.difference.value < interval.high
    );
    // One classical policy: no test over seeds, but one over worlds.
    let pair = analysis.paired.iter().find(|pair| pair.contrast.family == "maze").expect("a pair");
    assert!(pair.success_p < 1e-3 && pair.wins[0] > 20);
    // Times are of worlds that both solved, and some seed of the hybrid solved each.
    let time = pair.quantities.iter().find(|quantity| quantity.name.starts_with("time")).expect("times");
    let solved = maze(&support::rows("reactive", None, "on")) * 30.0;
    assert_eq!(time.worlds, solved.round() as usize);
    assert!(time.worlds > 0 && time.worlds < 15, "{}", time.worlds);
    let [hybrid, td3] = &analysis.curves[..] else { panic!("two methods have curves") };
    assert!(hybrid.return_follows_success > Some(0.9) && td3.return_follows_success < Some(-0.9));
    let is_at =
        |value: Option<f64>, expected: f64| value.is_some_and(|value| (value - expected).abs() < 1e-9);
    assert!(is_at(hybrid.spin, 0.02) && is_at(td3.spin, 0.4), "means over families");
    let first = &hybrid.seeds[0].points[0];
    assert!(first.episode_return.is_none(), "the low level's return is not the hybrid's");
    assert!((first.success - 0.09).abs() < 0.051 && is_at(Some(first.collision), 0.05), "{first:?}");
    assert_eq!(hybrid.iqm.len(), 10, "a look counts though the seeds' steps differ");
    assert_eq!(hybrid.iqm[9].env_steps, 1_000_055, "the median");
    assert!(analysis.budget[1].complaints[0].contains("took 500000 environment steps"));
    assert!(analysis.budget[1].complaints[0].contains("made 80000 updates"));
}

#[test]
fn the_same_rows_give_the_same_page() {
    let stage = Stage::new();
    let page = |written: Written| fs::read(written.page).expect("the page");
    let first = page(judge(&stage).expect("a report"));
    assert!(first == page(judge(&stage).expect("a report")));
}

#[test]
fn what_is_missing_is_told_and_makes_no_result() {
    let stage = Stage::new();
    fs::remove_file(stage.path("rows/td3/seed-4/on.csv.gz")).expect("removed");
    let short: String =
        support::rows("hybrid", Some(2), "on").lines().take(20).map(|line| format!("{line}\n")).collect();
    stage.compressed("rows/hybrid/seed-2/on.csv.gz", &short);
    let written = judge(&stage).expect("a report");
    assert_eq!(written.gaps, 4);
    let page = fs::read_to_string(&written.page).expect("the page");
    for told in [
        "These rows are not all that the study names",
        "no seed 4",
        "seed 2 has 19 of 30 worlds",
        "incomplete",
        "gate on: rows are incomplete, which is no result, on maze",
        "gate off: better (corrected p below 0.01) on maze",
    ] {
        assert!(page.contains(told), "{told}");
    }
}

#[test]
fn rows_of_something_else_are_left_out_and_told() {
    let stage = Stage::new();
    let other = support::rows("hybrid", Some(1), "on").replace(",test,", ",validation,");
    stage.write("rows/other.csv", &other);
    stage.write("rows/notes.csv", "a,b\n1,2\n");
    let page = fs::read_to_string(judge(&stage).expect("a report").page).expect("the page");
    assert!(page.contains("60 of split validation, not test"));
    assert!(page.contains("notes.csv"));
}

#[test]
fn an_episode_that_is_there_twice_is_refused() {
    let stage = Stage::new();
    stage.write("rows/again.csv", &support::rows("reactive", None, "on"));
    let error = judge(&stage).expect_err("twice").to_string();
    for part in ["reactive drove world 0 of clutter twice", "again.csv", "on.csv", "keep one"] {
        assert!(error.contains(part), "{error}");
    }
}

#[test]
fn rows_of_another_study_are_no_report() {
    let stage = Stage::new();
    stage.write("study.toml", &STUDY.replace("split = \"test\"", "split = \"validation\""));
    let error = judge(&stage).expect_err("nothing to judge").to_string();
    assert!(error.contains("split test, not validation"), "{error}");
    assert!(!stage.path("out/index.html").exists());
}

#[test]
fn figures_of_all_methods_leave_ablations_to_their_table() {
    let stage = Stage::new();
    judge(&stage).expect("a report");
    let figure = fs::read_to_string(stage.path("out/figures/success-by-family.svg")).expect("an SVG");
    assert!(figure.contains("Flat TD3") && figure.contains("Reactive"));
    assert!(!figure.contains("The hybrid&apos;s TD3") && !figure.contains("The hybrid's TD3"));
    let table = fs::read_to_string(stage.path("out/ablation.csv")).expect("a table");
    assert!(table.contains("The hybrid's TD3"), "{table}");
}

/// What was not driven makes no other result stronger.
#[test]
fn a_primary_without_rows_counts_in_the_correction() {
    let stage = Stage::new();
    for seed in 1..=support::SEEDS {
        fs::remove_file(stage.path(&format!("rows/td3/seed-{seed}/on.csv.gz"))).expect("removed");
    }
    let analysis = analysis(&stage);
    let [off, on] = &analysis.primaries[..] else { panic!("two primaries") };
    assert!(on.found.is_none() && on.holm.is_none());
    let p = off.found.as_ref().and_then(|found| found.p).expect("tested");
    assert!((off.holm.expect("corrected") - 2.0 * p).abs() < 1e-15);
}
