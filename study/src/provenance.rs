//! What a report, or a run, was made with.

use std::path::Path;
use std::process::Command;

/// What a report, or a run, was made with.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Provenance {
    /// The command.
    pub command: String,
    /// The commit of the checkout; `unknown` where there is none.
    pub commit: String,
    /// The machine that judged; those that trained are in the table of runs.
    pub machine: String,
}

impl Provenance {
    /// Of this process, where it was started.
    pub fn here() -> Self {
        Self::at(Path::new("."))
    }

    /// Of this process, which works on a checkout.
    pub fn at(folder: &Path) -> Self {
        Self { command: command(), commit: commit(folder), machine: machine() }
    }
}

/// The program without its folder, which says nothing elsewhere.
fn command() -> String {
    let mut words: Vec<String> =
        std::env::args_os().map(|word| word.to_string_lossy().into_owned()).collect();
    if let Some(program) = words.first_mut() {
        let name = Path::new(&*program).file_name().map(|name| name.to_string_lossy().into_owned());
        *program = name.unwrap_or_default();
    }
    words.join(" ")
}

fn commit(folder: &Path) -> String {
    let git = |arguments: &[&str]| {
        let output = Command::new("git")
            .arg("-C")
            .arg(folder)
            .arg("--no-optional-locks")
            .args(arguments)
            .output()
            .ok()?;
        output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
    };
    let Some(commit) = git(&["rev-parse", "--short=12", "HEAD"]) else { return "unknown".to_owned() };
    let is_clean =
        git(&["status", "--porcelain", "--untracked-files=no"]).is_some_and(|text| text.is_empty());
    if is_clean { commit } else { format!("{commit}-dirty") }
}

fn machine() -> String {
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = info.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':'));
    let model = model.map_or("a processor without a name", |(_, model)| model.trim());
    let cores = if cores == 1 { "1 core".to_owned() } else { format!("{cores} cores") };
    format!("{model}, {cores}, {} {}", std::env::consts::OS, std::env::consts::ARCH)
}
