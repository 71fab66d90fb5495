//! Rows survive what ends a program.

use nav_core::metrics::EpisodeEnd;
use nav_core::task::ShieldMode;
use nav_env::rows::{EpisodeRow, RowFile, RowsError, read_rows};
use nav_env::searched::Searched;
use nav_env::summary::summarise;
use nav_sim::disturbance::DisturbanceName;
use nav_sim::families::{Family, Split};
use std::fs;
use std::path::PathBuf;

fn row(world_seed: u64) -> EpisodeRow {
    EpisodeRow {
        policy: "hybrid".into(),
        training_seed: Some(7),
        run: "runs/a, b".into(),
        family: Some(Family::UTrap),
        world_file: None,
        split: Some(Split::Test),
        world_seed,
        disturbance: DisturbanceName::Usual,
        lidar: None,
        shield: Some(ShieldMode::On),
        end: EpisodeEnd::Success,
        hit_while_standing: false,
        steps: 123,
        time_s: 12.3,
        path_m: 8.1,
        geodesic_m: Some(7.9),
        euclidean_m: 6.6,
        spl: Some(0.97),
        path_efficiency: Some(0.97),
        path_efficiency_euclidean: Some(0.81),
        smoothness: 0.99,
        log_jerk: Some(-7.25),
        clearance_min_m: 0.1,
        clearance_mean_m: 0.7,
        time_to_collision_min_s: None,
        stood_at_end_s: 0.1,
        spin: 0.0,
        tick_mean_ns: 40_000,
        tick_max_ns: 90_000,
        distance_left_m: Some(0.28),
        searches: None,
        search_expanded: None,
        search_cells: None,
        search_bytes: None,
    }
}

/// A world from a file, without a known way.
fn read_world(end: EpisodeEnd) -> EpisodeRow {
    EpisodeRow {
        training_seed: None,
        family: None,
        split: None,
        world_file: Some("barn_7.toml".into()),
        geodesic_m: None,
        spl: None,
        path_efficiency: None,
        path_efficiency_euclidean: None,
        end,
        ..row(7)
    }
}

fn table() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("episodes.csv");
    (folder, path)
}

#[test]
fn every_row_is_on_the_disk_as_soon_as_it_is_written_and_read_back_as_it_was() {
    let (_folder, path) = table();
    let mut file = RowFile::create(&path).expect("a new file");
    let rows = [row(0), read_world(EpisodeEnd::BelievedArrived), row(1)];
    for count in 1..=rows.len() {
        file.append(&rows[count - 1]).expect("the disk has room");
        assert_eq!(read_rows(&path).expect("whole rows"), rows[..count]);
    }
    let text = fs::read_to_string(&path).expect("text");
    assert_eq!(text.lines().count(), 4, "one header: {text}");
    assert!(text.contains("\nhybrid,,\"runs/a, b\",,barn_7.toml,,7,usual,,on,believed_arrived,"), "{text}");
}

#[test]
fn a_last_line_that_was_cut_short_is_dropped_and_written_again() {
    let (_folder, path) = table();
    let write = |count: u64| {
        let mut file = RowFile::create(&path).expect("a new file");
        (0..count).for_each(|seed| file.append(&row(seed)).expect("the disk has room"));
        fs::read(&path).expect("what was written")
    };
    let (two, three) = (write(2), write(3));
    // Wherever it was cut: in the header, in a row, before its line break.
    for length in (0..three.len()).filter(|length| length % 7 == 0 || *length > three.len() - 3) {
        fs::write(&path, &three[..length]).expect("the disk has room");
        let (mut file, rows) = RowFile::resume(&path).expect("ours");
        let whole = three[..length].iter().filter(|byte| **byte == b'\n').count().saturating_sub(1);
        assert_eq!(rows.len(), whole, "cut at {length}");
        (rows.len() as u64..3).for_each(|seed| file.append(&row(seed)).expect("the disk has room"));
        assert!(fs::read(&path).expect("what was written") == three, "cut at {length}");
    }
    assert!(three.starts_with(&two));
}

#[test]
fn other_files_and_other_writers_are_refused() {
    let (_folder, path) = table();
    fs::write(&path, "policy,family,seed\nhybrid,maze,1\n").expect("the disk has room");
    let error = RowFile::resume(&path).expect_err("of another version");
    assert!(
        matches!(error, RowsError::Format { .. }) && error.to_string().contains("episodes.csv"),
        "{error}"
    );
    let first = RowFile::create(&path).expect("a new file");
    let error = RowFile::resume(&path).expect_err("somebody writes it");
    assert!(matches!(error, RowsError::Busy { .. }), "{error}");
    drop(first);
    RowFile::resume(&path).expect("nobody writes it any more");
}

/// The columns that rows had before they told what is left and what searches took.
#[test]
fn rows_of_fewer_columns_are_read_and_not_gone_on_with() {
    let (_folder, path) = table();
    let mut file = RowFile::create(&path).expect("a new file");
    file.append(&row(0)).expect("the disk has room");
    drop(file);
    let new = fs::read_to_string(&path).expect("text");
    let old: String = new
        .lines()
        .map(|line| line.rsplitn(6, ',').last().expect("more than five columns").to_owned() + "\n")
        .collect();
    assert!(old.lines().next().is_some_and(|header| header.ends_with(",tick_mean_ns,tick_max_ns")), "{old}");
    fs::write(&path, &old).expect("the disk has room");
    let read = read_rows(&path).expect("older rows");
    assert_eq!(read, [EpisodeRow { distance_left_m: None, ..row(0) }]);
    let error = RowFile::resume(&path).expect_err("its rows are shorter").to_string();
    assert!(error.contains("fewer columns") && error.contains("write elsewhere"), "{error}");
    assert_eq!(fs::read_to_string(&path).expect("text"), old, "nothing is lost");
}

/// What a planner tells is in its rows, and they are read again as they were.
#[test]
fn a_planners_searches_are_kept() {
    let (_folder, path) = table();
    let searched = Searched { searches: 1, expanded: 900, cells: 19_600, bytes: 120_000 };
    let again = Searched { searches: 1, expanded: 100, cells: 19_600, bytes: 90_000 };
    assert_eq!(searched.and(again), Searched { searches: 2, expanded: 1000, ..searched });
    let planned = EpisodeRow {
        searches: Some(searched.searches),
        search_expanded: Some(searched.expanded),
        search_cells: Some(searched.cells),
        search_bytes: Some(searched.bytes),
        ..row(0)
    };
    RowFile::create(&path).expect("a new file").append(&planned).expect("the disk has room");
    assert_eq!(read_rows(&path).expect("whole rows"), [planned]);
}

#[test]
fn figures_are_counted_and_then_divided() {
    let ends = [EpisodeEnd::Success, EpisodeEnd::BelievedArrived, EpisodeEnd::Timeout, EpisodeEnd::Collision];
    let mut rows: Vec<_> = (0..3).map(row).collect();
    rows.extend(ends.map(read_world));
    let summaries = summarise(&rows);
    let [trap, files] = summaries.as_slice() else { panic!("{summaries:?}") };
    assert_eq!((trap.family.as_str(), files.family.as_str()), ("u_trap", "world files"));
    let json = serde_json::to_string(&summaries).expect("plain numbers");
    assert!(!json.contains("-0"), "neither -0 nor a negative share: {json}");
    assert!(json.contains("\"timeout\":0.0,"), "{json}");
    let shares = [files.success, files.believed_arrived, files.timeout, files.collision];
    assert!(shares.iter().all(|share| (share - 0.25).abs() < 1e-9), "{shares:?}");
    assert!(files.spl.is_none() && trap.spl.is_some());
}

/// Shares are counts over the total: none is a hair below zero, nor minus zero.
#[test]
fn shares_are_never_negative() {
    for total in 1..=30_usize {
        for successes in 0..=total {
            let collisions = (total - successes) / 2;
            let end = |index: usize| match index {
                _ if index < successes => EpisodeEnd::Success,
                _ if index < successes + collisions => EpisodeEnd::Collision,
                _ => EpisodeEnd::Timeout,
            };
            let rows: Vec<_> =
                (0..total).map(|index| EpisodeRow { end: end(index), ..row(index as u64) }).collect();
            let summary = &summarise(&rows)[0];
            let expected = (total - successes - collisions) as f64 / total as f64;
            assert_eq!(
                summary.timeout.to_bits(),
                expected.to_bits(),
                "{successes} and {collisions} of {total}"
            );
        }
    }
}

/// Who judges rows reads what is written here.
#[test]
fn a_study_reads_these_rows() {
    let (folder, path) = table();
    let mut file = RowFile::create(&path).expect("a new file");
    for row in [row(0), read_world(EpisodeEnd::BelievedArrived), EpisodeRow { shield: None, ..row(1) }] {
        file.append(&row).expect("the disk has room");
    }
    let tables = study::rows::read(&[folder.path().to_owned()]).expect("tables");
    let [(_, first), (_, second), (_, third)] = &tables.episodes[..] else {
        panic!("three rows: {tables:?}")
    };
    assert_eq!(
        (first.policy.as_str(), first.training_seed, first.family.as_deref()),
        ("hybrid", Some(7), Some("u_trap"))
    );
    assert_eq!((first.split.as_deref(), first.disturbance.as_str()), (Some("test"), "usual"));
    assert_eq!((first.shield, third.shield), (Some(study::rows::Gate::On), None));
    assert_eq!((first.end, second.end), (study::rows::End::Success, study::rows::End::BelievedArrived));
    assert_eq!((first.spl, second.spl, second.family.as_deref()), (Some(0.97), None, None));
}
