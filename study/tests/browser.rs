//! The page in a real browser, headless: nothing on its console, every figure with a size, something drawn in it.
//!
//! Where no Chromium is installed, the page is not looked at, and that is said; `cargo xtask test` installs it as root on Debian.

mod support;

use std::fs;
use std::path::Path;
use std::process::Command;
use study::plan::Study;
use study::report::gallery::Picture;
use study::report::{Provenance, write};
use study::rows;
use support::Stage;

const BROWSERS: [&str; 4] = ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable"];

/// Run in a copy of the page: what the browser laid out is written where it can be read.
const PROBE: &str = r#"<script>
addEventListener("load", () => {
  const boxes = [...document.querySelectorAll("figure svg")].map(svg => {
    const box = svg.getBoundingClientRect();
    const outside = [...svg.querySelectorAll("text")].filter(text => {
      const own = text.getBoundingClientRect();
      return own.left < box.left - 1 || own.right > box.right + 1 || own.bottom > box.bottom + 1;
    });
    const texts = [...svg.querySelectorAll("text")].map(text => text.getBoundingClientRect());
    const meet = (a, b) => Math.min(a.right, b.right) - Math.max(a.left, b.left) > 2
      && Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top) > 4;
    const overlaps = texts.flatMap((a, index) => texts.slice(index + 1).filter(b => meet(a, b)));
    return [svg.parentElement.id, Math.round(box.width), Math.round(box.height), outside.length, overlaps.length].join(":");
  });
  document.body.setAttribute("data-figures", boxes.join(" "));
  const image = document.querySelector(".gallery img");
  document.body.setAttribute("data-image", image.naturalWidth + "x" + image.naturalHeight);
  document.body.setAttribute("data-fits", document.documentElement.scrollWidth <= innerWidth);
});
</script>"#;

fn browser() -> Option<&'static str> {
    BROWSERS
        .into_iter()
        .find(|name| Command::new(name).arg("--version").output().is_ok_and(|output| output.status.success()))
}

/// The page as the browser has it after loading, and what it said on its console.
fn loaded(browser: &str, page: &Path, profile: &Path) -> (String, Vec<String>) {
    let output = Command::new(browser)
        .args([
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--disable-dev-shm-usage",
            "--enable-logging=stderr",
        ])
        .args(["--window-size=1300,900", "--dump-dom"])
        .arg(format!("--user-data-dir={}", profile.display()))
        .arg(format!("file://{}", page.display()))
        .output()
        .expect("it starts");
    let said = String::from_utf8_lossy(&output.stderr);
    let console = said.lines().filter(|line| line.contains("CONSOLE")).map(str::to_owned).collect();
    (String::from_utf8_lossy(&output.stdout).into_owned(), console)
}

fn attribute<'a>(page: &'a str, name: &str) -> &'a str {
    let (_, rest) = page.split_once(&format!("{name}=\"")).unwrap_or_else(|| panic!("{name} in {page}"));
    rest.split('"').next().expect("a value")
}

#[test]
fn a_browser_shows_every_figure_and_has_nothing_to_say() {
    let Some(browser) = browser() else {
        eprintln!("no Chromium is installed (apt-get install chromium): the page was not looked at");
        return;
    };
    let stage = Stage::new();
    let study = Study::read(&stage.path("study.toml")).expect("a study");
    let tables = rows::read(&[stage.path("rows")]).expect("tables");
    let provenance =
        Provenance { command: "a test".into(), commit: "none".into(), machine: "this one".into() };
    let circle = r##"<svg xmlns="http://www.w3.org/2000/svg" width="90" height="40"><circle r="9" fill="#d55e00"/></svg>"##;
    let pictures = [Picture { caption: "a win & a loss".into(), svg: circle.into() }];
    let written = write(&study, &tables, &pictures, &provenance, &stage.path("out")).expect("a report");
    let page = fs::read_to_string(&written.page).expect("the page");
    let copy = stage.path("out/probed.html");
    fs::write(&copy, page.replace("</body>", &format!("{PROBE}</body>"))).expect("written");
    let (shown, console) = loaded(browser, &copy, &stage.path("profile"));
    assert!(console.is_empty(), "{console:?}");
    assert_eq!(attribute(&shown, "data-fits"), "true", "the page is wider than the window");
    assert_eq!(attribute(&shown, "data-image"), "90x40", "a picture of the gallery");
    let figures: Vec<&str> = attribute(&shown, "data-figures").split(' ').collect();
    assert_eq!(figures.len(), 8, "{figures:?}");
    for figure in figures {
        let numbers: Vec<u32> =
            figure.split(':').skip(1).map(|number| number.parse().expect("a number")).collect();
        let [width, height, outside, overlaps] = numbers[..] else { panic!("{figure}") };
        assert!(width > 300 && height > 120, "{figure} is too small to be seen");
        assert_eq!(outside, 0, "{figure}: labels reach out of it");
        assert_eq!(overlaps, 0, "{figure}: labels lie on each other");
    }
    // What the test would see of a page with a fault.
    fs::write(&copy, page.replace("</body>", "<script>no_such_name()</script></body>")).expect("written");
    let (_, console) = loaded(browser, &copy, &stage.path("profile"));
    assert!(console.iter().any(|line| line.contains("no_such_name")), "{console:?}");
}
