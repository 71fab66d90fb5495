//! Pictures of episodes, drawn elsewhere: they stand in the page as images, since what a drawing calls its parts may come twice.

use std::fmt::Write;
use std::io;
use std::path::{Path, PathBuf};

use crate::figures::escaped;

/// A picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// What stands below it.
    pub caption: String,
    /// The drawing.
    pub svg: String,
}

/// Why pictures were not read.
#[derive(Debug, thiserror::Error)]
pub enum GalleryError {
    /// The file system refused.
    #[error("cannot read {}: {source}", path.display())]
    File {
        /// File or folder.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// There is nothing to show.
    #[error("there is no *.svg in {}", .0.display())]
    Empty(PathBuf),
}

/// The pictures of a folder, by name.
///
/// # Errors
/// A folder or file that cannot be read, or a folder without pictures.
pub fn read(folder: &Path) -> Result<Vec<Picture>, GalleryError> {
    let failed = |path: &Path| {
        let path = path.to_owned();
        move |source| GalleryError::File { path, source }
    };
    let entries: io::Result<Vec<_>> = std::fs::read_dir(folder).map_err(failed(folder))?.collect();
    let mut paths: Vec<PathBuf> =
        entries.map_err(failed(folder))?.iter().map(std::fs::DirEntry::path).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "svg"));
    paths.sort();
    if paths.is_empty() {
        return Err(GalleryError::Empty(folder.to_owned()));
    }
    let picture = |path: &PathBuf| {
        let svg = std::fs::read_to_string(path).map_err(failed(path))?;
        let caption = path.file_stem().unwrap_or_default().to_string_lossy().replace('_', " ");
        Ok(Picture { caption, svg })
    };
    paths.iter().map(picture).collect()
}

impl Picture {
    /// As an element of a page.
    pub(super) fn html(&self) -> String {
        let caption = escaped(&self.caption);
        let mut html = String::from("<figure><img src=\"data:image/svg+xml,");
        for byte in self.svg.bytes() {
            if byte.is_ascii_alphanumeric() || b" =:/.,-_()".contains(&byte) {
                html.push(char::from(byte));
            } else {
                write!(html, "%{byte:02X}").expect("a string takes everything");
            }
        }
        writeln!(html, "\" alt=\"{caption}\"/><figcaption>{caption}</figcaption></figure>")
            .expect("a string takes everything");
        html
    }
}
