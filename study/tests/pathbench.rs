//! PathBench's figures: of rows that have them, and of those that do not.

mod support;

use std::fs;
use study::analysis::pathbench::Figures;
use study::cells::Cells;
use study::plan::Study;
use study::report::{Provenance, write};
use study::rows;
use support::Stage;

/// The table as rows of cells.
fn table(stage: &Stage) -> Vec<Vec<String>> {
    let study = Study::read(&stage.path("study.toml")).expect("a study");
    let tables = rows::read(&[stage.path("rows")]).expect("tables");
    let provenance =
        Provenance { command: "a test".into(), commit: "none".into(), machine: "this one".into() };
    let written = write(&study, &tables, &[], &provenance, &stage.path("out")).expect("a report");
    let page = fs::read_to_string(&written.page).expect("the page");
    assert!(page.contains("<h2 id=\"pathbench\">"), "the table is on the page");
    let mut reader = csv::Reader::from_path(stage.path("out/pathbench.csv")).expect("the table");
    let cells = |record: csv::Result<csv::StringRecord>| {
        record.expect("a row").iter().map(str::to_owned).collect::<Vec<_>>()
    };
    reader.records().map(cells).collect()
}

fn of<'a>(table: &'a [Vec<String>], method: &str, gate: &str) -> &'a [String] {
    table.iter().find(|row| row[0] == method && row[1] == gate).expect("a row")
}

/// Rows as they were before they told of the end and of searches: 9 m driven where 8 m are the shortest way, 100 steps of a
/// smoothness of 0.95.
#[test]
fn older_rows_have_all_but_what_they_do_not_tell() {
    let stage = Stage::new();
    let table = table(&stage);
    assert_eq!(table.len(), 8, "four methods, two gates");
    // 0.05 of 90 degrees in each of 100 steps, over 9 m.
    assert_eq!(of(&table, "Hybrid", "on")[2], "600", "ten seeds, two families, 30 worlds");
    assert_eq!(of(&table, "Hybrid", "on")[4..], ["1.00", "–", "0.80", "0.87", "–", "–"]);
}

#[test]
fn what_rows_tell_of_the_end_and_of_searches_is_averaged() {
    let stage = Stage::new();
    let old = support::rows("reactive", None, "on");
    let mut solved = 0;
    let lines = old.lines().enumerate().map(|(index, line)| match index {
        0 => format!("{line},distance_left_m,searches,search_expanded,search_cells,search_bytes\n"),
        // Every second episode searched four times as often and as much, which is the same share.
        _ => {
            let is_success = line.contains(",success,");
            solved += usize::from(is_success);
            let left = if is_success { "0.3" } else { "4.3" };
            let search = if index % 2 == 0 { "1,2500,10000,51200" } else { "4,10000,10000,153600" };
            format!("{line},{left},{search}\n")
        }
    });
    let new: String = lines.collect();
    stage.write("rows/reactive/on.csv", &new);
    let table = table(&stage);
    let share = solved as f64 / 60.0;
    let left = format!("{:.2}", 0.3 + 4.0 * (1.0 - share));
    let success = format!("{:.1}", 100.0 * share);
    assert!(solved > 10 && solved < 50, "some of both: {solved}");
    let row = of(&table, "Reactive", "on");
    assert_eq!(row[2..], ["60", &success, "1.00", &left, "0.80", "0.87", "25.0", "100"]);
    assert_eq!(of(&table, "Reactive", "off")[5], "–");
}

/// Where it did not arrive, how far it came and how it turned is no figure of its path.
#[test]
fn failures_count_in_the_distance_left_only() {
    let stage = Stage::new();
    let study = Study::read(&stage.path("study.toml")).expect("a study");
    let tables = rows::read(&[stage.path("rows")]).expect("tables");
    assert!(Cells::sort(&study, &tables.episodes, &tables.files).is_ok());
    for (_, row) in &tables.episodes {
        let figures = Figures::of(&rows::EpisodeRow { distance_left_m: Some(2.0), ..row.clone() });
        let is_success = row.end == rows::End::Success;
        assert_eq!(figures.left_m, Some(2.0));
        let of_the_path = [figures.deviation_m, figures.clearance_m, figures.turned_radpm];
        assert!(of_the_path.iter().all(|figure| figure.is_some() == is_success), "{figures:?}");
        let stood = rows::EpisodeRow { path_m: Some(0.0), searches: Some(0), ..row.clone() };
        let stood = rows::EpisodeRow { search_expanded: Some(0.0), search_cells: Some(9.0), ..stood };
        let figures = Figures::of(&stood);
        assert_eq!(
            (figures.turned_radpm, figures.search_share),
            (None, None),
            "nothing is divided by nothing"
        );
    }
}

/// Rows of a real evaluation, as they were and as results keep them.
#[test]
fn what_results_keep_has_the_same_figures() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let [whole, kept] = ["whole", "kept"].map(|name| folder.path().join(name));
    for folder in [&whole, &kept] {
        fs::create_dir(folder).expect("made");
    }
    fs::write(whole.join("episodes.csv"), include_str!("data/episodes.csv")).expect("written");
    rows::keep::episodes(&whole.join("episodes.csv"), &kept.join("on.csv.gz")).expect("kept");
    let read = |folder| rows::read(&[folder]).expect("tables").episodes;
    let (whole, kept) = (read(whole), read(kept));
    assert_eq!((whole.len(), kept.len()), (24, 24));
    let is_near = |a: Option<f64>, b: Option<f64>, within: f64| match (a, b) {
        (Some(a), Some(b)) => (a - b).abs() < within,
        (a, b) => a.is_none() && b.is_none(),
    };
    for ((_, whole), (_, kept)) in whole.iter().zip(&kept) {
        let (whole, kept) = (Figures::of(whole), Figures::of(kept));
        // Four figures of a smoothness near 1 are a few thousandths of a radian a metre.
        assert!(is_near(whole.deviation_m, kept.deviation_m, 0.02), "{whole:?}, {kept:?}");
        assert!(is_near(whole.turned_radpm, kept.turned_radpm, 0.005), "{whole:?}, {kept:?}");
        assert!(is_near(whole.clearance_m, kept.clearance_m, 0.001), "{whole:?}, {kept:?}");
    }
    assert!(kept.iter().any(|(_, row)| Figures::of(row).turned_radpm.is_some()), "there are successes");
}
