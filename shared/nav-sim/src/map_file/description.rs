//! The checked description of a map, and what it makes of a pixel.

use super::keys::Keys;
use super::{Cell, MapError};
use crate::world::COORDINATE_MAX_M;
use nav_core::geometry::Pose;
use std::path::{Path, PathBuf};

const KEYS: [&str; 7] = ["image", "resolution", "origin", "negate", "occupied_thresh", "free_thresh", "mode"];
/// What map savers write where nobody has looked.
const UNKNOWN_GRAY: u8 = 205;

/// How a pixel becomes a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mode {
    Trinary,
    Scale,
    Raw,
}

/// The checked description of a map.
pub(super) struct Description {
    pub(super) image: PathBuf,
    pub(super) resolution_m: f32,
    pub(super) origin: Pose,
    mode: Mode,
    is_negated: bool,
    occupied_above: f32,
    free_below: f32,
    /// Keys that mean nothing, as sentences.
    pub(super) warnings: Vec<String>,
}

impl Description {
    pub(super) fn parse(path: &Path, text: &str) -> Result<Self, MapError> {
        let keys = Keys::read(path, text)?;
        let image = PathBuf::from(keys.text("image")?);
        let resolution_m = keys.number("resolution")?;
        if !(1e-3..=10.0).contains(&resolution_m) {
            return keys.wrong("resolution", "the side of a pixel must lie between 0.001 and 10 m");
        }
        let [x_m, y_m, yaw_rad] = keys.three_numbers("origin")?;
        if x_m.abs().max(y_m.abs()) > COORDINATE_MAX_M {
            return keys.wrong(
                "origin",
                "the origin lies more than 100 km from zero, as UTM coordinates do; there a robot's coordinates are too \
                 coarse. Subtract one offset from the origin, the start and the goal",
            );
        }
        let is_negated = match keys.optional_text("negate")?.unwrap_or("0").to_ascii_lowercase().as_str() {
            "0" | "false" | "no" | "off" => false,
            "1" | "true" | "yes" | "on" => true,
            _ => return keys.wrong("negate", "`negate` must be 0 or 1, false or true"),
        };
        let occupied_above = keys.optional_number("occupied_thresh")?.unwrap_or(0.65);
        let free_below = keys.optional_number("free_thresh")?.unwrap_or(0.196);
        if !(0.0..=1.0).contains(&occupied_above) || !(0.0..=1.0).contains(&free_below) {
            return keys.wrong("occupied_thresh", "both thresholds must lie between 0 and 1");
        }
        if free_below > occupied_above {
            return keys.wrong("free_thresh", "free_thresh must not be larger than occupied_thresh");
        }
        let mode = match keys.optional_text("mode")?.unwrap_or("trinary") {
            "trinary" => Mode::Trinary,
            "scale" => Mode::Scale,
            "raw" => Mode::Raw,
            _ => return keys.wrong("mode", "`mode` must be trinary, scale or raw"),
        };
        let warnings = keys
            .iter()
            .filter(|entry| !KEYS.contains(&entry.key.as_str()))
            .map(|entry| {
                let (path, known) = (path.display(), KEYS.join(", "));
                let (line, key) = (entry.line, &entry.key);
                format!(
                    "{path}, line {line}: `{key}` is not a key of a map and is ignored; the keys are {known}"
                )
            })
            .collect();
        let origin = Pose::new(x_m, y_m, yaw_rad);
        Ok(Self { image, resolution_m, origin, mode, is_negated, occupied_above, free_below, warnings })
    }

    /// What a pixel (red, green, blue, alpha) says about its cell; `has_alpha` whether its image has transparency.
    pub(super) fn cell(&self, pixel: [u8; 4], has_alpha: bool) -> Cell {
        if self.mode == Mode::Scale && pixel[3] != u8::MAX {
            return Cell::Unknown;
        }
        // As the map server has always done: here, transparency is a fourth colour.
        let colours = if has_alpha && self.mode == Mode::Trinary { &pixel[..] } else { &pixel[..3] };
        let sum: u32 = colours.iter().map(|&colour| u32::from(colour)).sum();
        let brightness = sum as f32 / (255 * colours.len()) as f32;
        if self.mode == Mode::Raw {
            // The pixel is the occupancy itself, in percent.
            let percent = (255.0 * brightness).round();
            return if percent > 100.0 { Cell::Unknown } else { self.judged(percent / 100.0) };
        }
        self.judged(if self.is_negated { brightness } else { 1.0 - brightness })
    }

    fn judged(&self, occupancy: f32) -> Cell {
        if occupancy > self.occupied_above {
            Cell::Occupied
        } else if occupancy < self.free_below {
            Cell::Free
        } else {
            Cell::Unknown
        }
    }

    /// Whether a pixel is what map savers write for unknown, and free here.
    pub(super) fn frees_unknown(&self, pixel: [u8; 4], cell: Cell) -> bool {
        pixel[..3] == [UNKNOWN_GRAY; 3] && cell == Cell::Free
    }
}
