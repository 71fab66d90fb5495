//! A folder of world files, in the order in which a person counts.

use super::{WorldFileError, load};
use crate::world::World;
use nav_core::footprint::Footprint;
use std::cmp::Ordering;
use std::path::{Path, PathBuf};

/// Reads every `*.toml` of a folder (not of folders in it) and checks it for a robot of a radius (m). The worlds
/// come in natural order of their file names: `world_2` before `world_10`.
///
/// # Errors
/// A folder that cannot be read or holds no world, and the first world that cannot be used: see [`load`].
pub fn read_folder(folder: &Path, footprint: &Footprint) -> Result<Vec<(PathBuf, World)>, WorldFileError> {
    let read = |source| WorldFileError::Read { path: folder.to_owned(), source };
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(read)? {
        let path = entry.map_err(read)?.path();
        if path.extension().is_some_and(|extension| extension == "toml") && path.is_file() {
            files.push(path);
        }
    }
    if files.is_empty() {
        return Err(WorldFileError::Empty { path: folder.to_owned() });
    }
    files.sort_by(|a, b| natural(&a.to_string_lossy(), &b.to_string_lossy()).then_with(|| a.cmp(b)));
    files.into_iter().map(|path| load(&path, footprint).map(|world| (path, world))).collect()
}

/// Compares texts with each run of digits as one number.
fn natural(a: &str, b: &str) -> Ordering {
    let (mut a, mut b) = (a, b);
    loop {
        let (first, second) = (part(&mut a), part(&mut b));
        let order = match (first, second) {
            ("", "") => return Ordering::Equal,
            (x, y) if x.starts_with(is_digit) && y.starts_with(is_digit) => {
                let (x, y) = (x.trim_start_matches('0'), y.trim_start_matches('0'));
                x.len().cmp(&y.len()).then_with(|| x.cmp(y))
            }
            (x, y) => x.cmp(y),
        };
        if order != Ordering::Equal {
            return order;
        }
    }
}

fn is_digit(letter: char) -> bool {
    letter.is_ascii_digit()
}

/// Takes the longest run of digits, or of others, off the front.
fn part<'a>(text: &mut &'a str) -> &'a str {
    let digits = text.starts_with(is_digit);
    let end = text.find(|letter| is_digit(letter) != digits).unwrap_or(text.len());
    let (part, rest) = text.split_at(end);
    *text = rest;
    part
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::families::{Family, Split, generate};
    use crate::world_file::save;

    const ROBOT: Footprint = Footprint::circle(0.2);

    #[test]
    fn worlds_come_in_natural_order_and_nothing_else_is_read() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let world = generate(Family::Boxes, Split::Test, 1);
        for name in ["world_10", "world_9", "World_11", "a", "world_2b", "world_02"] {
            save(&folder.path().join(format!("{name}.toml")), &world).expect("the world can be written");
        }
        std::fs::write(folder.path().join("README.md"), "ten worlds").expect("a file");
        std::fs::create_dir(folder.path().join("old.toml")).expect("a folder");
        let worlds = read_folder(folder.path(), &ROBOT).expect("all are valid");
        let names: Vec<_> = worlds.iter().filter_map(|(path, _)| path.file_stem()?.to_str()).collect();
        assert_eq!(names, ["World_11", "a", "world_02", "world_2b", "world_9", "world_10"]);
        assert!(worlds.iter().all(|(_, read)| *read == world));
    }

    #[test]
    fn an_empty_folder_and_a_broken_world_are_named() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let error = read_folder(folder.path(), &ROBOT).expect_err("nothing is there").to_string();
        assert!(error.contains("no world") && error.contains("*.toml"), "{error}");
        std::fs::write(folder.path().join("broken.toml"), "name = 3").expect("a file");
        let error = read_folder(folder.path(), &ROBOT).expect_err("not a world").to_string();
        assert!(error.contains("broken.toml"), "{error}");
        assert!(matches!(read_folder(&folder.path().join("none"), &ROBOT), Err(WorldFileError::Read { .. })));
    }

    #[test]
    fn runs_of_digits_count_as_numbers() {
        for (less, more) in [
            ("w2", "w10"),
            ("w02", "w3"),
            ("a", "a1"),
            ("a1", "b0"),
            ("1", "a"),
            ("w18446744073709551616", "w99999999999999999999"),
        ] {
            assert_eq!(natural(less, more), Ordering::Less, "{less} {more}");
            assert_eq!(natural(more, less), Ordering::Greater, "{less} {more}");
        }
        assert_eq!(natural("w7", "w007"), Ordering::Equal);
    }
}
