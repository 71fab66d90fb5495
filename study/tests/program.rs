//! The program: a report at one go, and errors in one sentence.

mod support;

use assert_cmd::Command;
use support::Stage;

fn study(arguments: &[&str]) -> (Option<i32>, String, String) {
    let output =
        Command::cargo_bin("study").expect("it was built").args(arguments).output().expect("it starts");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code(), text(&output.stdout), text(&output.stderr))
}

#[test]
fn a_report_at_one_go() {
    let stage = Stage::new();
    let path = |name: &str| stage.path(name).display().to_string();
    let (study_file, rows, out) = (path("study.toml"), path("rows"), path("out/deep"));
    let (code, told, warned) = study(&["report", "--study", &study_file, "--rows", &rows, "--out", &out]);
    assert_eq!(code, Some(0), "{warned}");
    assert!(told.contains("out/deep/index.html") && warned.is_empty(), "{told} {warned}");
    let page = std::fs::read_to_string(stage.path("out/deep/index.html")).expect("the page");
    assert!(page.contains("study report --study"), "the command");
    let (code, told, _) = study(&["check", "--study", &study_file]);
    assert_eq!(code, Some(0));
    assert!(
        told.contains("4 methods, 20 training runs of 1000000 steps, 3720 episodes, 2 primary"),
        "{told}"
    );
}

#[test]
fn errors_name_the_flag() {
    let stage = Stage::new();
    let path = |name: &str| stage.path(name).display().to_string();
    let (study_file, rows) = (path("study.toml"), path("rows"));
    let (code, _, error) = study(&["report", "--study", &path("none.toml"), "--rows", &rows]);
    assert!(code == Some(1) && error.contains("--study: cannot read the study"), "{error}");
    assert_eq!(error.trim_end().lines().count(), 1, "{error}");
    let (code, _, error) = study(&["report", "--study", &study_file, "--rows", &path("configs")]);
    assert!(code == Some(1) && error.contains("--rows: there are no evaluation rows"), "{error}");
    let blocked = path("study.toml") + "/out";
    let (code, _, error) = study(&["report", "--study", &study_file, "--rows", &rows, "--out", &blocked]);
    assert!(code == Some(1) && error.contains("cannot write"), "{error}");
    let gallery = ["--gallery", &rows];
    let (code, _, error) =
        study(&[&["report", "--study", &study_file, "--rows", &rows][..], &gallery].concat());
    assert!(code == Some(1) && error.contains("--gallery: there is no *.svg"), "{error}");
    let (code, _, error) = study(&["report"]);
    assert!(code == Some(2) && error.contains("--rows"), "{error}");
}
