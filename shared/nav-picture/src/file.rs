//! Pictures on disk.

use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::{Options, Tree};
use std::path::{Path, PathBuf};

/// Pixels of a PNG for each pixel of its SVG.
const PNG_SCALE: f32 = 2.0;
/// Largest side of a PNG, px.
const PNG_SIDE_MAX: f32 = 16_384.0;

/// Why a picture was not written.
#[derive(Debug, thiserror::Error)]
pub enum DrawError {
    /// The name ends neither in .svg nor in .png.
    #[error("cannot tell the format of {}: name a file that ends in .svg or .png", .0.display())]
    UnknownFormat(PathBuf),
    /// The text is not SVG.
    #[error("the picture is not valid SVG: {0}")]
    InvalidSvg(#[from] resvg::usvg::Error),
    /// The picture has no pixels or too many.
    #[error("a PNG of {width} x {height} px cannot be made; write an .svg or draw fewer episodes")]
    Size {
        /// Width, px.
        width: u32,
        /// Height, px.
        height: u32,
    },
    /// PNG encoding failed.
    #[error("the PNG could not be encoded: {0}")]
    Encode(String),
    /// The file could not be written.
    #[error("cannot write {}", .path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
}

/// Writes an SVG document as it is (`.svg`) or drawn at twice its size (`.png`).
///
/// # Errors
/// Another extension, text that is not SVG, a picture too large for a PNG, a file that cannot be written.
pub fn write_picture(path: &Path, svg: &str) -> Result<(), DrawError> {
    let extension = path.extension().and_then(|extension| extension.to_str()).map(str::to_ascii_lowercase);
    let bytes = match extension.as_deref() {
        Some("svg") => svg.as_bytes().to_vec(),
        Some("png") => png(svg)?,
        _ => return Err(DrawError::UnknownFormat(path.to_owned())),
    };
    std::fs::write(path, bytes).map_err(|source| DrawError::Write { path: path.to_owned(), source })
}

fn png(svg: &str) -> Result<Vec<u8>, DrawError> {
    let tree = Tree::from_str(svg, &Options::default())?;
    let size = tree.size();
    let longest = size.width().max(size.height());
    let scale = PNG_SCALE.min(PNG_SIDE_MAX / longest);
    let (width, height) = ((size.width() * scale).ceil() as u32, (size.height() * scale).ceil() as u32);
    let mut pixmap = Pixmap::new(width, height).ok_or(DrawError::Size { width, height })?;
    resvg::render(&tree, Transform::from_scale(scale, scale), &mut pixmap.as_mut());
    pixmap.encode_png().map_err(|error| DrawError::Encode(error.to_string()))
}
