//! The sources of a crate, and which words their code uses.

use super::workspace;
use std::fs;
use std::path::PathBuf;

/// Methods of floats whose last bits depend on the C library or the compiler; `libm` has them all. What is exact
/// by IEEE 754 (`sqrt`, `abs`, `floor`, `round`, `mul_add`, ...) is not among them.
const SYSTEM_MATH: [&str; 26] = [
    "sin", "cos", "tan", "sin_cos", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "asinh",
    "acosh", "atanh", "hypot", "cbrt", "exp", "exp2", "exp_m1", "ln", "ln_1p", "log", "log2", "log10",
    "powf", "powi",
];

/// Path and text of every Rust file below a folder of the workspace, test modules' files left out.
pub(crate) fn sources(folder: &str) -> Vec<(PathBuf, String)> {
    let mut folders = vec![workspace().join(folder)];
    let mut found = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).expect("the folder of a crate can be read").flatten() {
            let path = entry.path();
            let stem = path.file_stem().and_then(|stem| stem.to_str()).unwrap_or_default();
            if stem == "tests" || stem.ends_with("_tests") {
                continue;
            }
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                let text = fs::read_to_string(&path).expect("a source is UTF-8");
                found.push((path, text));
            }
        }
    }
    assert!(!found.is_empty(), "{folder} holds no sources");
    found
}

pub(crate) fn assert_absent(sources: &[(PathBuf, String)], words: &[&str]) {
    for (path, text) in sources {
        let code = code_of(text);
        for word in words {
            let line = first_use(&code, word);
            assert_eq!(line, None, "{} names `{word}` in that line", path.display());
        }
    }
}

/// The lines of a source, numbered from 1, without comments and without what `#[cfg(test)]` covers.
pub(crate) fn code_of(text: &str) -> Vec<(usize, &str)> {
    let mut code = Vec::new();
    let mut lines = text.lines().enumerate();
    while let Some((index, line)) = lines.next() {
        if line.trim() == "#[cfg(test)]" {
            let indent = line.len() - line.trim_start().len();
            let opens = lines.next().is_some_and(|(_, item)| item.trim_end().ends_with('{'));
            let closes = |line: &str| line.trim() == "}" && line.len() - line.trim_start().len() == indent;
            while opens && lines.next().is_some_and(|(_, line)| !closes(line)) {}
            continue;
        }
        code.push((index + 1, line.split("//").next().unwrap_or_default()));
    }
    code
}

/// The first line that calls a method of floats that the C library computes, with its name.
pub(crate) fn first_system_math(code: &[(usize, &str)]) -> Option<(usize, &'static str)> {
    code.iter().find_map(|(number, line)| {
        let calls = |name: &str| {
            ["f32", "f64"]
                .into_iter()
                .any(|float| first_use(&[(0, *line)], &format!("{float}::{name}")).is_some())
                || line.contains(&format!(".{name}("))
        };
        SYSTEM_MATH.into_iter().find(|name| calls(name)).map(|name| (*number, name))
    })
}

/// The first line that uses `word` as a whole path or name; `std` and `alloc` count only as a path's root.
fn first_use(code: &[(usize, &str)], word: &str) -> Option<usize> {
    let part_of_name = |character: char| character.is_alphanumeric() || character == '_';
    code.iter().find_map(|(number, line)| {
        line.match_indices(word).find_map(|(at, _)| {
            let (before, after) = (&line[..at], &line[at + word.len()..]);
            let whole = !before.ends_with(part_of_name) && !after.starts_with(part_of_name);
            let root = !matches!(word, "std" | "alloc")
                || after.starts_with("::")
                || before.trim_end().ends_with("extern crate");
            (whole && root).then_some(*number)
        })
    })
}

/// The scanner sees what it must see and leaves out what it must leave out.
#[test]
fn the_source_scan_finds_paths_and_skips_comments_and_tests() {
    let code = code_of(
        "//! std in a comment\nuse core::fmt; // std\n#[cfg(test)]\nextern crate std;\n#[cfg(test)]\nmod tests {\n    \
         use std::vec;\n}\nfn f() { alloc::vec![1]; }\n",
    );
    assert_eq!(first_use(&code, "std"), None);
    assert_eq!(first_use(&code, "alloc"), Some(9));
    assert_eq!(first_use(&code_of("let t = std::time::Instant::now();"), "Instant"), Some(1));
    assert_eq!(first_use(&code_of("let allocation = no_std; // std::time"), "alloc"), None);
}

#[test]
fn the_source_scan_finds_methods_of_floats() {
    for system in ["a.sin()", "(a + b).atan2(c)", "f32::tanh(a)", "map(f64::exp)", "1.0_f32\n    .powf(b)"] {
        assert!(first_system_math(&code_of(system)).is_some(), "{system}");
    }
    for fine in [
        "libm::sinf(a)",
        "let (sin, cos) = c;",
        "a.sqrt()",
        "self.cos.len()",
        "log::info!()",
        "dice.single()",
    ] {
        assert_eq!(first_system_math(&code_of(fine)), None, "{fine}");
    }
}
