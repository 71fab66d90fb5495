//! Manual pages and shell completions, as the programs themselves print them.

use std::fs;
use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result};

use crate::programs;
use crate::shell::{run_quiet, say};

/// What each program prints, and where it goes: a folder, and what stands before and after the program's name.
const PARTS: [(&str, &str, &str, &str); 4] = [
    ("man", "man1", "", ".1"),
    ("bash", "bash", "", ""),
    ("zsh", "zsh", "_", ""),
    ("fish", "fish", "", ".fish"),
];

/// Builds the programs and writes all of it into a folder.
///
/// # Errors
/// When the build fails, or a file cannot be written.
pub(crate) fn write(out: &Path) -> Result<()> {
    let names = ["trainer", "runtime", "simulator", "study"];
    let folder = programs::build(&names)?;
    for (what, place, before, after) in PARTS {
        let place = out.join(place);
        fs::create_dir_all(&place).with_context(|| format!("could not create {}", place.display()))?;
        for name in names {
            let mut program = Command::new(folder.join(name));
            program.args(["--print-manual", what]);
            let text = run_quiet(&mut program, &format!("{name} --print-manual {what}"), |_| {})?;
            let path = place.join(format!("{before}{name}{after}"));
            fs::write(&path, text).with_context(|| format!("could not write {}", path.display()))?;
        }
    }
    say(&format!("man pages and completions are in {}; `man -l FILE` shows a page", out.display()));
    Ok(())
}
