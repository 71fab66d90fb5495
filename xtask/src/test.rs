//! Everything that must hold before a change is merged, on a machine with nothing but cargo, gcc and
//! python3: set-ups, format, one build, lints, documentation, doc tests, and all tests last.

use anyhow::Result;

use crate::shell::{cargo, have, run_shown, say};
use crate::{browser, libtorch, onnxruntime, python};

/// Runs every check, in the order in which a failure is cheapest to see.
///
/// # Errors
/// The first check that fails.
pub(crate) fn run() -> Result<()> {
    libtorch::set_up(None)?;
    onnxruntime::set_up()?;
    python::set_up()?;
    browser::set_up()?;
    if have("cargo", &["fmt", "--version"]) {
        say("format");
        run_shown(
            cargo().args(["fmt", "--all", "--check"]),
            "the format check (`cargo fmt --all` mends it)",
        )?;
    } else {
        say("format: not checked, rustfmt is not installed");
    }
    say("build of every target");
    run_shown(cargo().args(["build", "--release", "--workspace", "--all-targets"]), "the build")?;
    if have("cargo", &["clippy", "--version"]) {
        say("lints");
        let mut clippy = cargo();
        clippy.args(["clippy", "--release", "--workspace", "--all-targets", "--", "--deny", "warnings"]);
        run_shown(&mut clippy, "clippy")?;
    } else {
        say("lints: not checked, clippy is not installed");
    }
    say("documentation");
    let mut doc = cargo();
    doc.env("RUSTDOCFLAGS", denying_warnings(std::env::var("RUSTDOCFLAGS").ok()));
    doc.args(["doc", "--release", "--workspace", "--no-deps"]);
    run_shown(&mut doc, "the documentation (a warning counts as an error)")?;
    say("doc tests");
    run_shown(cargo().args(["test", "--release", "--workspace", "--doc", "--quiet"]), "the doc tests")?;
    if have("cargo", &["nextest", "--version"]) {
        say("tests (cargo nextest)");
        return run_shown(cargo().args(["nextest", "run", "--release", "--workspace"]), "the tests");
    }
    say("tests (cargo test, one thread: those over shared memory take turns)");
    let mut test = cargo();
    test.args(["test", "--release", "--workspace", "--no-fail-fast", "--lib", "--bins", "--tests"]);
    run_shown(test.args(["--", "--test-threads=1"]), "the tests")
}

/// The flags of rustdoc for pages. What `.cargo/config.toml` has for doc tests does not go with these: a variable wins
/// over it, and pages are not linked.
fn denying_warnings(wanted: Option<String>) -> String {
    [wanted.unwrap_or_default().as_str(), "--deny warnings"].join(" ").trim_start().to_owned()
}
