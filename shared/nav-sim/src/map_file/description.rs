//! The YAML description of a map: a few flat keys, one a line, as the ROS map saver writes them. Comments,
//! quotes and lists in brackets or as dashes are understood; nested mappings are not.

use super::{Cell, MapError};
use nav_core::geometry::Pose;
use std::path::{Path, PathBuf};

/// The checked description of a map.
pub(super) struct Description {
    pub(super) image: PathBuf,
    pub(super) resolution_m: f32,
    pub(super) origin: Pose,
    is_negated: bool,
    occupied_above: f32,
    free_below: f32,
}

/// A key with its values: one, or those of a list.
struct Entry {
    line: usize,
    key: String,
    values: Vec<String>,
    is_list: bool,
}

impl Description {
    pub(super) fn parse(path: &Path, text: &str) -> Result<Self, MapError> {
        let entries = Entries { path, entries: entries(path, text)? };
        entries.check_keys()?;
        let image = PathBuf::from(&entries.single("image")?.values[0]);
        let resolution_m = entries.number("resolution")?;
        if !(1e-3..=10.0).contains(&resolution_m) {
            return entries.wrong("resolution", "the side of a pixel must lie between 0.001 and 10 m");
        }
        let origin = entries.numbers("origin")?;
        let &[x_m, y_m, yaw_rad] = origin.as_slice() else {
            return entries.wrong("origin", "the origin needs three numbers: [x, y, yaw]");
        };
        let is_negated = match entries.optional_number("negate")?.unwrap_or(0.0) {
            0.0 => false,
            1.0 => true,
            _ => return entries.wrong("negate", "negate must be 0 or 1"),
        };
        let occupied_above = entries.optional_number("occupied_thresh")?.unwrap_or(0.65);
        let free_below = entries.optional_number("free_thresh")?.unwrap_or(0.196);
        if !(0.0..=1.0).contains(&occupied_above) || !(0.0..=1.0).contains(&free_below) {
            return entries.wrong("occupied_thresh", "both thresholds must lie between 0 and 1");
        }
        if free_below > occupied_above {
            return entries.wrong("free_thresh", "free_thresh must not be larger than occupied_thresh");
        }
        if entries.find("mode").is_some() && entries.single("mode")?.values[0] != "trinary" {
            return entries.wrong("mode", "only the mode trinary is understood");
        }
        let origin = Pose::new(x_m, y_m, yaw_rad);
        Ok(Self { image, resolution_m, origin, is_negated, occupied_above, free_below })
    }

    /// What a pixel says about its cell.
    pub(super) fn cell(&self, [red, green, blue]: [u8; 3]) -> Cell {
        let brightness = (f32::from(red) + f32::from(green) + f32::from(blue)) / (3.0 * 255.0);
        let occupancy = if self.is_negated { brightness } else { 1.0 - brightness };
        if occupancy > self.occupied_above {
            Cell::Occupied
        } else if occupancy < self.free_below {
            Cell::Free
        } else {
            Cell::Unknown
        }
    }
}

const KEYS: [&str; 7] = ["image", "resolution", "origin", "negate", "occupied_thresh", "free_thresh", "mode"];

struct Entries<'a> {
    path: &'a Path,
    entries: Vec<Entry>,
}

impl Entries<'_> {
    fn check_keys(&self) -> Result<(), MapError> {
        for (index, entry) in self.entries.iter().enumerate() {
            if !KEYS.contains(&entry.key.as_str()) {
                let known = KEYS.join(", ");
                return Err(
                    self.at(entry, format!("`{}` is not a key of a map; the keys are {known}", entry.key))
                );
            }
            if self.entries[..index].iter().any(|other| other.key == entry.key) {
                return Err(self.at(entry, format!("`{}` stands here a second time", entry.key)));
            }
        }
        Ok(())
    }

    fn find(&self, key: &str) -> Option<&Entry> {
        self.entries.iter().find(|entry| entry.key == key)
    }

    fn at(&self, entry: &Entry, message: String) -> MapError {
        MapError::Syntax { path: self.path.to_owned(), line: entry.line, message }
    }

    fn wrong<T>(&self, key: &'static str, message: &str) -> Result<T, MapError> {
        let line = self.find(key).map_or(1, |entry| entry.line);
        Err(MapError::Syntax { path: self.path.to_owned(), line, message: message.to_owned() })
    }

    /// A key with exactly one value.
    fn single(&self, key: &'static str) -> Result<&Entry, MapError> {
        let entry = self.find(key).ok_or_else(|| MapError::MissingKey { path: self.path.to_owned(), key })?;
        if entry.is_list || entry.values.len() != 1 {
            return Err(self.at(entry, format!("`{key}` needs one value")));
        }
        Ok(entry)
    }

    fn number(&self, key: &'static str) -> Result<f32, MapError> {
        let entry = self.single(key)?;
        self.parsed(entry, &entry.values[0])
    }

    fn optional_number(&self, key: &'static str) -> Result<Option<f32>, MapError> {
        self.find(key).map(|_| self.number(key)).transpose()
    }

    fn numbers(&self, key: &'static str) -> Result<Vec<f32>, MapError> {
        let entry = self.find(key).ok_or_else(|| MapError::MissingKey { path: self.path.to_owned(), key })?;
        entry.values.iter().map(|value| self.parsed(entry, value)).collect()
    }

    fn parsed(&self, entry: &Entry, value: &str) -> Result<f32, MapError> {
        let number = value.parse::<f32>().ok().filter(|number| number.is_finite());
        number.ok_or_else(|| self.at(entry, format!("`{}` needs a number, not {value:?}", entry.key)))
    }
}

fn entries(path: &Path, text: &str) -> Result<Vec<Entry>, MapError> {
    let mut entries: Vec<Entry> = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let syntax = |message: &str| MapError::Syntax {
            path: path.to_owned(),
            line: index + 1,
            message: message.to_owned(),
        };
        let content = without_comment(line).trim_end();
        if content.trim().is_empty() || content == "---" || content == "..." {
            continue;
        }
        if let Some(item) = content.trim_start().strip_prefix("- ") {
            let list = entries.last_mut().filter(|entry| entry.is_list || entry.values.is_empty());
            let list = list.ok_or_else(|| syntax("this list item belongs to no key"))?;
            list.is_list = true;
            list.values.push(unquoted(item).to_owned());
            continue;
        }
        let (key, value) = content
            .split_once(':')
            .filter(|(key, value)| {
                !key.starts_with(char::is_whitespace)
                    && (value.is_empty() || value.starts_with(char::is_whitespace))
            })
            .ok_or_else(|| syntax("expected `key: value`"))?;
        let value = value.trim();
        let list = value.strip_prefix('[');
        let values = match list {
            Some(list) => {
                let list = list.strip_suffix(']').ok_or_else(|| syntax("the list has no closing bracket"))?;
                list.split(',').map(|item| unquoted(item).to_owned()).collect()
            }
            None if value.is_empty() => Vec::new(),
            None => vec![unquoted(value).to_owned()],
        };
        let key = unquoted(key).to_owned();
        entries.push(Entry { line: index + 1, key, values, is_list: list.is_some() });
    }
    Ok(entries)
}

/// Cuts a comment off: a # at the start of a line or after a space, outside quotes.
fn without_comment(line: &str) -> &str {
    let mut quote = None;
    let mut after_space = true;
    for (index, letter) in line.char_indices() {
        match (quote, letter) {
            (None, '#') if after_space => return &line[..index],
            (None, '"' | '\'') => quote = Some(letter),
            (Some(open), close) if open == close => quote = None,
            _ => {}
        }
        after_space = letter.is_whitespace();
    }
    line
}

fn unquoted(value: &str) -> &str {
    let value = value.trim();
    ['"', '\''].into_iter().find_map(|quote| value.strip_prefix(quote)?.strip_suffix(quote)).unwrap_or(value)
}
